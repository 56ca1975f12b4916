//! The extraction through the public face: values, bits, places, errors, and a caller who stops it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use surfsig::{
    CellIndex, Error, ExtractOptions, Extraction, FitAxes, InstructionSet, Monitor, Neighborhood, PointCloud,
    Queries, Radius, Status, extract, extract_monitored, voxel_representatives,
};

/// A reproducible value in [0, 1).
fn random(i: usize, column: u64) -> f64 {
    let mut x = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ column.wrapping_mul(0xd1b5_4a32_d192_ed03);
    for shift in [30, 27, 31] {
        x = (x ^ (x >> shift)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    (x >> 11) as f64 / (1_u64 << 53) as f64
}

/// A bumpy height field over the square of side 2, with noise.
fn bumpy(count: usize) -> Vec<[f64; 3]> {
    (0..count)
        .map(|i| {
            let (x, y, noise) = (2.0 * random(i, 1) - 1.0, 2.0 * random(i, 2) - 1.0, random(i, 3) - 0.5);
            [x, y, 0.2 * x * x - 0.1 * y * y + 0.1 * (3.0 * x).sin() * (2.0 * y).cos() + 0.02 * noise]
        })
        .collect()
}

/// A cap of a sphere of radius 1 about 0, as seen from +z.
fn cap(count: usize) -> Vec<[f64; 3]> {
    (0..count)
        .map(|i| {
            let (x, y) = (0.4 * random(i, 1) - 0.2, 0.4 * random(i, 2) - 0.2);
            [x, y, (1.0 - x * x - y * y).sqrt()]
        })
        .collect()
}

fn radius(length: f64) -> Radius {
    Radius::new(length).unwrap()
}

fn above() -> ExtractOptions<'static> {
    ExtractOptions { viewpoint: Some([0.0, 0.0, 50.0]), ..ExtractOptions::default() }
}

/// Every number of an extraction, as bits, query by query.
fn bits(found: &Extraction, i: usize) -> Vec<u32> {
    let mut row = vec![found.count[i], found.status[i] as u32];
    let scalars = [
        &found.k1,
        &found.k2,
        &found.residual,
        &found.condition,
        &found.linearity,
        &found.planarity,
        &found.scattering,
    ];
    row.extend(scalars.iter().map(|column| column[i].to_bits()));
    row.extend(found.normals[i].iter().chain(&found.directions[i]).map(|v| v.to_bits()));
    row.extend(found.coefficients.get(i).into_iter().flatten().map(|v| v.to_bits()));
    row
}

fn assert_same_bits(found: &Extraction, expected: &Extraction) {
    assert_eq!(found.len(), expected.len());
    for i in 0..found.len() {
        assert_eq!(bits(found, i), bits(expected, i), "query {i}");
    }
}

#[test]
fn every_instruction_set_and_every_number_of_threads_gives_the_same_bits() {
    let points = bumpy(4000);
    let cloud = PointCloud::new_f64(&points).with_origin([500_000.0, 4_500_000.0, 100.0]);
    for axes in [FitAxes::Surface, FitAxes::Sensor] {
        let options = |instruction_set, threads| ExtractOptions { axes, instruction_set, threads, ..above() };
        let expected = extract(&cloud, radius(0.2), &options(None, None)).unwrap();
        for set in InstructionSet::available() {
            for threads in [1, 2, 3, 8] {
                let found = extract(&cloud, radius(0.2), &options(Some(set), Some(threads))).unwrap();
                assert_same_bits(&found, &expected);
            }
        }
    }
}

/// Dense enough for the hierarchy: some 1,000 neighbours within 0.2, and a corner with thousands.
fn dense() -> Vec<[f64; 3]> {
    let mut points = bumpy(20_000);
    points.extend(bumpy(8_000).iter().map(|p| [0.2 * p[0] + 0.6, 0.2 * p[1] - 0.6, 0.2 * p[2]]));
    points
}

#[test]
fn a_dense_cloud_has_the_same_bits_for_every_instruction_set_and_number_of_threads() {
    let points = dense();
    let cloud = PointCloud::new_f64(&points).with_origin([500_000.0, 4_500_000.0, 100.0]);
    let options = |instruction_set, threads| ExtractOptions { instruction_set, threads, ..above() };
    let expected = extract(&cloud, radius(0.2), &options(None, None)).unwrap();
    for set in InstructionSet::available() {
        for threads in [1, 2, 8] {
            let found = extract(&cloud, radius(0.2), &options(Some(set), Some(threads))).unwrap();
            assert_same_bits(&found, &expected);
        }
    }
}

#[test]
fn a_tile_with_a_margin_of_one_radius_has_the_bits_of_the_whole_cloud() {
    let points = dense();
    for origin in [[0.0; 3], [500_000.0, 4_500_000.0, 100.0]] {
        let whole =
            extract(&PointCloud::new_f64(&points).with_origin(origin), radius(0.2), &above()).unwrap();
        for [low, high] in [[[-0.31, -0.77], [0.22, -0.13]], [[0.5, -0.8], [0.77, -0.47]]] {
            let within = |p: &[f64; 3], margin: f64| {
                (0..2).all(|axis| p[axis] >= low[axis] - margin && p[axis] <= high[axis] + margin)
            };
            let numbers: Vec<usize> = (0..points.len()).filter(|&i| within(&points[i], 0.2001)).collect();
            let tile: Vec<[f64; 3]> = numbers.iter().map(|&i| points[i]).collect();
            let found =
                extract(&PointCloud::new_f64(&tile).with_origin(origin), radius(0.2), &above()).unwrap();
            let inner: Vec<usize> = (0..tile.len()).filter(|&i| within(&tile[i], 0.0)).collect();
            assert!(inner.len() > 1000);
            for i in inner {
                assert_eq!(bits(&found, i), bits(&whole, numbers[i]), "{:?}", tile[i]);
            }
        }
    }
}

#[test]
fn dense_cells_have_the_curvature_of_the_direct_walk_and_the_bits_of_chosen_points() {
    let points = dense();
    let cloud = PointCloud::new_f64(&points);
    let found = extract(&cloud, radius(0.2), &above()).unwrap();
    let chosen: Vec<u32> = (0..1000).map(|i| (random(i, 9) * points.len() as f64) as u32).collect();
    let ask = |neighborhood: Neighborhood| {
        extract_monitored(&cloud, neighborhood, &Queries::Indices(&chosen), &above(), &Monitor::default())
            .unwrap()
    };
    let few = ask(radius(0.2).into());
    // Chosen by distance, points are looked at one by one.
    let direct = ask(Neighborhood::Hybrid { radius: radius(0.2), most: points.len() });
    for (row, &i) in chosen.iter().enumerate() {
        let i = i as usize;
        assert_eq!(bits(&few, row), bits(&found, i));
        assert_eq!((found.count[i], found.status[i]), (direct.count[row], direct.status[row]));
        for (a, b) in [(found.k1[i], direct.k1[row]), (found.k2[i], direct.k2[row])] {
            assert!((a - b).abs() <= 1e-5 * b.abs().max(1.0 / 0.2), "{a} {b}");
        }
    }
}

#[test]
fn a_sphere_has_its_curvature_at_any_origin_and_in_either_precision() {
    let points = cap(6000);
    let single: Vec<[f32; 3]> = points.iter().map(|p| p.map(|c| c as f32)).collect();
    let top = [[0.0, 0.0, 1.0]];
    for origin in [[0.0; 3], [500_000.0, 4_500_000.0, 100.0]] {
        let place = [0, 1, 2].map(|axis| top[0][axis] + origin[axis]);
        for cloud in [PointCloud::new_f64(&points), PointCloud::new(&single)] {
            for (height, sign) in [(50.0, 1.0), (-50.0, -1.0)] {
                for axes in [FitAxes::Surface, FitAxes::Sensor] {
                    let viewpoint = Some([origin[0], origin[1], origin[2] + height]);
                    let options = ExtractOptions { axes, viewpoint, ..ExtractOptions::default() };
                    let places = [place];
                    let queries = Queries::Positions(PointCloud::new_f64(&places));
                    let cloud = cloud.with_origin(origin);
                    let found =
                        extract_monitored(&cloud, radius(0.05), &queries, &options, &Monitor::default())
                            .unwrap();
                    assert_eq!(found.status, [Status::Ok]);
                    assert!(found.oriented);
                    for k in [found.k1[0], found.k2[0]] {
                        assert!((k - sign).abs() < 0.005, "{k} {sign} {axes:?}");
                    }
                    assert!((found.normals[0][2] - sign).abs() < 1e-6);
                }
            }
        }
    }
}

#[test]
fn chosen_points_and_places_have_the_bits_of_all_points() {
    let points = bumpy(3000);
    let cloud = PointCloud::new_f64(&points);
    let whole = extract(&cloud, radius(0.2), &above()).unwrap();
    let chosen: Vec<u32> = (0..500).map(|i| (random(i, 9) * 3000.0) as u32).collect();
    let places: Vec<[f64; 3]> = chosen.iter().map(|&i| points[i as usize]).collect();
    for queries in [Queries::Indices(&chosen), Queries::Positions(PointCloud::new_f64(&places))] {
        let monitor = Monitor::default();
        let found = extract_monitored(&cloud, radius(0.2), &queries, &above(), &monitor).unwrap();
        assert_eq!(monitor.done(), 500);
        for (row, &i) in chosen.iter().enumerate() {
            assert_eq!(bits(&found, row), bits(&whole, i as usize));
        }
    }
}

#[test]
fn a_far_outlier_and_a_point_that_is_not_finite_change_no_bit() {
    let mut points = bumpy(2000);
    let expected = extract(&PointCloud::new_f64(&points), radius(0.2), &above()).unwrap();
    points.extend([[1e6, -1e6, 1e6], [f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0]]);
    let cloud = PointCloud::new_f64(&points);
    let found = extract(&cloud, radius(0.2), &above()).unwrap();
    for i in 0..2000 {
        assert_eq!(bits(&found, i), bits(&expected, i));
    }
    assert_eq!(found.status[2000..], [Status::TooFewPoints, Status::NotFinite, Status::NotFinite]);
    assert_eq!(found.count[2000..], [1, 0, 0]);
    assert_eq!(CellIndex::new(&cloud, radius(0.2)).unwrap().len(), 2001);
}

#[test]
fn voxels_are_stood_for_by_points_near_their_middle() {
    // Three points of one voxel, of which the second is nearest to the mean; one of another.
    let points = [[0.1, 0.1, 0.1], [0.5, 0.4, 0.5], [0.9, 0.9, 0.9], [-0.1, 0.5, 0.5], [f64::NAN; 3]];
    for origin in [[0.0; 3], [500_000.0, 4_500_000.0, 100.0]] {
        let cloud = PointCloud::new_f64(&points).with_origin(origin);
        assert_eq!(voxel_representatives(&cloud, radius(1.0)).unwrap(), [1, 3]);
        assert_eq!(voxel_representatives(&cloud, radius(0.01)).unwrap(), [0, 1, 2, 3]);
    }
    assert!(matches!(
        voxel_representatives(&PointCloud::new_f64(&points), radius(1e-17)),
        Err(Error::RadiusBelowResolution { .. })
    ));
}

#[test]
fn nothing_gives_nothing() {
    let none: [[f32; 3]; 0] = [];
    let found = extract(&PointCloud::new(&none), radius(1.0), &ExtractOptions::default()).unwrap();
    assert!(found.is_empty());
    assert!(!found.oriented);
    assert!(CellIndex::new(&PointCloud::new(&none), radius(1.0)).unwrap().is_empty());
    assert!(voxel_representatives(&PointCloud::new(&none), radius(1.0)).unwrap().is_empty());
}

#[test]
fn mistakes_are_errors_that_say_what_is_wrong() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e300] {
        assert!(matches!(Radius::new(bad), Err(Error::InvalidRadius(_))), "{bad}");
    }
    let points = bumpy(10);
    let cloud = PointCloud::new_f64(&points);
    let ask = |queries| extract_monitored(&cloud, radius(0.2), &queries, &above(), &Monitor::default());
    assert_eq!(ask(Queries::Indices(&[3, 10])).unwrap_err(), Error::IndexOutOfRange { index: 10, len: 10 });
    let far = [[1e300, 0.0, 0.0]];
    let error = ask(Queries::Positions(PointCloud::new_f64(&far))).unwrap_err();
    assert!(matches!(error, Error::RadiusBelowResolution { .. }));
    assert!(!error.to_string().contains('\n'));
    assert!(matches!(
        extract(&cloud, radius(1e-18), &above()),
        Err(Error::RadiusBelowResolution { radius: 1e-18, .. })
    ));
}

