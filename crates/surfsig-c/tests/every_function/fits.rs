//! Fits and transforms.

use crate::*;

pub fn primitives(called: &mut Called) {
    let mut made: *mut surfsig_primitive = null_mut();
    let out = &raw mut made;
    let points = sphere();
    let cloud = Cloud::of(&points);
    call!(called, surfsig_fit_primitive(None, 1, None, out) gives INVALID);
    call!(called, surfsig_fit_primitive(cloud.get(), 7, None, out) gives INVALID);
    call!(called, surfsig_fit_primitive(cloud.get(), 1, None, null_mut()) gives INVALID);
    call!(called, surfsig_fit_primitive(cloud.get(), 1, None, out) gives OK);
    let primitive = unsafe { made.as_ref() };
    let mut other = null_mut();
    call!(called, surfsig_fit_primitive(cloud.get(), 2, primitive, &mut other) gives INVALID);
    let (mut numbers, mut freedom) = ([0.0; 400], 0.0);
    let room = numbers.as_mut_ptr();
    for points in odd_clouds() {
        let cloud = Cloud::of(&points);
        for kind in 0..7 {
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
    primitive_options(called, &cloud, primitive);
    call!(called, surfsig_primitive_free(owned(made)));
    call!(called, surfsig_primitive_free(None));
    call!(called, surfsig_primitive_kind(None));
    null_of_null!(called: surfsig_primitive_point, surfsig_primitive_axis);
    assert!(call!(called, surfsig_primitive_radius(None)).is_nan());
    assert!(call!(called, surfsig_primitive_major_radius(None)).is_nan());
    assert!(call!(called, surfsig_primitive_half_angle(None)).is_nan());
}

/// Of a fit of a sphere to a cloud.
fn primitive_options(called: &mut Called, cloud: &Cloud, sphere: Option<&surfsig_primitive>) {
    let (mut made, mut numbers): (*mut surfsig_primitive, _) = (null_mut(), [0.0; 400]);
    let (out, room, none) = (&raw mut made, numbers.as_mut_ptr(), null_mut());
    call!(called, surfsig_primitive_options_set_start(None, sphere) gives INVALID);
    call!(called, surfsig_primitive_options_set_weights(None, null(), 0) gives INVALID);
    call!(called, surfsig_primitive_options_set_radius(None, 1.0) gives INVALID);
    call!(called, surfsig_primitive_options_set_axis(None, null()) gives INVALID);
    call!(called, surfsig_primitive_options_free(None));
    let mut options = call!(called, surfsig_primitive_options_new());
    for number in [-1.0, f64::NAN, f64::INFINITY] {
        call!(called, surfsig_primitive_options_set_radius(Some(&mut options), number) gives INVALID);
        call!(called, surfsig_primitive_options_set_weights(Some(&mut options), &number, 1) gives INVALID);
    }
    for count in HUGE {
        call!(called, surfsig_primitive_options_set_weights(Some(&mut options), room, count) gives INVALID);
    }
    call!(called, surfsig_primitive_options_set_axis(Some(&mut options), BAD.as_ptr()) gives INVALID);
    call!(called, surfsig_primitive_options_set_axis(Some(&mut options), [0.0; 3].as_ptr()) gives INVALID);
    call!(called, surfsig_fit_primitive_with(None, 1, Some(&options), out) gives INVALID);
    call!(called, surfsig_fit_primitive_with(cloud.get(), 7, Some(&options), out) gives INVALID);
    call!(called, surfsig_fit_primitive_with(cloud.get(), 1, Some(&options), null_mut()) gives INVALID);
    let weights = [1.0; 3];
    call!(called, surfsig_primitive_options_set_weights(Some(&mut options), weights.as_ptr(), 3) gives OK);
    call!(called, surfsig_fit_primitive_with(cloud.get(), 1, Some(&options), out) gives INVALID);
    call!(called, surfsig_primitive_options_set_weights(Some(&mut options), null(), 0) gives OK);
    call!(called, surfsig_primitive_options_set_start(Some(&mut options), sphere) gives OK);
    call!(called, surfsig_fit_primitive_with(cloud.get(), 2, Some(&options), out) gives INVALID);
    call!(called, surfsig_primitive_options_set_start(Some(&mut options), None) gives OK);
    call!(called, surfsig_primitive_options_set_radius(Some(&mut options), 2.0) gives OK);
    call!(called, surfsig_fit_primitive_with(cloud.get(), 0, Some(&options), out) gives INVALID);
    call!(called, surfsig_fit_primitive_with(cloud.get(), 1, Some(&options), out) gives OK);
    assert_eq!(call!(called, surfsig_primitive_radius(unsafe { made.as_ref() })), 2.0);
    let fitted = unsafe { made.as_ref() };
    call!(called, surfsig_primitive_uncertainty_with(None, cloud.get(), Some(&options), room, none, none) gives INVALID);
    call!(called, surfsig_primitive_uncertainty_with(fitted, None, Some(&options), room, none, none) gives INVALID);
    call!(called, surfsig_primitive_uncertainty_with(fitted, cloud.get(), Some(&options), none, none, none) gives INVALID);
    call!(called, surfsig_primitive_uncertainty_with(fitted, cloud.get(), Some(&options), room, none, none) gives OK);
    assert_eq!(numbers[15], 0.0);
    call!(called, surfsig_primitive_options_set_axis(Some(&mut options), [0.0, 0.0, 1e200].as_ptr()) gives OK);
    call!(called, surfsig_fit_primitive_with(cloud.get(), 1, Some(&options), out) gives INVALID);
    surfsig_primitive_free(owned(made));
    call!(called, surfsig_primitive_options_free(Some(options)));
}

pub fn moments(called: &mut Called) {
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

pub fn transforms(called: &mut Called) {
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
