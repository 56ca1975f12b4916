//! Instances in a small simulated scene, and what speaks for them against slow references.

mod acceptance;
mod images;
mod sources;

use super::evidence::ModelView;
use super::rim::Rim;
use super::samples::mean_length;
use super::scene::{Free, SceneSurface};
use super::side::Side;
use super::*;
use crate::random::uniform;
use crate::spacing::point_spacing;
use crate::visibility::all_seen_from;
use crate::{FieldPlaces, PointCloud, RigidTransform};
use nalgebra::Vector3;
use std::borrow::Cow;
use std::f64::consts::PI;
use std::sync::Arc;

/// Two ellipsoids that meet: half axes and centre of each.
const BODY: [([f64; 3], [f64; 3]); 2] = [([1.0, 1.3, 1.6], [0.0; 3]), ([0.7, 0.5, 0.9], [0.5, 0.9, 1.0])];

fn inside(point: Vector3<f64>) -> bool {
    BODY.iter()
        .any(|(axes, center)| (0..3).map(|k| ((point[k] - center[k]) / axes[k]).powi(2)).sum::<f64>() < 0.999)
}

fn side(model: &Model) -> Side<'_> {
    Side::new(Cow::Borrowed(model))
}

/// Points all over the body, and outward normals.
fn body(count: usize) -> Vec<([f64; 3], Vector3<f64>)> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let of_part = |(axes, center): ([f64; 3], [f64; 3])| {
        (0..count).map(move |i| {
            let z = 1.0 - (2 * i + 1) as f64 / count as f64;
            let (sine, cosine) = (golden * i as f64).sin_cos();
            let on = [(1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z];
            let normal = Vector3::from_fn(|k, _| on[k] / axes[k]).normalize();
            ([0, 1, 2].map(|k| center[k] + axes[k] * on[k]), normal)
        })
    };
    let all = BODY.into_iter().flat_map(of_part);
    all.filter(|(point, _)| !inside(Vector3::from(*point))).collect()
}

/// A floor with two bodies over it, as it is seen from above: points, and where the bodies are.
fn scene(viewpoint: [f64; 3]) -> (Vec<[f64; 3]>, [RigidTransform; 2]) {
    let poses = [
        RigidTransform::from_rotation_vector([0.4, -1.0, 0.7], [-2.5, 0.3, 0.0]),
        RigidTransform::from_rotation_vector([1.9, 0.6, -0.8], [2.5, -0.5, 0.2]),
    ];
    let is_hidden = |point: &[f64; 3]| {
        let (point, viewpoint) = (Vector3::from(*point), Vector3::from(viewpoint));
        (1..60).any(|step| {
            let between = point + (viewpoint - point) * (0.008 * f64::from(step));
            poses.iter().any(|pose| inside(pose.inverse().transform_point(between.into()).into()))
        })
    };
    let floor =
        (0..160 * 110).map(|i| [0.08 * f64::from(i % 160) - 6.4, 0.08 * f64::from(i / 160) - 4.4, -2.4]);
    let mut points: Vec<[f64; 3]> = floor.collect();
    for pose in &poses {
        points.extend(body(6000).into_iter().map(|(point, _)| pose.transform_point(point)));
    }
    points.retain(|point| !is_hidden(point));
    (points, poses)
}

fn found_in(
    points: &[[f64; 3]],
    viewpoint: [f64; 3],
    threads: Option<usize>,
) -> Result<Vec<Instance>, Error> {
    let model: Vec<[f64; 3]> = body(5000).into_iter().map(|(point, _)| point).collect();
    let monitor = Monitor::default();
    let model = Model::new(&Scan::new(PointCloud::new_f64(&model)), threads, &monitor)?;
    assert!(model.is_sided && model.is_closed());
    let scan = Scan::new(PointCloud::new_f64(points)).seen_from(viewpoint);
    let settings = FindSettings { threads, ..Default::default() };
    let found = find_instances(&[&model], &scan, &settings, &monitor)?;
    assert_eq!(monitor.done(), MODEL_STEPS + 2 + FIND_STEPS_PER_MODEL);
    Ok(found)
}

