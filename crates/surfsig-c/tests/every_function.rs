//! Every function of the header, called with what C can give by mistake: null pointers, counts of zero, coordinates
//! that are not finite, counts that no memory holds, numbers that no enum has. Each must return, and say what is wrong.

#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "mistakes on purpose, which the functions must survive"
)]

use std::collections::BTreeSet;
use std::ffi::{CStr, c_int, c_void};
use std::path::Path;
use std::ptr::{null, null_mut};
use surfsig_c::*;

const OK: surfsig_code = surfsig_code::Ok;
const INVALID: surfsig_code = surfsig_code::InvalidInput;
const UNDETERMINED: surfsig_code = surfsig_code::Undetermined;

/// Counts of which no array is that long.
const HUGE: [usize; 4] = [usize::MAX, usize::MAX / 8, usize::MAX / 24 + 1, u32::MAX as usize + 1];

/// Numbers of which one is none.
const BAD: [f64; 16] = [f64::NAN; 16];

/// Points of a wavy surface, so that all fits have something to do.
fn wave() -> Vec<[f64; 3]> {
    let place = |i: i32| (0.1 * f64::from(i % 20), 0.1 * f64::from(i / 20));
    (0..400).map(place).map(|(x, y)| [x, y, 0.05 * (3.0 * x).sin() * (2.0 * y).cos()]).collect()
}

/// Points of a sphere of radius 1 about (1, 2, 3).
fn sphere() -> Vec<[f64; 3]> {
    (0..400)
        .map(|i| (1.0 - (2.0 * f64::from(i) + 1.0) / 400.0, 2.4 * f64::from(i)))
        .map(|(z, t)| {
            let away = (1.0 - z * z).sqrt();
            [1.0 + away * t.cos(), 2.0 + away * t.sin(), 3.0 + z]
        })
        .collect()
}

/// A cloud of the test's own points, freed at its end.
struct Cloud(*mut surfsig_cloud);

impl Cloud {
    fn of(points: &[[f64; 3]]) -> Self {
        let mut made = null_mut();
        let code =
            unsafe { surfsig_cloud_new_f64(points.as_ptr().cast(), points.len(), 24, null(), &mut made) };
        assert_eq!(code, OK);
        Self(made)
    }

    fn get(&self) -> Option<&surfsig_cloud> {
        unsafe { self.0.as_ref() }
    }
}

impl Drop for Cloud {
    fn drop(&mut self) {
        surfsig_cloud_free(owned(self.0));
    }
}

/// What C gives to a function that frees.
fn owned<T>(object: *mut T) -> Option<Box<T>> {
    (!object.is_null()).then(|| unsafe { Box::from_raw(object) })
}

fn last_error() -> String {
    unsafe { CStr::from_ptr(surfsig_last_error()) }.to_str().unwrap().to_owned()
}

