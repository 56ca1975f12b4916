//! Field signatures: the same bits on every instruction set and for any number of threads.

use surfsig::{
    FieldOptions, FieldPatches, FieldSignature, InstructionSet, Monitor, PointCloud, Queries, Radius, Status,
    field_pools, field_signatures,
};

fn bumps() -> Vec<[f64; 3]> {
    (0..120 * 120)
        .map(|i| (f64::from(i % 120) * 0.02, f64::from(i / 120) * 0.02))
        .map(|(x, y)| [x, y, 0.1 * (5.0 * x + y).sin() * (3.0 * y - x).cos()])
        .collect()
}

fn signatures(points: &[[f64; 3]], options: &FieldOptions<'_>) -> FieldPatches<FieldSignature> {
    let places: Vec<u32> = (0..points.len() as u32).step_by(97).collect();
    let options = FieldOptions { viewpoint: Some([1.2, 1.2, 9.0]), ..options.clone() };
    let radius = Radius::new(0.4).unwrap();
    let queries = Queries::Indices(&places);
    field_signatures(&PointCloud::new_f64(points), radius, &queries, &options, &Monitor::default()).unwrap()
}

#[test]
fn every_instruction_set_and_number_of_threads_gives_the_same_bits() {
    let points = bumps();
    let one = signatures(&points, &FieldOptions { threads: Some(1), ..Default::default() });
    assert!(one.status.iter().all(|&status| status == Status::Ok));
    for set in InstructionSet::available() {
        for threads in [1, 3] {
            let options =
                FieldOptions { threads: Some(threads), instruction_set: Some(set), ..Default::default() };
            let other = signatures(&points, &options);
            for (a, b) in one.values.iter().zip(&other.values) {
                assert_eq!(a.vector, b.vector, "{} {threads}", set.name());
                assert_eq!(a.phases, b.phases, "{} {threads}", set.name());
            }
            assert_eq!(one.axes, other.axes);
        }
    }
}

#[test]
fn a_turn_of_the_patch_leaves_magnitudes_and_turns_phases() {
    // A quarter turn maps the lattice of points, and nearly that of voxels, onto itself.
    let points = bumps();
    let turned: Vec<[f64; 3]> = points.iter().map(|&[x, y, z]| [-y, x, z]).collect();
    let [place, turned_place] = [[[1.2, 1.2, 0.0]], [[-1.2, 1.2, 0.0]]];
    let of = |points: &[[f64; 3]], place: &[[f64; 3]]| {
        let options = FieldOptions { viewpoint: Some([place[0][0], place[0][1], 9.0]), ..Default::default() };
        let queries = Queries::Positions(PointCloud::new_f64(place));
        let radius = Radius::new(0.4).unwrap();
        field_signatures(&PointCloud::new_f64(points), radius, &queries, &options, &Monitor::default())
            .unwrap()
    };
    let (a, b) = (of(&points, &place), of(&turned, &turned_place));
    let alike: f32 = a.values[0].vector.iter().zip(b.values[0].vector.iter()).map(|(a, b)| a * b).sum();
    assert!(alike > 0.99, "{alike}");
    // The turn between the two tangents, as the vectors say and as the phases of order 1 do.
    let [carried, tangent, axis] =
        [[-a.tangents[0][1], a.tangents[0][0], a.tangents[0][2]], b.tangents[0], b.axes[0]];
    let dot = |a: [f32; 3], b: [f32; 3]| (0..3).map(|i| a[i] * b[i]).sum::<f32>();
    let across = [
        axis[1] * tangent[2] - axis[2] * tangent[1],
        axis[2] * tangent[0] - axis[0] * tangent[2],
        axis[0] * tangent[1] - axis[1] * tangent[0],
    ];
    let expected = dot(carried, across).atan2(dot(carried, tangent));
    let [mut re, mut im] = [0.0_f32; 2];
    for (p, q) in a.values[0].phases[0].iter().zip(&b.values[0].phases[0]) {
        re += p[0] * q[0] + p[1] * q[1];
        im += p[0] * q[1] - p[1] * q[0];
    }
    let difference = im.atan2(re) - expected;
    assert!(difference.sin().abs() < 0.05 && difference.cos() > 0.0, "{difference}");
}

#[test]
fn directions_are_one_for_each_point() {
    let points = bumps();
    let options = FieldOptions { directions: Some(&[[0.0, 0.0, 1.0]]), ..Default::default() };
    let cloud = PointCloud::new_f64(&points);
    let found = field_pools(&cloud, Radius::new(0.4).unwrap(), &Queries::All, &options, &Monitor::default());
    assert!(matches!(
        found.unwrap_err(),
        surfsig::Error::DirectionsMismatch { directions: 1, queries: 14_400 }
    ));
}
