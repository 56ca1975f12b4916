//! Registration and odometry.

use crate::*;
use std::mem::MaybeUninit;

pub fn registration_options(called: &mut Called) {
    call!(called, surfsig_registration_options_set_radius(None, 1.0) gives INVALID);
    call!(called, surfsig_registration_options_set_keypoints(None, 1) gives INVALID);
    call!(called, surfsig_registration_options_set_threads(None, 1) gives INVALID);
    call!(called, surfsig_registration_options_set_progress(None, Some(stop), null_mut()) gives INVALID);
    call!(called, surfsig_registration_options_free(None));
    let mut options = call!(called, surfsig_registration_options_new());
    for radius in [-1.0, f64::NAN, f64::INFINITY, 1e300] {
        call!(called, surfsig_registration_options_set_radius(Some(&mut options), radius) gives INVALID);
    }
    call!(called, surfsig_registration_options_set_threads(Some(&mut options), 1025) gives INVALID);
    call!(called, surfsig_registration_options_set_radius(Some(&mut options), 0.0) gives OK);
    call!(called, surfsig_registration_options_set_keypoints(Some(&mut options), 0) gives OK);
    call!(called, surfsig_registration_options_free(Some(options)));
}

pub fn registrations(called: &mut Called) {
    let clouds: Vec<Cloud> = odd_clouds().iter().map(|points| Cloud::of(points)).collect();
    let scan = |cloud: &Cloud| surfsig_scan { cloud: cloud.0, viewpoint: null(), directions: null() };
    let mut room = MaybeUninit::<surfsig_registration>::uninit();
    let out = room.as_mut_ptr();
    let surface = Cloud::of(&wave());
    let good = scan(&surface);
    let none = surfsig_scan { cloud: null(), ..good };
    call!(called, surfsig_register(null(), &good, null(), None, out) gives INVALID);
    call!(called, surfsig_register(&good, null(), null(), None, out) gives INVALID);
    call!(called, surfsig_register(&good, &none, null(), None, out) gives INVALID);
    call!(called, surfsig_register(&good, &good, null(), None, null_mut()) gives INVALID);
    let nowhere = surfsig_scan { viewpoint: BAD.as_ptr(), ..good };
    call!(called, surfsig_register(&nowhere, &good, null(), None, out) gives INVALID);
    let wrong = surfsig_transform { matrix: BAD };
    call!(called, surfsig_register(&good, &good, &wrong, None, out) gives INVALID);
    let viewpoint = [0.0, 0.0, 9.0];
    let facing = vec![[f32::NAN; 3]; 1 << 16];
    let identity = surfsig_transform_identity();
    for cloud in &clouds {
        let seen = surfsig_scan { viewpoint: viewpoint.as_ptr(), ..scan(cloud) };
        let facing = surfsig_scan { directions: facing.as_ptr().cast(), ..scan(cloud) };
        let both = surfsig_scan { viewpoint: viewpoint.as_ptr(), ..facing };
        call!(called, surfsig_register(&both, &good, null(), None, out) gives INVALID);
        for (source, start) in [(seen, null()), (facing, null()), (seen, &raw const identity)] {
            let code = call!(called, surfsig_register(&source, &good, start, None, out));
            assert!([OK, INVALID].contains(&code), "{}", last_error());
            if code == OK {
                let found = unsafe { room.assume_init_ref() };
                assert_eq!(found.found, found.T_target_source.matrix[0].is_finite());
                assert!(found.free_direction_count <= SURFSIG_FREE_DIRECTIONS);
                assert!(found.found || !found.trusted);
            }
        }
    }
}