/// The names of the functions that a test has called.
struct Called(BTreeSet<&'static str>);

/// Checks what a call returns, and that the text of a failure is one line of words.
macro_rules! call {
    ($called:ident, $function:ident($($argument:expr),* $(,)?) gives $expected:expr) => {{
        $called.0.insert(stringify!($function));
        #[allow(unused_unsafe)]
        let code = unsafe { $function($($argument),*) };
        assert_eq!(code, $expected, "{}: {}", stringify!($function($($argument),*)), last_error());
        if code != OK {
            let text = last_error();
            assert!(!text.is_empty() && !text.contains('\n') && !text.contains("internal"), "{text}");
        }
    }};
    ($called:ident, $function:ident($($argument:expr),* $(,)?)) => {{
        $called.0.insert(stringify!($function));
        #[allow(unused_unsafe)]
        unsafe { $function($($argument),*) }
    }};
}

/// Functions that give a column, or another first entry, of a result.
macro_rules! null_of_null {
    ($called:ident: $($function:ident),* $(,)?) => {
        $(assert!(call!($called, $function(None)).is_null(), "{}", stringify!($function));)*
    };
}

#[test]
fn no_function_of_the_header_fails_but_by_a_code() {
    let mut called = Called(BTreeSet::new());
    texts(&mut called);
    clouds(&mut called);
    options(&mut called);
    extractions(&mut called);
    surfaces(&mut called);
    primitives(&mut called);
    moments(&mut called);
    transforms(&mut called);

    let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/surfsig.h");
    let text = std::fs::read_to_string(header).unwrap();
    let listed = functions_of(&text);
    assert!(listed.len() > 60);
    let missing: Vec<_> = listed.difference(&called.0).collect();
    assert!(missing.is_empty(), "functions that this test does not call: {missing:?}");
    let gone: Vec<_> = called.0.difference(&listed).collect();
    assert!(gone.is_empty(), "functions that the header does not have: {gone:?}");
}

/// The names before an opening bracket in declarations, which are the lines of code that no comment is.
fn functions_of(header: &str) -> BTreeSet<&str> {
    let code = header.lines().filter(|line| !line.starts_with([' ', '/', '#', '}']));
    code.filter_map(|line| {
        let (before, _) = line.split_once('(')?;
        let name = before.rsplit([' ', '*']).next()?;
        name.starts_with("surfsig_").then_some(name)
    })
    .collect()
}

fn texts(called: &mut Called) {
    assert!(!call!(called, surfsig_version()).is_null());
    assert!(!call!(called, surfsig_last_error()).is_null());
    for number in [surfsig::Status::ALL.len() as u8, 255] {
        assert!(call!(called, surfsig_status_name(number)).is_null());
    }
    for number in [surfsig::SurfaceKind::ALL.len() as u8, 255] {
        assert!(call!(called, surfsig_surface_kind_name(number)).is_null());
        assert_eq!(call!(called, surfsig_surface_kind_parameters(number)), 0);
    }
}

fn clouds(called: &mut Called) {
    let (single, double) = ([[0.0_f32; 3]; 2], [[0.0_f64; 3]; 2]);
    let (single, double) = (single.as_ptr().cast::<f32>(), double.as_ptr().cast::<f64>());
    let mut made: *mut surfsig_cloud = null_mut();
    let out = &raw mut made;
    call!(called, surfsig_cloud_new_f32(null(), 2, 12, null(), out) gives INVALID);
    call!(called, surfsig_cloud_new_f64(null(), 2, 24, null(), out) gives INVALID);
    call!(called, surfsig_cloud_new_f32(single, 2, 12, null(), null_mut()) gives INVALID);
    call!(called, surfsig_cloud_new_f64(double, 2, 24, null(), null_mut()) gives INVALID);
    for stride in [0, 1, 11] {
        call!(called, surfsig_cloud_new_f32(single, 2, stride, null(), out) gives INVALID);
        call!(called, surfsig_cloud_new_f64(double, 2, stride, null(), out) gives INVALID);
    }
    for stride in [usize::MAX, usize::MAX / 2] {
        call!(called, surfsig_cloud_new_f32(single, 2, stride, null(), out) gives INVALID);
        call!(called, surfsig_cloud_new_f64(double, 2, stride, null(), out) gives INVALID);
    }
    for count in HUGE {
        for stride in [24, 32] {
            call!(called, surfsig_cloud_new_f32(single, count, stride, null(), out) gives INVALID);
            call!(called, surfsig_cloud_new_f64(double, count, stride, null(), out) gives INVALID);
            assert!(made.is_null());
        }
    }
    call!(called, surfsig_cloud_new_f32(single, 2, 12, BAD.as_ptr(), out) gives INVALID);
    call!(called, surfsig_cloud_new_f64(double, 2, 24, BAD.as_ptr(), out) gives INVALID);
    call!(called, surfsig_cloud_new_f32(null(), 0, 0, null(), out) gives OK);
    assert_eq!(call!(called, surfsig_cloud_size(unsafe { made.as_ref() })), 0);
    surfsig_cloud_free(owned(made));
    assert_eq!(call!(called, surfsig_cloud_size(None)), 0);
    call!(called, surfsig_cloud_free(None));
}

unsafe extern "C" fn stop(_data: *mut c_void, _done: usize, _total: usize) -> c_int {
    1
}

fn options(called: &mut Called) {
    call!(called, surfsig_options_set_axes(None, 0) gives INVALID);
    call!(called, surfsig_options_set_fit(None, 0) gives INVALID);
    call!(called, surfsig_options_set_viewpoint(None, null()) gives INVALID);
    call!(called, surfsig_options_set_normals(None, null(), 0) gives INVALID);
    call!(called, surfsig_options_set_threads(None, 0) gives INVALID);
    call!(called, surfsig_options_set_neighbors(None, 0) gives INVALID);
    call!(called, surfsig_options_set_robust(None, 0) gives INVALID);
    call!(called, surfsig_options_set_all(None) gives INVALID);
    call!(called, surfsig_options_set_indices(None, null(), 0) gives INVALID);
    call!(called, surfsig_options_set_positions(None, null(), 0) gives INVALID);
    call!(called, surfsig_options_set_voxel(None, 1.0) gives INVALID);
    call!(called, surfsig_options_set_progress(None, Some(stop), null_mut()) gives INVALID);
    call!(called, surfsig_options_free(None));
    let mut options = call!(called, surfsig_options_new());
    for number in [c_int::MIN, -1, 3, c_int::MAX] {
        call!(called, surfsig_options_set_axes(Some(&mut options), number) gives INVALID);
        call!(called, surfsig_options_set_fit(Some(&mut options), number) gives INVALID);
    }
    call!(called, surfsig_options_set_viewpoint(Some(&mut options), BAD.as_ptr()) gives INVALID);
    call!(called, surfsig_options_set_threads(Some(&mut options), u32::MAX) gives INVALID);
    call!(called, surfsig_options_set_indices(Some(&mut options), null(), 1) gives INVALID);
    call!(called, surfsig_options_set_positions(Some(&mut options), null(), 1) gives INVALID);
    let (byte, numbers) = ([0_u8; 16], [0.0_f64; 4]);
    for count in HUGE {
        call!(called, surfsig_options_set_indices(Some(&mut options), numbers.as_ptr().cast(), count) gives INVALID);
        call!(called, surfsig_options_set_positions(Some(&mut options), numbers.as_ptr(), count) gives INVALID);
        call!(called, surfsig_options_set_normals(Some(&mut options), numbers.as_ptr().cast(), count) gives INVALID);
    }
    let misaligned = byte.as_ptr().wrapping_add(usize::from(byte.as_ptr().cast::<f64>().is_aligned()));
    call!(called, surfsig_options_set_positions(Some(&mut options), misaligned.cast(), 1) gives INVALID);
    for voxel in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        call!(called, surfsig_options_set_voxel(Some(&mut options), voxel) gives INVALID);
    }
    call!(called, surfsig_options_free(Some(options)));

    call!(called, surfsig_surface_options_set_min_points(None, 0) gives INVALID);
    call!(called, surfsig_surface_options_set_noise(None, 0.0) gives INVALID);
    call!(called, surfsig_surface_options_set_kinds(None, null(), 0) gives INVALID);
    call!(called, surfsig_surface_options_set_threads(None, 0) gives INVALID);
    call!(called, surfsig_surface_options_set_progress(None, Some(stop), null_mut()) gives INVALID);
    call!(called, surfsig_surface_options_free(None));
    let mut options = call!(called, surfsig_surface_options_new());
    for noise in [-1.0, f64::NAN, f64::INFINITY] {
        call!(called, surfsig_surface_options_set_noise(Some(&mut options), noise) gives INVALID);
    }
    call!(called, surfsig_surface_options_set_threads(Some(&mut options), 1025) gives INVALID);
    call!(called, surfsig_surface_options_set_kinds(Some(&mut options), null(), 1) gives INVALID);
    call!(called, surfsig_surface_options_set_kinds(Some(&mut options), [0, 5].as_ptr(), 2) gives INVALID);
    for count in HUGE {
        call!(called, surfsig_surface_options_set_kinds(Some(&mut options), byte.as_ptr(), count) gives INVALID);
    }
    call!(called, surfsig_surface_options_free(Some(options)));
}

