//! Extractions, signatures and surfaces.

use crate::*;

pub fn extractions(called: &mut Called) {
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
            assert!([OK, INVALID].contains(&code), "{}", last_error());
            assert_eq!(code == OK, !made.is_null());
            let extraction = unsafe { made.as_ref() };
            if extraction.is_some() {
                assert_eq!(call!(called, surfsig_extraction_size(extraction)), points.len());
                let (mut rows, mut why) = (vec![7.0_f32; SURFSIG_SIGNATURE * points.len()], Vec::new());
                why.resize_with(points.len(), || surfsig_status::Ok);
                let (rows, why) = (rows.as_mut_ptr(), why.as_mut_ptr());
                call!(called, surfsig_signatures(extraction, null(), points.len(), rows, why) gives OK);
                let flat = call!(called, surfsig_flat_atom_length(extraction));
                assert!(flat >= 0.0 && flat.is_finite());
                let code = if points.is_empty() { INVALID } else { OK };
                assert_eq!(call!(called, surfsig_similarities(extraction, 0, flat, rows)), code);
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
    let mut alike = [7.0_f32; 400];
    call!(called, surfsig_similarities(extraction, 400, 0.0, alike.as_mut_ptr()) gives INVALID);
    call!(called, surfsig_similarities(extraction, 0, -1.0, alike.as_mut_ptr()) gives INVALID);
    call!(called, surfsig_similarities(extraction, 0, f64::NAN, alike.as_mut_ptr()) gives INVALID);
    call!(called, surfsig_similarities(extraction, 0, 0.0, null_mut()) gives INVALID);
    call!(called, surfsig_similarities(None, 0, 0.0, alike.as_mut_ptr()) gives INVALID);
    assert_eq!(call!(called, surfsig_flat_atom_length(None)), 0.0);
    assert_eq!(call!(called, surfsig_cloud_spacing(None)), 0.0);
    assert!(call!(called, surfsig_cloud_spacing(cloud.get())) > 0.0);
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

pub fn surfaces(called: &mut Called) {
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