pub fn odometries(called: &mut Called) {
    assert!(call!(called, surfsig_scan_status_name(4)).is_null());
    let mut made: *mut surfsig_odometry = null_mut();
    let out = &raw mut made;
    for length in [-1.0, f64::NAN, f64::INFINITY] {
        call!(called, surfsig_odometry_new(length, 0.0, 0.0, 0, out) gives INVALID);
        call!(called, surfsig_odometry_new(0.0, length, 0.0, 0, out) gives INVALID);
        call!(called, surfsig_odometry_new(0.0, 0.0, length, 0, out) gives INVALID);
        assert!(made.is_null());
    }
    call!(called, surfsig_odometry_new(0.0, 0.0, 0.0, 1025, out) gives INVALID);
    call!(called, surfsig_odometry_new(0.0, 0.0, 0.0, 0, null_mut()) gives INVALID);
    call!(called, surfsig_odometry_free(None));
    assert_eq!(call!(called, surfsig_odometry_size(None)), 0);
    assert!(call!(called, surfsig_odometry_voxel(None)).is_nan());
    let mut room = MaybeUninit::<surfsig_scan_pose>::uninit();
    let pose = room.as_mut_ptr();
    call!(called, surfsig_odometry_pose(None, 0, pose) gives INVALID);
    call!(called, surfsig_odometry_push(None, null(), pose) gives INVALID);
    call!(called, surfsig_odometry_new(0.0, 0.0, 0.0, 1, out) gives OK);
    let odometry = unsafe { made.as_mut() };
    call!(called, surfsig_odometry_push(odometry, null(), pose) gives INVALID);
    let clouds: Vec<Cloud> = odd_clouds().iter().map(|points| Cloud::of(points)).collect();
    for cloud in &clouds {
        let scan = surfsig_scan { cloud: cloud.0, viewpoint: null(), directions: null() };
        let nowhere = surfsig_scan { viewpoint: BAD.as_ptr(), ..scan };
        call!(called, surfsig_odometry_push(unsafe { made.as_mut() }, &nowhere, pose) gives INVALID);
        call!(called, surfsig_odometry_push(unsafe { made.as_mut() }, &scan, null_mut()) gives OK);
    }
    call!(called, surfsig_odometry_push_timed(None, null(), null(), pose) gives INVALID);
    for (cloud, points) in clouds.iter().zip(odd_clouds()) {
        let scan = surfsig_scan { cloud: cloud.0, viewpoint: null(), directions: null() };
        let times: Vec<f64> =
            (0..points.len()).map(|k| if k % 7 == 3 { f64::NAN } else { k as f64 * 1e-3 }).collect();
        if !points.is_empty() {
            call!(called, surfsig_odometry_push_timed(unsafe { made.as_mut() }, &scan, null(), pose) gives INVALID);
        }
        call!(called, surfsig_odometry_push_timed(unsafe { made.as_mut() }, &scan, times.as_ptr(), null_mut()) gives OK);
    }
    let mut twist = [0.0; 6];
    assert_eq!(call!(called, surfsig_odometry_segment(None, 0)), -1);
    assert_eq!(call!(called, surfsig_odometry_segment(unsafe { made.as_ref() }, 0)), -1);
    call!(called, surfsig_odometry_twist(None, 0, twist.as_mut_ptr()) gives INVALID);
    call!(called, surfsig_odometry_twist(unsafe { made.as_ref() }, usize::MAX, twist.as_mut_ptr()) gives INVALID);
    call!(called, surfsig_odometry_twist(unsafe { made.as_ref() }, 0, null_mut()) gives INVALID);
    call!(called, surfsig_odometry_twist(unsafe { made.as_ref() }, 0, twist.as_mut_ptr()) gives OK);
    assert!(twist[0].is_nan());
    let odometry = unsafe { made.as_ref() };
    assert_eq!(call!(called, surfsig_odometry_size(odometry)), 2 * clouds.len());
    call!(called, surfsig_odometry_pose(odometry, 0, null_mut()) gives INVALID);
    call!(called, surfsig_odometry_pose(odometry, 0, pose) gives OK);
    assert_eq!(unsafe { room.assume_init() }.status, surfsig_scan_status::TooFewPoints);
    for index in [2 * clouds.len(), usize::MAX] {
        call!(called, surfsig_odometry_pose(odometry, index, pose) gives INVALID);
    }
    call!(called, surfsig_odometry_free(owned(made)));
}

pub fn deskewing(called: &mut Called) {
    let twist = [0.0, 0.0, 0.5, 1.0, 0.0, 0.0];
    let mut moved = [[0.0; 3]; 2];
    let out = moved.as_mut_ptr().cast();
    let cloud = Cloud::of(&[[1.0, 2.0, 3.0]; 2]);
    let times = [0.0, f64::NAN];
    call!(called, surfsig_deskew(None, times.as_ptr(), twist.as_ptr(), out) gives INVALID);
    call!(called, surfsig_deskew(cloud.get(), null(), twist.as_ptr(), out) gives INVALID);
    call!(called, surfsig_deskew(cloud.get(), times.as_ptr(), null(), out) gives INVALID);
    call!(called, surfsig_deskew(cloud.get(), times.as_ptr(), BAD.as_ptr(), out) gives INVALID);
    call!(called, surfsig_deskew(cloud.get(), times.as_ptr(), twist.as_ptr(), null_mut()) gives INVALID);
    call!(called, surfsig_deskew(cloud.get(), times.as_ptr(), twist.as_ptr(), out) gives OK);
    assert_eq!(moved, [[1.0, 2.0, 3.0]; 2], "at the time of the pose, and without a time");
    for points in odd_clouds() {
        let (cloud, times) = (Cloud::of(&points), vec![0.5; points.len()]);
        let mut moved = vec![[0.0; 3]; points.len()];
        let out = moved.as_mut_ptr().cast();
        call!(called, surfsig_deskew(cloud.get(), times.as_ptr(), twist.as_ptr(), out) gives OK);
        let is_finite = |point: &[f64; 3]| point.iter().all(|c| c.is_finite());
        // Where coordinates are near the largest number there is, a motion may leave it.
        let lost = points.iter().zip(&moved).filter(|(before, after)| !is_finite(before) && is_finite(after));
        assert_eq!(lost.count(), 0);
    }
}