/// Clouds that are odd but no mistake: no point, one, points in one place, points that are not finite, and all sizes of
/// coordinates.
fn odd_clouds() -> Vec<Vec<[f64; 3]>> {
    let mut some_are_none = wave();
    some_are_none[7] = [f64::NAN, 0.0, 0.0];
    some_are_none[8] = [f64::INFINITY, f64::NEG_INFINITY, 0.0];
    let large = wave().into_iter().map(|p| p.map(|c| 1e300 * c)).collect();
    let far = vec![[f64::MAX; 3], [f64::MIN; 3], [0.0; 3]];
    vec![
        vec![],
        vec![[0.0; 3]],
        vec![[1.0, 2.0, 3.0]; 30],
        vec![[f64::NAN; 3]; 30],
        (0..30).map(|i| [f64::from(i), 0.0, 0.0]).collect(),
        some_are_none,
        large,
        far,
    ]
}

fn extractions(called: &mut Called) {
    let (points, mut made) = (wave(), null_mut::<surfsig_extraction>());
    let cloud = Cloud::of(&points);
    let out = &raw mut made;
    call!(called, surfsig_extract(None, 1.0, None, out) gives INVALID);
    call!(called, surfsig_extract(cloud.get(), 1.0, None, null_mut()) gives INVALID);
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE, f64::MAX] {
        call!(called, surfsig_extract(cloud.get(), radius, None, out) gives INVALID);
        call!(called, surfsig_extract_radii(cloud.get(), &radius, 1, None, out) gives INVALID);
        assert!(made.is_null());
    }
    call!(called, surfsig_extract_nearest(None, 9, None, out) gives INVALID);
    call!(called, surfsig_extract_nearest(cloud.get(), 0, None, out) gives INVALID);
    call!(called, surfsig_extract_nearest(cloud.get(), 9, None, null_mut()) gives INVALID);
    call!(called, surfsig_extract_auto_radius(None, None, out) gives INVALID);
    call!(called, surfsig_extract_auto_radius(cloud.get(), None, null_mut()) gives INVALID);
    call!(called, surfsig_extract_radii(None, &1.0, 1, None, out) gives INVALID);
    call!(called, surfsig_extract_radii(cloud.get(), null(), 1, None, out) gives INVALID);
    call!(called, surfsig_extract_radii(cloud.get(), &1.0, 1, None, null_mut()) gives INVALID);
    call!(called, surfsig_extract_radii(cloud.get(), null(), 0, None, null_mut()) gives OK);
    for count in HUGE {
        call!(called, surfsig_extract_radii(cloud.get(), null(), count, None, null_mut()) gives INVALID);
    }

    for points in odd_clouds() {
        let cloud = Cloud::of(&points);
        // Whether coordinates are too large for a radius is the core's to say; that it says so is all that counts.
        let mut check = |code: surfsig_code| {
            // Of coordinates too large for any radius the core says that it was stopped.
            assert!([OK, INVALID, surfsig_code::Cancelled].contains(&code), "{}", last_error());
            assert_eq!(code == OK, !made.is_null());
            let extraction = unsafe { made.as_ref() };
            if extraction.is_some() {
                assert_eq!(call!(called, surfsig_extraction_size(extraction)), points.len());
                let (mut rows, mut why) = (vec![7.0_f32; SURFSIG_SIGNATURE * points.len()], Vec::new());
                why.resize_with(points.len(), || surfsig_status::Ok);
                let (rows, why) = (rows.as_mut_ptr(), why.as_mut_ptr());
                call!(called, surfsig_signatures(extraction, null(), points.len(), rows, why) gives OK);
            }
            call!(called, surfsig_extraction_free(owned(std::mem::replace(&mut made, null_mut()))));
        };
        check(unsafe { surfsig_extract(cloud.get(), 0.5, None, out) });
        check(unsafe { surfsig_extract_nearest(cloud.get(), 9, None, out) });
        check(unsafe { surfsig_extract_nearest(cloud.get(), u32::MAX, None, out) });
        check(unsafe { surfsig_extract_auto_radius(cloud.get(), None, out) });
        check(unsafe { surfsig_extract_radii(cloud.get(), &0.5, 1, None, out) });
        let mut options = surfsig_options_new();
        unsafe { surfsig_options_set_positions(Some(&mut options), points.as_ptr().cast(), points.len()) };
        check(unsafe { surfsig_extract(cloud.get(), 0.5, Some(&options), out) });
        surfsig_options_set_fit(Some(&mut options), 2);
        surfsig_options_set_all(Some(&mut options));
        surfsig_options_set_robust(Some(&mut options), 1);
        check(unsafe { surfsig_extract(cloud.get(), 0.5, Some(&options), out) });
        surfsig_options_free(Some(options));
    }

    let mut options = surfsig_options_new();
    let normals = [[f32::NAN; 3]; 400];
    unsafe { surfsig_options_set_normals(Some(&mut options), normals.as_ptr().cast(), 399) };
    call!(called, surfsig_extract(cloud.get(), 0.5, Some(&options), out) gives INVALID);
    unsafe { surfsig_options_set_indices(Some(&mut options), [u32::MAX].as_ptr(), 1) };
    unsafe { surfsig_options_set_normals(Some(&mut options), normals.as_ptr().cast(), 400) };
    call!(called, surfsig_extract(cloud.get(), 0.5, Some(&options), out) gives INVALID);
    unsafe { surfsig_options_set_viewpoint(Some(&mut options), [0.0; 3].as_ptr()) };
    call!(called, surfsig_extract(cloud.get(), 0.5, Some(&options), out) gives INVALID);
    unsafe { surfsig_options_set_viewpoint(Some(&mut options), null()) };
    surfsig_options_set_neighbors(Some(&mut options), 9);
    call!(called, surfsig_extract_nearest(cloud.get(), 9, Some(&options), out) gives INVALID);
    call!(called, surfsig_extract_auto_radius(cloud.get(), Some(&options), out) gives INVALID);
    call!(called, surfsig_extract_radii(cloud.get(), &0.5, 1, Some(&options), out) gives INVALID);
    surfsig_options_set_all(Some(&mut options));
    call!(called, surfsig_extract(cloud.get(), 0.5, Some(&options), out) gives OK);
    surfsig_options_free(Some(options));

    let extraction = unsafe { made.as_ref() };
    let mut row = [0.0_f32; SURFSIG_SIGNATURE];
    let out = row.as_mut_ptr();
    call!(called, surfsig_signatures(None, null(), 1, out, null_mut()) gives INVALID);
    call!(called, surfsig_signatures(extraction, null(), 1, null_mut(), null_mut()) gives INVALID);
    call!(called, surfsig_signatures(extraction, [400].as_ptr(), 1, out, null_mut()) gives INVALID);
    call!(called, surfsig_signatures(extraction, null(), 0, null_mut(), null_mut()) gives OK);
    for count in HUGE {
        call!(called, surfsig_signatures(extraction, null(), count, out, null_mut()) gives INVALID);
        call!(called, surfsig_signatures(extraction, [0].as_ptr(), count, out, null_mut()) gives INVALID);
    }
    surfsig_extraction_free(owned(made));
    assert!(call!(called, surfsig_similarity(null(), row.as_ptr())).is_nan());
    assert!(call!(called, surfsig_similarity([f32::NAN; SURFSIG_SIGNATURE].as_ptr(), row.as_ptr())).is_nan());

    assert_eq!(call!(called, surfsig_extraction_size(None)), 0);
    assert!(call!(called, surfsig_extraction_radius(None)).is_nan());
    assert_eq!(call!(called, surfsig_extraction_oriented(None)), 0);
    null_of_null!(called: surfsig_extraction_k1, surfsig_extraction_k2, surfsig_extraction_normals);
    null_of_null!(called: surfsig_extraction_directions, surfsig_extraction_residual);
    null_of_null!(called: surfsig_extraction_condition, surfsig_extraction_mean_curvature_std);
    null_of_null!(called: surfsig_extraction_k1_std, surfsig_extraction_k2_std, surfsig_extraction_count);
    null_of_null!(called: surfsig_extraction_status, surfsig_extraction_linearity);
    null_of_null!(called: surfsig_extraction_planarity, surfsig_extraction_scattering);
    null_of_null!(called: surfsig_extraction_radii, surfsig_extraction_fit_used);
    null_of_null!(called: surfsig_extraction_coefficients, surfsig_extraction_indices);
}