#[test]
fn two_half_seen_bodies_are_found_wherever_the_scene_is_and_on_any_number_of_threads() {
    let viewpoint = [0.5, -3.0, 14.0];
    let (points, poses) = scene(viewpoint);
    let found = found_in(&points, viewpoint, Some(1)).unwrap();
    assert_eq!(found.len(), 2);
    for pose in &poses {
        let error = |instance: &Instance| {
            let off = (pose.inverse() * instance.T_scene_model).log();
            off.iter().map(|x| x.abs()).fold(0.0, f64::max)
        };
        let best = found.iter().map(error).fold(f64::INFINITY, f64::min);
        assert!(best < 0.01, "{best}");
    }
    assert_eq!(found, found_in(&points, viewpoint, Some(3)).unwrap());
    let motion = RigidTransform::from_rotation_vector([0.3, 1.2, -0.4], [4e5, 5e6, 100.0]);
    let moved = found_in(&motion.transform_points(&points), motion.transform_point(viewpoint), None).unwrap();
    assert_eq!(moved.len(), 2);
    for here in &found {
        let off = |there: &Instance| {
            let off = (here.T_scene_model.inverse() * motion.inverse() * there.T_scene_model).log();
            off.iter().map(|x| x.abs()).fold(0.0, f64::max)
        };
        let there = moved.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
        assert!(off(there) < 5e-3, "{}", off(there));
        // On other voxels other rivals are met.
        assert!((here.score - there.score).abs() < 0.1, "{here:?} {there:?}");
    }
}

#[test]
fn instances_depended_on_which_model_was_looked_for_first() {
    let viewpoint = [0.5, -3.0, 14.0];
    let (points, _) = scene(viewpoint);
    let monitor = Monitor::default();
    // The larger patches of the dense model are as large as the smaller ones of the other; their voxels differ.
    let [dense, sparse] = [5000, 1000].map(|count| {
        let model: Vec<[f64; 3]> = body(count).into_iter().map(|(point, _)| point).collect();
        Model::new(&Scan::new(PointCloud::new_f64(&model)), None, &monitor).unwrap()
    });
    let is_shared = |places: &FieldPlaces| places.radius == sparse.places.radius;
    assert!(dense.larger_places.iter().any(is_shared) && dense.spacing < 0.6 * sparse.spacing);
    let scan = Scan::new(PointCloud::new_f64(&points)).seen_from(viewpoint);
    let found =
        |models: [&Model; 2]| find_instances(&models, &scan, &FindSettings::default(), &monitor).unwrap();
    let (one_way, mut other_way) = (found([&dense, &sparse]), found([&sparse, &dense]));
    assert_eq!(one_way.len(), 2);
    other_way.iter_mut().for_each(|instance| instance.model = 1 - instance.model);
    assert_eq!(one_way, other_way);
}

/// A model without signatures: samples with their normals.
fn model_of(samples: Vec<([f64; 3], Vector3<f64>)>) -> Model {
    let (samples, normals): (Vec<[f64; 3]>, Vec<[f64; 3]>) =
        samples.into_iter().map(|(point, normal)| (point, <[f64; 3]>::from(normal))).unzip();
    Model {
        points: samples.clone(),
        center: [0.0; 3],
        spacing: 0.1,
        samples,
        normals,
        places: FieldPlaces::new(1.0),
        larger_places: Vec::new(),
        is_sided: true,
    }
}

fn square(columns: std::ops::Range<i32>, rows: std::ops::Range<i32>) -> Vec<([f64; 3], Vector3<f64>)> {
    let point = |x: i32, y: i32| ([f64::from(x), f64::from(y), 0.0], Vector3::z());
    rows.flat_map(|y| columns.clone().map(move |x| point(x, y))).collect()
}

fn surface_of(model: &Model, voxel: f64) -> Arc<SceneSurface> {
    let all: Vec<usize> = (0..model.samples.len()).collect();
    Arc::new(SceneSurface::new(&model.surface(&all), voxel, 0.3 * voxel))
}

#[test]
fn a_model_ends_where_the_scene_does() {
    let model = model_of(square(0..20, 0..20));
    let samples = model.surface(&(0..400).collect::<Vec<_>>());
    let rim = Rim::new(&side(&model), &samples, 1.0, 0.4);
    let going_on = |scene: Vec<([f64; 3], Vector3<f64>)>, is_touching: bool, is_free: bool| {
        let scene = surface_of(&model_of(scene), 1.0);
        let free = vec![is_free; scene.samples().len()];
        rim.going_on(&RigidTransform::identity(), &[is_touching; 400], &scene, Free::Only(&free))
    };
    assert_eq!(going_on(square(0..20, 0..20), true, true), 0.0);
    assert_eq!(going_on(square(-9..29, -9..29), true, true), 0.5, "a view lies in a larger square");
    assert_eq!(going_on(square(-9..29, -9..29), false, true), 0.0, "nothing of it is seen");
    assert_eq!(going_on(square(-9..29, -9..29), true, false), 0.0, "another instance is beside it");
    // To the right the scene goes on: a share of the rim that a slow search counts, too.
    let wider = square(0..29, 0..20);
    let (mut asked, mut gone_on) = (0.0, 0.0);
    for (point, _) in square(0..20, 0..20) {
        for step in 0..8 {
            let (sine, cosine) = (PI / 4.0 * f64::from(step)).sin_cos();
            let beside = Vector3::from(point) + Vector3::new(cosine, sine, 0.0) * 3.0;
            let near = |all: &[([f64; 3], Vector3<f64>)], reach: f64| {
                all.iter().any(|(other, _)| (Vector3::from(*other) - beside).norm() < reach)
            };
            if !near(&square(0..20, 0..20), 1.5) {
                asked += 1.0;
                gone_on += f64::from(u8::from(near(&wider, 1.0)));
            }
        }
    }
    let expected: f64 = gone_on / asked;
    assert!((going_on(wider, true, true) - 0.5 * expected).abs() < 0.02, "{expected}");
}

