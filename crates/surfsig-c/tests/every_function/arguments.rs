//! Texts, clouds and options.

use crate::*;

pub fn texts(called: &mut Called) {
    assert!(!call!(called, surfsig_version()).is_null());
    assert!(!call!(called, surfsig_last_error()).is_null());
    for number in [surfsig::Status::ALL.len() as u8, 255] {
        assert!(call!(called, surfsig_status_name(number)).is_null());
    }
    for number in [surfsig_surface_kind::Line as u8 + 1, 255] {
        assert!(call!(called, surfsig_surface_kind_name(number)).is_null());
        assert_eq!(call!(called, surfsig_surface_kind_parameters(number)), 0);
    }
}

pub fn clouds(called: &mut Called) {
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

pub fn options(called: &mut Called) {
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