fn surfaces(called: &mut Called) {
    let mut made: *mut surfsig_surfaces = null_mut();
    let out = &raw mut made;
    call!(called, surfsig_find_surfaces(None, None, out) gives INVALID);
    for points in odd_clouds() {
        let cloud = Cloud::of(&points);
        call!(called, surfsig_find_surfaces(cloud.get(), None, null_mut()) gives INVALID);
        let code = call!(called, surfsig_find_surfaces(cloud.get(), None, out));
        assert!([OK, INVALID].contains(&code), "{}", last_error());
        assert_eq!(code == OK, !made.is_null());
        let surfaces = unsafe { made.as_ref() };
        if surfaces.is_some() {
            assert_eq!(call!(called, surfsig_surfaces_label_count(surfaces)), points.len());
        }
        for index in [surfsig_surfaces_size(surfaces), usize::MAX] {
            assert!(call!(called, surfsig_surfaces_covariance(surfaces, index)).is_null());
        }
        call!(called, surfsig_surfaces_free(owned(std::mem::replace(&mut made, null_mut()))));
    }
    let points = wave();
    let cloud = Cloud::of(&points);
    for least in [1, u32::MAX] {
        let mut options = surfsig_surface_options_new();
        surfsig_surface_options_set_min_points(Some(&mut options), least);
        surfsig_surface_options_set_noise(Some(&mut options), 1e300);
        call!(called, surfsig_find_surfaces(cloud.get(), Some(&options), out) gives OK);
        surfsig_surfaces_free(owned(made));
        surfsig_surface_options_free(Some(options));
    }
    assert_eq!(call!(called, surfsig_surfaces_size(None)), 0);
    assert_eq!(call!(called, surfsig_surfaces_label_count(None)), 0);
    assert!(call!(called, surfsig_surfaces_covariance(None, 0)).is_null());
    call!(called, surfsig_surfaces_free(None));
    null_of_null!(called: surfsig_surfaces_labels, surfsig_surfaces_kind, surfsig_surfaces_point);
    null_of_null!(called: surfsig_surfaces_axis, surfsig_surfaces_radius, surfsig_surfaces_major_radius);
    null_of_null!(called: surfsig_surfaces_half_angle, surfsig_surfaces_deviation, surfsig_surfaces_count);
    null_of_null!(called: surfsig_surfaces_radius_std, surfsig_surfaces_major_radius_std);
    null_of_null!(called: surfsig_surfaces_half_angle_std, surfsig_surfaces_across);
    null_of_null!(called: surfsig_surfaces_freedom);
}