#[test]
fn evidence_without_a_viewpoint_is_what_touches() {
    let settings = FindSettings::default();
    let model = model_of(body(1500));
    let scene: Vec<_> = body(4000).into_iter().filter(|(point, _)| point[0] + point[2] > 0.0).collect();
    let (voxel, scene) = (0.12, model_of(scene));
    let view = ModelView::new(&side(&model), surface_of(&scene, voxel), None, usize::MAX, &settings)
        .with_rim(&side(&model));
    let off = RigidTransform::from_rotation_vector([0.01, 0.0, -0.02], [0.02, 0.01, 0.0]);
    let [there, far] =
        view.judged(&[off, RigidTransform::from_rotation_vector([0.0; 3], [9.0, 0.0, 0.0])], Free::All)[..]
    else {
        panic!("two transforms")
    };
    let touches = |(point, normal): (&[f64; 3], &[f64; 3])| {
        let (point, normal) = (off.transform_point(*point), Vector3::from(off.transform_vector(*normal)));
        scene.samples.iter().zip(&scene.normals).any(|(other, facing)| {
            (Vector3::from(*other) - Vector3::from(point)).norm() < voxel
                && Vector3::from(*facing).dot(&normal) > 0.8
        })
    };
    let touching = model.samples.iter().zip(&model.normals).filter(|pair| touches(*pair)).count();
    let share = touching as f64 / model.samples.len() as f64;
    assert!((there.overlap - share).abs() < 2.0 / model.samples.len() as f64, "{} {share}", there.overlap);
    assert_eq!(there.visible, there.overlap);
    assert!(there.score() > 0.9, "{}", there.score());
    assert_eq!((far.score(), far.support, far.overlap), (0.0, 0.0, 0.0));
    let none = vec![false; scene.samples.len()];
    assert_eq!(view.judged(&[off], Free::Only(&none))[0].score(), 0.0, "another instance explains all");
}

#[test]
fn a_viewpoint_counts_where_all_can_have_been_seen_from_it() {
    let (settings, monitor) = (FindSettings::default(), Monitor::default());
    let viewpoint = [0.5, -3.0, 14.0];
    let points: Vec<[f64; 3]> =
        scene(viewpoint).0.iter().map(|point| [0, 1, 2].map(|k| point[k] - viewpoint[k])).collect();
    let scan = Scan::new(PointCloud::new_f64(&points));
    let prepared = |scan: &Scan<'_>| Scene::new(CenteredScan::new(scan), 1.0, &settings, &monitor).unwrap();
    let (given, assumed) = (prepared(&scan.seen_from([0.0; 3])), prepared(&scan));
    assert!(given.is_oriented && given.viewpoint == Some(given.scan.center.map(|x| -x)));
    assert_eq!(assumed.viewpoint, given.viewpoint, "most sensors are at the origin of their own coordinates");
    // The floor hides all else from below.
    let below = [0.0, 0.0, -30.0];
    let wrong = prepared(&scan.seen_from(below));
    assert!(!wrong.is_oriented && wrong.viewpoint.is_none());
    let upwards = vec![[0.0, 0.0, 1.0]; points.len()];
    let both = prepared(&scan.seen_from([0.0; 3]).facing(&upwards));
    assert!(both.is_oriented && both.viewpoint == given.viewpoint && both.scan.viewpoint.is_none());

    // Noise along the lines of sight, and mixed pixels, hide every eighth point behind others.
    let noisy: Vec<[f64; 3]> = (0..)
        .zip(&points)
        .map(|(i, point)| {
            let noise = 0.004 * (uniform(i, 1) - 0.5);
            let mixed = if uniform(i, 2) < 0.2 { 0.08 * uniform(i, 3) } else { 0.0 };
            point.map(|x| x * (1.0 + noise + mixed))
        })
        .collect();
    assert!(!all_seen_from([0.0; 3], &noisy, point_spacing(&noisy)));
    let noisy = Scan::new(PointCloud::new_f64(&noisy));
    assert!(
        prepared(&noisy.seen_from([0.0; 3])).viewpoint.is_some(),
        "noise hid the viewpoint of a depth image"
    );

    let whole: Vec<[f64; 3]> = body(3000).into_iter().map(|(point, _)| point).collect();
    let one_view: Vec<[f64; 3]> = whole.iter().copied().filter(|point| point[0] > 0.5).collect();
    let sides = [
        (&whole, None),
        (&whole, Some([9.0, 0.0, 0.0])),
        (&one_view, None),
        (&one_view, Some([9.0, 0.0, 0.0])),
    ]
    .map(|(points, viewpoint)| {
        let scan = Scan { viewpoint, ..Scan::new(PointCloud::new_f64(points)) };
        Model::new(&scan, None, &monitor).unwrap().is_sided
    });
    // One view has an outer side by its viewpoint only, a whole body by its volume.
    assert_eq!(sides, [true, true, false, true]);
}

