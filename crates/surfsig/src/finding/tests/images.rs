//! What the sensor saw before and behind models, in images of the scene's surfaces.

use super::*;

#[test]
fn free_space_speaks_against_what_is_not_there() {
    let settings = FindSettings::default();
    let viewpoint = [0.5, -3.0, 14.0];
    let (points, poses) = scene(viewpoint);
    let scan = CenteredScan::new(&Scan::new(PointCloud::new_f64(&points)).seen_from(viewpoint));
    let model = model_of(body(1500));
    let monitor = Monitor::default();
    let mut prepared = Scene::new(scan, 1.0, &settings, &monitor).unwrap();
    let surface = prepared.fine_surface(0.15).unwrap();
    let center = RigidTransform::from_rotation_vector([0.0; 3], prepared.scan.center);
    let about = |pose: RigidTransform| center.inverse() * pose;
    let view = ModelView::new(&side(&model), Arc::clone(&surface), prepared.viewpoint, usize::MAX, &settings)
        .with_rim(&side(&model));
    let above = RigidTransform::from_rotation_vector([0.4, -1.0, 0.7], [-2.5, 0.3, 2.0]);
    let transforms = [about(poses[0]), about(poses[1]), about(above)];
    let judged = view.judged(&transforms, Free::All);
    assert!(judged[0].support > 0.5 && judged[1].support > 0.5, "{judged:?}");
    assert!(judged[0].score() > 0.5 && judged[1].score() > 0.5, "{judged:?}");
    assert!(judged[2].support < 0.0 && judged[2].score() == 0.0, "{judged:?}");
    // The judgement that costs little says the same of the support.
    let supports = view.supports(&transforms);
    // Images that are kept for all models are larger, and say nearly the same, the second time exactly.
    let kept = prepared.rough_surface(0.15, 0.15).unwrap();
    let of_kept = ModelView::new(&side(&model), kept, prepared.viewpoint, usize::MAX, &settings)
        .with_rim(&side(&model));
    let [first, second] = [0, 1].map(|_| of_kept.supports(&transforms));
    assert_eq!(first, second);
    assert!(
        first.iter().zip(&supports).all(|(a, b)| (a - b).abs() < 0.05 * b.abs()),
        "{first:?} {supports:?}"
    );
    assert!(supports.iter().zip(&judged).all(|(cheap, full)| *cheap == full.support), "{supports:?}");
}

#[test]
fn what_was_far_before_and_behind_a_model_was_not_looked_at() {
    let (settings, viewpoint, voxel) = (FindSettings::default(), [0.0, 0.0, 50.0], 0.12);
    let model = model_of(body(4000));
    // A square across the line of sight, of the same extent for the sensor at any height.
    let square = |height: f64| {
        let wide = (50.0 - height) / 50.0 * 3.0;
        let steps = (2.0 * wide / voxel) as i32;
        let point = move |x: i32, y: i32| {
            let [x, y] = [x, y].map(|step| voxel * f64::from(step) - wide);
            ([x, y, height], Vector3::z())
        };
        model_of((0..=steps).flat_map(|x| (0..=steps).map(move |y| point(x, y))).collect())
    };
    let support_with = |square: Model| {
        let surface = surface_of(&square, voxel);
        let view = ModelView::new(&side(&model), surface, Some(viewpoint), usize::MAX, &settings)
            .with_rim(&side(&model));
        view.supports(&[RigidTransform::identity()])[0]
    };
    // Confirmed samples, less five times those that were seen through.
    let behind = support_with(square(-30.0));
    assert!(behind < -4.0, "a wall that is seen through the model: {behind}");
    let before = support_with(square(15.0));
    assert_eq!(before, 0.0, "a board that hides the model");
}

#[test]
fn a_thread_waited_for_itself_while_the_first_images_were_made() {
    let (settings, viewpoint, voxel) = (FindSettings::default(), [0.0, 0.0, 50.0], 0.03);
    // So many samples that they are sorted by several threads, and images of many cells.
    let surface = || surface_of(&model_of(body(60_000)), voxel);
    let model = model_of(body(300));
    let transforms: Vec<RigidTransform> = (0..64)
        .map(|i| {
            let shift = [f64::from(i % 8), f64::from(i / 8), 0.0];
            RigidTransform::from_rotation_vector([0.0; 3], shift)
        })
        .collect();
    let supports = |threads| {
        with_threads(Some(threads), || {
            let view = ModelView::new(&side(&model), surface(), Some(viewpoint), usize::MAX, &settings)
                .with_rim(&side(&model));
            view.supports(&transforms)
        })
        .unwrap()
    };
    let alone = supports(1);
    for _ in 0..10 {
        assert_eq!(supports(4), alone);
    }
}

#[test]
fn a_coarse_surface_was_taken_for_a_fine_one_of_the_same_voxel() {
    let (settings, monitor) = (FindSettings::default(), Monitor::default());
    let viewpoint = [0.5, -3.0, 14.0];
    let (points, _) = scene(viewpoint);
    let scan = Scan::new(PointCloud::new_f64(&points)).seen_from(viewpoint);
    let prepared = || Scene::new(CenteredScan::new(&scan), 1.0, &settings, &monitor).unwrap();
    let (mut alone, mut after) = (prepared(), prepared());
    let coarse = after.coarse_surface(0.15, 0.3).unwrap();
    let [alone, after] = [alone.fine_surface(0.3).unwrap(), after.fine_surface(0.3).unwrap()];
    assert_eq!(alone.samples(), after.samples());
    assert_ne!(coarse.samples(), after.samples());
    assert!(coarse.keeps_images() && !after.keeps_images());
}