fn primitives(called: &mut Called) {
    let mut made: *mut surfsig_primitive = null_mut();
    let out = &raw mut made;
    let points = sphere();
    let cloud = Cloud::of(&points);
    call!(called, surfsig_fit_primitive(None, 1, None, out) gives INVALID);
    call!(called, surfsig_fit_primitive(cloud.get(), 5, None, out) gives INVALID);
    call!(called, surfsig_fit_primitive(cloud.get(), 1, None, null_mut()) gives INVALID);
    call!(called, surfsig_fit_primitive(cloud.get(), 1, None, out) gives OK);
    let primitive = unsafe { made.as_ref() };
    let mut other = null_mut();
    call!(called, surfsig_fit_primitive(cloud.get(), 2, primitive, &mut other) gives INVALID);
    let (mut numbers, mut freedom) = ([0.0; 400], 0.0);
    let room = numbers.as_mut_ptr();
    for points in odd_clouds() {
        let cloud = Cloud::of(&points);
        for kind in 0..5 {
            let code = call!(called, surfsig_fit_primitive(cloud.get(), kind, None, &mut other));
            assert!([OK, UNDETERMINED].contains(&code), "{}", last_error());
            surfsig_primitive_free(owned(std::mem::replace(&mut other, null_mut())));
        }
        call!(called, surfsig_primitive_distances(primitive, cloud.get(), room) gives OK);
        call!(called, surfsig_primitive_uncertainty(primitive, cloud.get(), room, room, &mut freedom) gives OK);
        call!(called, surfsig_primitive_independent_error(primitive, cloud.get()));
    }
    call!(called, surfsig_primitive_distances(None, cloud.get(), room) gives INVALID);
    call!(called, surfsig_primitive_distances(primitive, None, room) gives INVALID);
    call!(called, surfsig_primitive_distances(primitive, cloud.get(), null_mut()) gives INVALID);
    let none = null_mut();
    call!(called, surfsig_primitive_uncertainty(None, cloud.get(), room, none, none) gives INVALID);
    call!(called, surfsig_primitive_uncertainty(primitive, None, room, none, none) gives INVALID);
    call!(called, surfsig_primitive_uncertainty(primitive, cloud.get(), none, none, none) gives INVALID);
    call!(called, surfsig_primitive_uncertainty(primitive, cloud.get(), room, none, none) gives OK);
    assert!(call!(called, surfsig_primitive_independent_error(None, cloud.get())).is_nan());
    assert!(call!(called, surfsig_primitive_independent_error(primitive, None)).is_nan());
    call!(called, surfsig_primitive_free(owned(made)));
    call!(called, surfsig_primitive_free(None));
    call!(called, surfsig_primitive_kind(None));
    null_of_null!(called: surfsig_primitive_point, surfsig_primitive_axis);
    assert!(call!(called, surfsig_primitive_radius(None)).is_nan());
    assert!(call!(called, surfsig_primitive_major_radius(None)).is_nan());
    assert!(call!(called, surfsig_primitive_half_angle(None)).is_nan());
}