#[test]
fn mistakes_are_told() {
    let monitor = Monitor::default();
    let none = Scan::new(PointCloud::new(&[]));
    let few = [[0.0; 3]; 10];
    let told = |points: &[[f64; 3]]| {
        let found = Model::new(&Scan::new(PointCloud::new_f64(points)), None, &monitor);
        found.unwrap_err().to_string()
    };
    assert!(told(&few).contains("50 finite points at least, not 10"));
    assert!(told(&[[1.0; 3]; 100]).contains("one place"));
    let settings = FindSettings::default();
    let whole = model_of(body(300));
    let mut damaged = whole.clone();
    damaged.normals.pop();
    assert!(find_instances(&[&whole], &none, &settings, &monitor).unwrap().is_empty());
    let error = find_instances(&[&damaged], &none, &settings, &monitor).unwrap_err();
    assert!(matches!(error, Error::InvalidModel(_)));
    let stopped = Monitor::default();
    stopped.cancel();
    let points: Vec<[f64; 3]> = body(3000).into_iter().map(|(point, _)| point).collect();
    let scene = Scan::new(PointCloud::new_f64(&points));
    let error = find_instances(&[&whole], &scene, &settings, &stopped).unwrap_err();
    assert_eq!(error, Error::Cancelled);
    let sphere = [[1.0_f32, 0.0, 0.0], [-1.0, 0.0, 0.0]];
    assert_eq!((mean_length(sphere.iter()), mean_length([].iter())), (0.0, 0.0));
}

#[test]
fn what_is_round_is_not_determined_and_a_front_ends_where_nothing_is_beyond() {
    let (settings, viewpoint, voxel) = (FindSettings::default(), [0.0, 0.0, 50.0], 0.12);
    let measures = |all: Vec<([f64; 3], Vector3<f64>)>| {
        let seen = model_of(all.iter().filter(|(_, normal)| normal.z > 0.3).copied().collect());
        let model = model_of(all);
        let view =
            ModelView::new(&side(&model), surface_of(&seen, voxel), Some(viewpoint), usize::MAX, &settings)
                .with_rim(&side(&model));
        let judge = |view: &ModelView<'_>| view.judged(&[RigidTransform::identity()], Free::All)[0].measures;
        assert_eq!(judge(&view).pixels, 0.0, "few samples have no front");
        judge(&view.with_front(&model))
    };
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let on_ball = |i: u32| {
        let z = 1.0 - f64::from(2 * i + 1) / 4000.0;
        let (sine, cosine) = (golden * f64::from(i)).sin_cos();
        let normal = Vector3::new((1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z);
        ((normal * 1.5).into(), normal)
    };
    let (ball, uneven) = (measures((0..4000).map(on_ball).collect()), measures(body(4000)));
    assert!(ball.constraint < 1e-6, "any turn leaves a ball as it is: {ball:?}");
    assert!(uneven.constraint > 0.003, "{uneven:?}");
    for found in [ball, uneven] {
        assert!(found.front_confirmed > 0.95 && found.front_hidden < 0.02, "{found:?}");
        assert!(found.outline_ends > 0.5 && found.outline_goes_on < 0.05, "{found:?}");
        assert!(found.pixels > 200.0 && found.uncovered < 0.05, "{found:?}");
    }
}
