//! Models and their instances.

use crate::*;
use std::mem::MaybeUninit;

pub fn options(called: &mut Called) {
    call!(called, surfsig_find_options_set_score(None, 0.5) gives INVALID);
    call!(called, surfsig_find_options_set_at_most(None, 1) gives INVALID);
    call!(called, surfsig_find_options_set_threads(None, 1) gives INVALID);
    call!(called, surfsig_find_options_set_progress(None, Some(stop), null_mut()) gives INVALID);
    call!(called, surfsig_find_options_free(None));
    let mut options = call!(called, surfsig_find_options_new());
    for score in [-0.1, 1.01, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        call!(called, surfsig_find_options_set_score(Some(&mut options), score) gives INVALID);
    }
    call!(called, surfsig_find_options_set_threads(Some(&mut options), 1025) gives INVALID);
    for at_most in [1, usize::MAX, 0] {
        call!(called, surfsig_find_options_set_at_most(Some(&mut options), at_most) gives OK);
    }
    call!(called, surfsig_find_options_set_score(Some(&mut options), 0.0) gives OK);
    call!(called, surfsig_find_options_set_score(Some(&mut options), 1.0) gives OK);
    call!(called, surfsig_find_options_free(Some(options)));
}

fn scan(cloud: &Cloud) -> surfsig_scan {
    surfsig_scan { cloud: cloud.0, viewpoint: null(), directions: null() }
}

/// Directions of no use, for all clouds of these tests.
static FACING: [[f32; 3]; 1000] = [[f32::NAN; 3]; 1000];

/// A scan with all that is known of where it was seen from, and less.
fn seen(cloud: &Cloud) -> [surfsig_scan; 4] {
    static VIEWPOINT: [f64; 3] = [0.0, 0.0, 9.0];
    let (viewpoint, directions) = (VIEWPOINT.as_ptr(), FACING.as_ptr().cast());
    let none = scan(cloud);
    let both = surfsig_scan { viewpoint, directions, ..none };
    [none, surfsig_scan { viewpoint, ..none }, surfsig_scan { directions, ..none }, both]
}

pub fn models(called: &mut Called) {
    let mut made: *mut surfsig_model = null_mut();
    let out = &raw mut made;
    let surface = Cloud::of(&sphere());
    let good = scan(&surface);
    call!(called, surfsig_model_new(null(), None, out) gives INVALID);
    call!(called, surfsig_model_new(&good, None, null_mut()) gives INVALID);
    let none = surfsig_scan { cloud: null(), ..good };
    call!(called, surfsig_model_new(&none, None, out) gives INVALID);
    let nowhere = surfsig_scan { viewpoint: BAD.as_ptr(), ..good };
    call!(called, surfsig_model_new(&nowhere, None, out) gives INVALID);
    assert!(made.is_null());
    for points in odd_clouds() {
        let cloud = Cloud::of(&points);
        for scan in seen(&cloud) {
            let code = call!(called, surfsig_model_new(&scan, None, out));
            assert!([OK, INVALID].contains(&code), "{}", last_error());
            assert_eq!(code == OK, !made.is_null());
            surfsig_model_free(owned(std::mem::replace(&mut made, null_mut())));
        }
    }
    call!(called, surfsig_model_new(&good, None, out) gives OK);
    let model = unsafe { made.as_ref() };
    assert_eq!(call!(called, surfsig_model_size(model)), 400);
    assert!(call!(called, surfsig_model_radius(model)) > call!(called, surfsig_model_spacing(model)));
    call!(called, surfsig_model_free(owned(made)));
    call!(called, surfsig_model_free(None));
    assert_eq!(call!(called, surfsig_model_size(None)), 0);
    assert!(call!(called, surfsig_model_radius(None)).is_nan());
    assert!(call!(called, surfsig_model_spacing(None)).is_nan());
}

pub fn instances(called: &mut Called) {
    let mut made: *mut surfsig_instances = null_mut();
    let out = &raw mut made;
    let surface = Cloud::of(&wave());
    let good = scan(&surface);
    let mut model: *mut surfsig_model = null_mut();
    call!(called, surfsig_model_new(&good, None, &raw mut model) gives OK);
    let models = [model.cast_const(), null()];
    let first = models.as_ptr();
    call!(called, surfsig_find_instances(null(), 1, &good, None, out) gives INVALID);
    call!(called, surfsig_find_instances(first, 2, &good, None, out) gives INVALID);
    call!(called, surfsig_find_instances(first, 1, null(), None, out) gives INVALID);
    call!(called, surfsig_find_instances(first, 1, &good, None, null_mut()) gives INVALID);
    let none = surfsig_scan { cloud: null(), ..good };
    call!(called, surfsig_find_instances(first, 1, &none, None, out) gives INVALID);
    let nowhere = surfsig_scan { viewpoint: BAD.as_ptr(), ..good };
    call!(called, surfsig_find_instances(first, 1, &nowhere, None, out) gives INVALID);
    for count in HUGE {
        call!(called, surfsig_find_instances(first, count, &good, None, out) gives INVALID);
        call!(called, surfsig_find_instances(null(), count, &good, None, out) gives INVALID);
    }
    assert!(made.is_null());
    call!(called, surfsig_find_instances(null(), 0, &good, None, out) gives OK);
    assert_eq!(call!(called, surfsig_instances_size(unsafe { made.as_ref() })), 0);
    surfsig_instances_free(owned(std::mem::replace(&mut made, null_mut())));

    let mut room = MaybeUninit::<surfsig_instance>::uninit();
    let instance = room.as_mut_ptr();
    for points in odd_clouds() {
        let cloud = Cloud::of(&points);
        for scene in seen(&cloud) {
            let code = call!(called, surfsig_find_instances(first, 1, &scene, None, out));
            assert!([OK, INVALID].contains(&code), "{}", last_error());
            assert_eq!(code == OK, !made.is_null());
            let found = unsafe { made.as_ref() };
            let size = call!(called, surfsig_instances_size(found));
            for index in 0..size {
                call!(called, surfsig_instances_get(found, index, null_mut()) gives INVALID);
                call!(called, surfsig_instances_get(found, index, instance) gives OK);
                let instance = unsafe { room.assume_init_ref() };
                assert!(instance.model == 0 && instance.free_direction_count <= SURFSIG_FREE_DIRECTIONS);
                assert!(instance.point_count <= points.len());
                let indices = call!(called, surfsig_instances_indices(found, index));
                assert_eq!(indices.is_null(), instance.point_count == 0);
            }
            for index in [size, usize::MAX] {
                call!(called, surfsig_instances_get(found, index, instance) gives INVALID);
                assert!(call!(called, surfsig_instances_indices(found, index)).is_null());
            }
            call!(called, surfsig_instances_free(owned(std::mem::replace(&mut made, null_mut()))));
        }
    }
    call!(called, surfsig_instances_get(None, 0, instance) gives INVALID);
    assert!(call!(called, surfsig_instances_indices(None, 0)).is_null());
    assert_eq!(call!(called, surfsig_instances_size(None)), 0);
    call!(called, surfsig_instances_free(None));
    surfsig_model_free(owned(model));
}