fn moments(called: &mut Called) {
    let points = sphere();
    let cloud = Cloud::of(&points);
    let mut sums = [0.0; SURFSIG_MOMENTS];
    let room = sums.as_mut_ptr();
    call!(called, surfsig_moments(None, null(), room) gives INVALID);
    call!(called, surfsig_moments(cloud.get(), BAD.as_ptr(), room) gives INVALID);
    call!(called, surfsig_moments(cloud.get(), null(), null_mut()) gives INVALID);
    let vector = || [0.0; 3];
    let mut sphere = surfsig_sphere { centre: vector(), radius: 0.0, residual: 0.0 };
    let mut cylinder = surfsig_cylinder { axis: vector(), centre: vector(), radius: 0.0, residual: 0.0 };
    let mut quadric = surfsig_quadric { coefficients: [0.0; 10], residual: 0.0, gap: 0.0, extent: 0.0 };
    call!(called, surfsig_fit_sphere(null(), &mut sphere) gives INVALID);
    call!(called, surfsig_fit_cylinder(null(), &mut cylinder) gives INVALID);
    call!(called, surfsig_fit_quadric(null(), &mut quadric) gives INVALID);
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, f64::MAX, f64::MIN_POSITIVE] {
        let sums = [bad; SURFSIG_MOMENTS];
        let sums = sums.as_ptr();
        call!(called, surfsig_fit_sphere(sums, &mut sphere) gives UNDETERMINED);
        call!(called, surfsig_fit_cylinder(sums, &mut cylinder) gives UNDETERMINED);
        call!(called, surfsig_fit_quadric(sums, &mut quadric) gives UNDETERMINED);
    }
    for points in odd_clouds() {
        let cloud = Cloud::of(&points);
        call!(called, surfsig_moments(cloud.get(), null(), room) gives OK);
        let codes = [
            call!(called, surfsig_fit_sphere(room, &mut sphere)),
            call!(called, surfsig_fit_cylinder(room, &mut cylinder)),
            call!(called, surfsig_fit_quadric(room, &mut quadric)),
        ];
        assert!(codes.iter().all(|code| [OK, UNDETERMINED].contains(code)), "{}", last_error());
    }
    call!(called, surfsig_moments(cloud.get(), [1.0, 2.0, 3.0].as_ptr(), room) gives OK);
    call!(called, surfsig_fit_sphere(room, null_mut()) gives INVALID);
    call!(called, surfsig_fit_cylinder(room, null_mut()) gives INVALID);
    call!(called, surfsig_fit_quadric(room, null_mut()) gives INVALID);
    call!(called, surfsig_fit_quadric(room, &mut quadric) gives OK);
    let mut at =
        surfsig_surface_point { position: vector(), normal: vector(), k1: 0.0, k2: 0.0, direction: vector() };
    let from = [0.0, 0.0, 1.5];
    call!(called, surfsig_quadric_nearest(null(), from.as_ptr(), &mut at) gives INVALID);
    call!(called, surfsig_quadric_nearest(&quadric, null(), &mut at) gives INVALID);
    call!(called, surfsig_quadric_nearest(&quadric, BAD.as_ptr(), &mut at) gives INVALID);
    call!(called, surfsig_quadric_nearest(&quadric, from.as_ptr(), null_mut()) gives INVALID);
    call!(called, surfsig_quadric_nearest(&quadric, [0.0; 3].as_ptr(), &mut at) gives UNDETERMINED);
    quadric.extent = f64::NAN;
    call!(called, surfsig_quadric_nearest(&quadric, from.as_ptr(), &mut at) gives UNDETERMINED);
}

