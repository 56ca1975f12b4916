//! What rivals a transform has, and where fits may lead.

use super::super::acceptance::{Candidate, Sought, refined};
use super::super::evidence::Evidence;
use super::super::rival_candidates::rival_log_odds;
use super::*;

#[test]
fn rivals_explain_the_same_or_are_elsewhere_and_symmetries_are_none() {
    let settings = FindSettings::default();
    let voxel = 0.12;
    // A brick, which is the same after half a turn about each of its axes, and the uneven body; both in two places.
    let brick = || {
        let half: [f64; 3] = [2.0, 1.0, 0.5];
        let mut all = Vec::new();
        for axis in 0..3 {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            let count = |k: usize| (2.0 * half[k] / 0.1) as i32;
            for (i, j) in (0..count(u)).flat_map(|i| (0..count(v)).map(move |j| (i, j))) {
                for side in [-1.0, 1.0] {
                    let (mut point, mut normal) = ([0.0; 3], Vector3::zeros());
                    point[axis] = side * half[axis];
                    point[u] = (f64::from(i) + 0.5) * 0.1 - half[u];
                    point[v] = (f64::from(j) + 0.5) * 0.1 - half[v];
                    normal[axis] = side;
                    all.push((point, normal));
                }
            }
        }
        all
    };
    let odds_of = |all: Vec<([f64; 3], Vector3<f64>)>| {
        let at = |x: f64, turn: f64| RigidTransform::from_rotation_vector([0.0, 0.0, turn], [x, 0.0, 0.0]);
        let twice = all
            .iter()
            .flat_map(|&(point, normal)| [0.0, 20.0].map(|x| (at(x, 0.0).transform_point(point), normal)));
        let scene = surface_of(&model_of(twice.collect()), voxel);
        let model = model_of(all);
        let view = ModelView::new(&side(&model), scene, None, usize::MAX, &settings).with_rim(&side(&model));
        let sought = Sought::new(0, model, view);
        // There, a little off, after half a turn, and the copy.
        let transforms = [at(0.0, 0.0), at(0.05, 0.02), at(0.0, PI), at(20.0, 0.0)];
        let evidence = [5.0, 4.0, 3.0, 2.0].map(|log_odds| Evidence {
            support: 0.5,
            measures: Measures::default(),
            log_odds,
            visible: 1.0,
            overlap: 1.0,
        });
        rival_log_odds(&sought, &transforms, &evidence, &[0, 1, 2, 3])
    };
    // Nothing on the scene: by default 20 (0 - 0.25).
    let none = -5.0;
    let brick = odds_of(brick());
    assert_eq!(brick[0], none, "half a turn is a symmetry, the second is the same: {brick:?}");
    let body = odds_of(body(4000));
    assert_eq!([body[0], body[1]], [3.0; 2], "the other side lies on the same points: {body:?}");
    assert_eq!(body[3], none, "nothing else is at the copy");
}

#[test]
fn odds_grow_with_the_margin_over_rivals() {
    for is_free_space_known in [true, false] {
        let among = |own: f64, rival: f64| Measures::default().among_rivals(own, rival, is_free_space_known);
        assert!(among(2.0, -3.0).1 > among(2.0, 1.5).1);
        assert_eq!(among(2.0, -7.0).1, among(2.0, -12.0).1, "a large margin is enough");
        let (measures, _) = among(2.0, 1.0);
        assert_eq!([measures.own_log_odds, measures.margin_over_rivals], [2.0, 1.0]);
        let misfit = Measures { misfit: 0.02, ..Default::default() };
        assert!(misfit.among_rivals(2.0, -3.0, is_free_space_known).1 < among(2.0, -3.0).1);
    }
    let with_own = |own: f64| {
        let (measures, log_odds) = Measures::default().among_rivals(own, -5.0, false);
        Evidence { support: 0.5, measures, log_odds, visible: 1.0, overlap: 1.0 }
    };
    let [more, less] = [-0.8, -0.9].map(with_own);
    assert!(more.is_enough(false) && !less.is_enough(false) && less.is_enough(true));
}

#[test]
fn an_egg_of_nearly_the_shape_of_the_model_was_found() {
    let settings = FindSettings::default();
    // Noise of a quarter of a voxel along the normals hides no shape.
    let seen = |stretch: f64| {
        let noisy = (0..).zip(body(6000)).map(|(i, (point, normal))| {
            let point = Vector3::from([point[0], point[1], stretch * point[2]]);
            let noise = 0.03 * (uniform(i, 1) + uniform(i, 2) - 1.0);
            ((point + normal * noise).into(), normal)
        });
        surface_of(&model_of(noisy.collect()), 0.12)
    };
    let model = model_of(body(4000));
    let [same, longer] = [1.0, 1.06].map(|stretch| {
        let scene = seen(stretch);
        let view = ModelView::new(&side(&model), scene, None, usize::MAX, &settings).with_rim(&side(&model));
        let judged = view.judged(&[RigidTransform::identity()], Free::All)[0].among_rivals(-5.0, false);
        (judged.measures.misfit, judged.log_odds)
    });
    assert!(same.0 < 0.003 && longer.0 > 0.008, "{same:?} {longer:?}");
    assert!(longer.1 < same.1 - 2.0, "{same:?} {longer:?}");
}

#[test]
fn a_fit_left_the_place_that_was_judged() {
    let (settings, voxel) = (FindSettings::default(), 0.12);
    let half: Vec<_> = body(6000).into_iter().filter(|(point, _)| point[0] + point[2] > 0.0).collect();
    let model = model_of(body(4000));
    let view = ModelView::new(
        &side(&model),
        surface_of(&model_of(half.clone()), voxel),
        None,
        usize::MAX,
        &settings,
    )
    .with_rim(&side(&model));
    let start = RigidTransform::from_rotation_vector([0.01, -0.02, 0.01], [0.01, 0.0, 0.02]);
    let candidate = Candidate {
        evidence: view.judged(&[start], Free::All)[0].among_rivals(-12.0, false),
        sought: Arc::new(Sought::new(0, model, view)),
        T_scene_model: start,
        rival_log_odds: -12.0,
        is_fitted: false,
    };
    // To the points that it was judged by, and to others that lead it away.
    let fitted_to = |shift: f64| {
        let points: Vec<[f64; 3]> =
            half.iter().map(|(point, _)| [point[0], point[1], point[2] + shift]).collect();
        let scan = CenteredScan::new(&Scan::new(PointCloud::new_f64(&points)));
        let monitor = Monitor::default();
        let mut scene = Scene::new(scan, 1.0, &settings, &monitor).unwrap();
        let center = std::mem::take(&mut scene.scan.center);
        scene.scan.points.iter_mut().for_each(|point| (0..3).for_each(|k| point[k] += center[k]));
        refined(&candidate, &scene, &vec![false; points.len()], Free::All, &settings).unwrap()
    };
    let off = |transform: &RigidTransform| transform.log().iter().map(|x| x.abs()).fold(0.0, f64::max);
    let (near, evidence) = fitted_to(0.0);
    assert!(off(&near.candidate.T_scene_model) < 0.003 && near.candidate.is_fitted);
    assert!(evidence != candidate.evidence);
    let (away, evidence) = fitted_to(0.17);
    assert_eq!(away.candidate.T_scene_model, start);
    assert_eq!(evidence, candidate.evidence);
    assert!(off(&(away.fit.T_target_source * start)) < 1e-12);
}