#[test]
fn a_monitor_stops_a_long_extraction_and_tells_how_far_it_came() {
    let points: Vec<[f64; 3]> = (0..60_000).map(|i| [1, 2, 3].map(|column| random(i, column))).collect();
    let cloud = PointCloud::new_f64(&points);
    let monitor = Monitor::default();
    let ended = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let work = scope.spawn(|| {
            let options = ExtractOptions { threads: Some(1), ..ExtractOptions::default() };
            let result = extract_monitored(&cloud, radius(0.3), &Queries::All, &options, &monitor);
            ended.store(true, Ordering::SeqCst);
            result
        });
        while monitor.done() == 0 && !ended.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(1));
        }
        monitor.cancel();
        assert_eq!(work.join().unwrap().unwrap_err(), Error::Cancelled);
        assert!(monitor.done() > 0 && monitor.done() < 60_000);
    });
}

#[test]
fn the_paraboloid_of_a_query_is_in_patch_units() {
    let points = cap(6000);
    let cloud = PointCloud::new_f64(&points);
    let top = [[0.0, 0.0, 1.0]];
    let queries = Queries::Positions(PointCloud::new_f64(&top));
    for axes in [FitAxes::Surface, FitAxes::Sensor] {
        let options = ExtractOptions { axes, ..above() };
        let found = extract_monitored(&cloud, radius(0.05), &queries, &options, &Monitor::default()).unwrap();
        let p = found.paraboloid(0);
        // Half the curvature, 1, times the patch's side, 0.1.
        for value in [p.a, p.b] {
            assert!((value - 0.05).abs() < 3e-4, "{value}");
        }
        for value in [p.c, p.d, p.e, p.f] {
            assert!(value.abs() < 3e-4, "{value}");
        }
        assert_eq!(found.coefficients.is_empty(), axes == FitAxes::Surface);
    }
}

#[test]
fn a_radius_that_is_accepted_finds_its_points() {
    let points = bumpy(1000);
    let expected = extract(&PointCloud::new_f64(&points), radius(0.3), &ExtractOptions::default()).unwrap();
    for scale in [1e-17, 1e-12, 1e12, 1e17] {
        let scaled: Vec<[f64; 3]> = points.iter().map(|p| p.map(|c| scale * c)).collect();
        let options = ExtractOptions::default();
        let found = extract(&PointCloud::new_f64(&scaled), radius(0.3 * scale), &options).unwrap();
        assert_eq!(found.count, expected.count, "{scale}");
    }
}
