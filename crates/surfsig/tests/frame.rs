//! The frame through the public face: what its numbers must satisfy among themselves.

use nalgebra::{DMatrix, DVector};
use surfsig::{
    ALPHA, Error, Frame, FrameParameters, Levels, MeanCurvatureFormula, Paraboloid, SIGNATURE,
    SimilarityClass, Status, VOCABULARY_END, similarity,
};

fn length(v: &[f32]) -> f64 {
    v.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt()
}

fn matrix(frame: &Frame) -> DMatrix<f64> {
    let formula = frame.parameters().formula;
    let columns: Vec<DVector<f64>> =
        frame.atoms().map(|atom| DVector::from_row_slice(&atom.curvature_fields(formula))).collect();
    DMatrix::from_columns(&columns)
}

fn surfaces() -> [Paraboloid; 4] {
    [
        Paraboloid { a: 0.5, b: 0.5, ..Default::default() },
        Paraboloid { a: 1.0, b: -0.3, c: 0.2, d: -0.4, e: 0.6, f: 0.1 },
        Paraboloid { a: 0.01, ..Default::default() },
        Paraboloid { a: -1.2, b: 0.7, c: 0.5, ..Default::default() },
    ]
}

#[test]
fn the_numbers_of_the_design() {
    let printed = Frame::new(FrameParameters::reproduction()).unwrap();
    assert_eq!(printed.len(), 3_109);
    assert!((printed.smallest_eigenvalue(0.040) - 2.37e-4).abs() < 5e-7);
    assert_eq!(Frame::shared().len(), 9_159);
    assert!((Frame::shared().smallest_eigenvalue(0.040) - 2.55e-4).abs() < 5e-7);
    assert_eq!(Frame::shared().atoms().count(), 9_159);
    assert!(!Frame::shared().is_empty());
}

/// The squares of F's singular values add up to the squares of its entries.
fn assert_parseval(frame: &Frame) {
    let squares: f64 = frame.singular_values().map(|v| v * v).sum();
    assert!((squares / matrix(frame).norm_squared() - 1.0).abs() < 1e-12, "{squares}");
}

#[test]
fn singular_values_hold_all_of_the_reproductions_frame() {
    let printed = Frame::new(FrameParameters::reproduction()).unwrap();
    assert_parseval(&printed);
    let values: Vec<f64> = printed.singular_values().collect();
    assert_eq!(values.len(), ALPHA);
    assert!(values.windows(2).all(|pair| pair[0] >= pair[1]));
}

#[test]
fn singular_values_hold_all_of_the_default_frame() {
    assert_parseval(Frame::shared());
}

#[test]
fn coefficients_solve_f_c_equals_alpha_with_the_length_of_the_signature() {
    let frame = Frame::new(FrameParameters::reproduction()).unwrap();
    let f = matrix(&frame);
    for surface in surfaces() {
        let c = DVector::from_vec(frame.coefficients(&surface));
        let alpha = DVector::from_row_slice(&surface.curvature_fields(frame.parameters().formula));
        assert!((&f * &c - &alpha).norm() < 1e-7 * alpha.norm().max(1.0));
        let w = frame.signature(&surface).unwrap();
        assert!((c.norm() / length(&w) - 1.0).abs() < 1e-6);
    }
    let [a, b] = [1, 3].map(|i| surfaces()[i]);
    let [ca, cb] = [a, b].map(|s| DVector::from_vec(frame.coefficients(&s)));
    let zeta = similarity(&frame.signature(&a).unwrap(), &frame.signature(&b).unwrap());
    assert!((zeta - ca.dot(&cb).abs() / ca.norm() / cb.norm()).abs() < 1e-6);
}

#[test]
fn the_power_is_the_only_difference_between_the_formulas() {
    for surface in surfaces() {
        for (x, y) in [(0.0, 0.0), (0.3, -0.5), (-0.5, 0.5)] {
            let [fx, fy] = surface.slopes(x, y);
            let metric = 1.0 + fx * fx + fy * fy;
            let corrected = surface.mean_curvature(x, y, MeanCurvatureFormula::Corrected);
            let printed = surface.mean_curvature(x, y, MeanCurvatureFormula::AsPrinted);
            assert!((corrected - printed * metric.sqrt()).abs() < 1e-13);
            // No surface has K > H^2.
            assert!(surface.gaussian_curvature(x, y) <= corrected * corrected + 1e-12);
        }
    }
}

#[test]
fn rows_of_surfaces_are_signatures_and_statuses_say_what_is_missing() {
    let frame = Frame::shared();
    let side = 0.040;
    let curvatures = [[20.0, 5.0], [f32::NAN, f32::NAN], [140.0, 140.0], [0.0, -90.0]];
    let mut rows = [[0.0; SIGNATURE]; 4];
    let mut statuses = [Status::Ok, Status::TooFewPoints, Status::Ok, Status::NotConverged];
    frame.signatures_of_curvatures(side, &curvatures, &mut rows, &mut statuses);
    assert_eq!(statuses, [Status::Ok, Status::TooFewPoints, Status::OutsideVocabulary, Status::NotConverged]);
    for i in [0, 3] {
        let [k1, k2] = curvatures[i];
        let exact = frame.signature(&Paraboloid::of_principal_curvatures(k1, k2, side)).unwrap();
        let error: Vec<f32> = rows[i].iter().zip(exact).map(|(a, b)| a - b).collect();
        assert!(length(&error) < 2e-6 + 2e-5 * length(&exact));
        assert!(length(&rows[i]) <= VOCABULARY_END);
    }
    for i in [1, 2] {
        assert!(rows[i].iter().all(|v| v.is_nan()));
    }
}

#[test]
#[should_panic(expected = "rows.len()")]
fn rows_and_surfaces_must_be_as_many() {
    Frame::shared().signatures_of_curvatures(0.04, &[[1.0, 1.0]], &mut [], &mut []);
}

#[test]
fn what_is_no_frame_is_refused_with_its_rank() {
    let flat = FrameParameters {
        quadratic: Levels { max: 4.0, count: 3 },
        mixed: Levels { max: 0.0, count: 1 },
        ..Default::default()
    };
    let Err(Error::NotAFrame { rank, dimension, atoms, smallest, largest }) = Frame::new(flat) else {
        panic!("three levels of a and b without e cannot span 242 dimensions");
    };
    assert!(atoms > 0 && rank < dimension && dimension == ALPHA);
    assert!(smallest < 1e-9 * largest);
}

#[test]
fn classes_at_their_borders() {
    for (zeta, class) in [
        (1.0, SimilarityClass::Optimal),
        (0.9, SimilarityClass::Optimal),
        (0.9 - 1e-9, SimilarityClass::Good),
        (0.5, SimilarityClass::Good),
        (0.5 - 1e-9, SimilarityClass::Dissimilar),
        (0.0, SimilarityClass::Dissimilar),
    ] {
        assert_eq!(SimilarityClass::of(zeta), Some(class), "{zeta}");
    }
}