fn transforms(called: &mut Called) {
    let identity = call!(called, surfsig_transform_identity());
    let (bad, mut out) = (surfsig_transform { matrix: BAD }, identity);
    let mut scaled = identity;
    scaled.matrix[0] = 2.0;
    let mut numbers = [0.0; 36];
    let room = numbers.as_mut_ptr();
    call!(called, surfsig_transform_from_matrix(null(), &mut out) gives INVALID);
    call!(called, surfsig_transform_from_matrix(identity.matrix.as_ptr(), null_mut()) gives INVALID);
    call!(called, surfsig_transform_from_matrix(scaled.matrix.as_ptr(), &mut out) gives INVALID);
    call!(called, surfsig_transform_from_rotation_vector(null(), null(), null_mut()) gives INVALID);
    call!(called, surfsig_transform_from_rotation_vector(BAD.as_ptr(), null(), &mut out) gives INVALID);
    call!(called, surfsig_transform_from_rotation_vector(null(), BAD.as_ptr(), &mut out) gives INVALID);
    call!(called, surfsig_transform_from_rotation_vector(null(), null(), &mut out) gives OK);
    call!(called, surfsig_transform_exp(null(), &mut out) gives INVALID);
    call!(called, surfsig_transform_exp(BAD.as_ptr(), &mut out) gives INVALID);
    call!(called, surfsig_transform_exp([0.0; 6].as_ptr(), null_mut()) gives INVALID);
    call!(called, surfsig_transform_compose(&identity, &identity, null_mut()) gives INVALID);
    call!(called, surfsig_transform_inverse(&identity, null_mut()) gives INVALID);
    call!(called, surfsig_transform_log(&identity, null_mut()) gives INVALID);
    call!(called, surfsig_transform_adjoint(&identity, null_mut()) gives INVALID);
    let point = [1.0, 2.0, 3.0];
    for wrong in [null(), &bad, &scaled] {
        call!(called, surfsig_transform_compose(wrong, &identity, &mut out) gives INVALID);
        call!(called, surfsig_transform_compose(&identity, wrong, &mut out) gives INVALID);
        call!(called, surfsig_transform_inverse(wrong, &mut out) gives INVALID);
        call!(called, surfsig_transform_log(wrong, room) gives INVALID);
        call!(called, surfsig_transform_adjoint(wrong, room) gives INVALID);
        call!(called, surfsig_transform_points(wrong, point.as_ptr(), 1, 24, room) gives INVALID);
        call!(called, surfsig_transform_vectors(wrong, point.as_ptr(), 1, 24, room) gives INVALID);
    }
    let (given, first) = (&raw const identity, point.as_ptr());
    call!(called, surfsig_transform_points(given, null(), 1, 24, room) gives INVALID);
    call!(called, surfsig_transform_points(given, first, 1, 23, room) gives INVALID);
    call!(called, surfsig_transform_points(given, first, 1, 24, null_mut()) gives INVALID);
    call!(called, surfsig_transform_points(given, null(), 0, 24, null_mut()) gives OK);
    call!(called, surfsig_transform_vectors(given, null(), 1, 24, room) gives INVALID);
    call!(called, surfsig_transform_vectors(given, first, 1, 24, null_mut()) gives INVALID);
    call!(called, surfsig_transform_vectors(given, null(), 0, 24, null_mut()) gives OK);
    for count in HUGE {
        call!(called, surfsig_transform_points(given, first, count, 24, room) gives INVALID);
        call!(called, surfsig_transform_vectors(given, first, count, 24, room) gives INVALID);
    }
    call!(called, surfsig_transform_points(given, BAD.as_ptr(), 1, 24, room) gives OK);
    assert!(numbers[0].is_nan());
}
