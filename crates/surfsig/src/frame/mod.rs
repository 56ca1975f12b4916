//! The frame F of section II: its atoms, its check, and its inverse.

mod flat_atom;
mod parameters;
mod singular;
mod symmetry;
mod table;

pub use flat_atom::FLAT_ATOM_NOISES;
pub use parameters::{FrameParameters, Levels};

use crate::curvature::{ALPHA, Paraboloid};
use crate::{Error, Status};
use nalgebra::DMatrix;
use rayon::prelude::*;
use singular::left_singular_vectors;
use std::sync::OnceLock;
use symmetry::Part;
use table::Table;

/// Length of a signature.
pub const SIGNATURE: usize = ALPHA;

/// Signatures longer than this are of surfaces more curved than any atom: their length explodes
/// within a few per cent of curvature, and would not be a description but an extrapolation.
pub const VOCABULARY_END: f64 = 1.0;

/// Singular values below this share of the largest are rounding.
const RANK_TOLERANCE: f64 = 1e-11;

/// A vocabulary of curvature fields, and what turns a surface's fields into its signature.
///
/// With F = U S V^T the paper's signature is c = pinv(F) alpha, one number per atom. This library's is
/// w = U S^-1 U^T alpha: 242 numbers with the same lengths and dot products, hence the same zeta.
/// Unlike S^-1 U^T alpha it is unique where singular values coincide.
///
/// ```
/// use surfsig::{Frame, Paraboloid};
/// let frame = Frame::shared();
/// assert_eq!(frame.len(), 9_159);
/// let w = frame.signature(&Paraboloid { a: 0.5, b: 0.5, ..Default::default() }).unwrap();
/// let length = w.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt();
/// assert!(length < 1.0);
/// ```
#[derive(Debug)]
pub struct Frame {
    parameters: FrameParameters,
    shapes: Vec<(Paraboloid, Vec<f64>)>,
    /// Singular values of F, descending, each with whether it belongs to the field of H.
    singular_values: Vec<(f64, bool)>,
    /// U S^-1 U^T, for each part.
    inverse_root: Vec<DMatrix<f64>>,
    table: OnceLock<Table>,
}

impl Frame {
    /// Makes the atoms, decomposes F, and checks section II.A's condition.
    ///
    /// # Errors
    /// [`Error::InvalidFrame`] for parameters without a meaning; [`Error::NotAFrame`] where F F^T has
    /// an eigenvalue of zero.
    ///
    /// ```
    /// use surfsig::{Error, Frame, FrameParameters, Levels};
    /// let flat = FrameParameters { quadratic: Levels { max: 0.0, count: 1 }, ..Default::default() };
    /// assert!(matches!(Frame::new(flat), Err(Error::NotAFrame { .. })));
    /// ```
    pub fn new(parameters: FrameParameters) -> Result<Self, Error> {
        parameters.check()?;
        let shapes = parameters.shapes();
        // Equal columns of F count as one, longer by the root of their number.
        let columns: Vec<[f64; ALPHA]> = shapes
            .par_iter()
            .map(|(shape, offsets)| {
                let weight = (offsets.len() as f64).sqrt();
                shape.curvature_fields(parameters.formula).map(|v| weight * v)
            })
            .collect();
        let decompositions: Vec<_> = Part::ALL.par_iter().map(|part| decompose(part, &columns)).collect();
        let mut singular_values: Vec<(f64, bool)> = Part::ALL
            .iter()
            .zip(&decompositions)
            .flat_map(|(part, (values, _))| values.iter().map(|&value| (value, part.mean)))
            .collect();
        singular_values.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (largest, smallest) = (singular_values[0].0, singular_values[ALPHA - 1].0);
        let rank = singular_values.iter().filter(|(v, _)| *v > RANK_TOLERANCE * largest).count();
        if rank < ALPHA {
            let atoms = shapes.iter().map(|(_, offsets)| offsets.len()).sum();
            return Err(Error::NotAFrame { atoms, rank, dimension: ALPHA, smallest, largest });
        }
        let inverse = |(values, vectors): &(Vec<f64>, DMatrix<f64>)| {
            let scaled =
                DMatrix::from_fn(vectors.nrows(), vectors.ncols(), |i, j| vectors[(i, j)] / values[j]);
            scaled * vectors.transpose()
        };
        let inverse_root = decompositions.iter().map(inverse).collect();
        Ok(Self { parameters, shapes, singular_values, inverse_root, table: OnceLock::new() })
    }

    /// The frame of the default parameters, made once.
    ///
    /// ```
    /// use surfsig::{Frame, FrameParameters};
    /// assert_eq!(Frame::shared().parameters(), &FrameParameters::default());
    /// ```
    pub fn shared() -> &'static Self {
        static DEFAULT: OnceLock<Frame> = OnceLock::new();
        DEFAULT.get_or_init(|| {
            Self::new(FrameParameters::default()).expect("the default parameters make a frame")
        })
    }

    /// What the frame was made from.
    ///
    /// ```
    /// assert_eq!(surfsig::Frame::shared().parameters().offset.count, 9);
    /// ```
    pub fn parameters(&self) -> &FrameParameters {
        &self.parameters
    }

    /// Number of atoms.
    pub fn len(&self) -> usize {
        self.shapes.iter().map(|(_, offsets)| offsets.len()).sum()
    }

    /// Whether there is no atom; never so for a frame that passed its check.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// The atoms' paraboloids, patch units.
    ///
    /// ```
    /// let frame = surfsig::Frame::shared();
    /// assert_eq!(frame.atoms().count(), frame.len());
    /// ```
    pub fn atoms(&self) -> impl Iterator<Item = Paraboloid> + '_ {
        self.shapes.iter().flat_map(|(shape, offsets)| offsets.iter().map(|&f| Paraboloid { f, ..*shape }))
    }

    /// Singular values of F in patch units, descending.
    ///
    /// ```
    /// assert_eq!(surfsig::Frame::shared().singular_values().count(), 242);
    /// ```
    pub fn singular_values(&self) -> impl Iterator<Item = f64> + '_ {
        self.singular_values.iter().map(|(value, _)| *value)
    }

    /// Smallest eigenvalue of F F^T for patches of this side, with curvature per unit of the side's
    /// own length. Section II.B reports about 2.5e-4 for 0.040 m.
    ///
    /// Formed from the singular values of each field in patch units: in metres, F F^T itself has
    /// eigenvalues up to 4e11 and has lost the small ones.
    ///
    /// ```
    /// use surfsig::{Frame, FrameParameters};
    /// let printed = Frame::new(FrameParameters::reproduction())?;
    /// assert!((printed.smallest_eigenvalue(0.040) - 2.37e-4).abs() < 1e-6);
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn smallest_eigenvalue(&self, side: f64) -> f64 {
        // K is per length squared, H per length.
        let in_length =
            |&(value, mean): &(f64, bool)| (value / if mean { side } else { side * side }).powi(2);
        self.singular_values.iter().map(in_length).fold(f64::INFINITY, f64::min)
    }

    /// w = U S^-1 U^T alpha of a surface in patch units, or `None` beyond the vocabulary's end.
    ///
    /// ```
    /// use surfsig::{Frame, Paraboloid};
    /// let too_curved = Paraboloid { a: 4.0, b: 4.0, ..Default::default() };
    /// assert!(Frame::shared().signature(&too_curved).is_none());
    /// ```
    pub fn signature(&self, surface: &Paraboloid) -> Option<[f32; SIGNATURE]> {
        let alpha = surface.curvature_fields(self.parameters.formula);
        let w = self.times_inverse_root(&alpha);
        let length = w.iter().map(|v| v * v).sum::<f64>().sqrt();
        // Not a number is no signature either.
        (length <= VOCABULARY_END).then(|| w.map(|v| v as f32))
    }

    /// c = pinv(F) alpha, eq. (2): one number per atom, in the order of [`Self::atoms`].
    ///
    /// ```
    /// use surfsig::{Frame, Paraboloid};
    /// let surface = Paraboloid { a: 0.5, e: 0.2, ..Default::default() };
    /// let frame = Frame::shared();
    /// let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
    /// let c = norm(&mut frame.coefficients(&surface).into_iter());
    /// let w = norm(&mut frame.signature(&surface).unwrap().into_iter().map(f64::from));
    /// assert!((c / w - 1.0).abs() < 1e-6);
    /// ```
    pub fn coefficients(&self, surface: &Paraboloid) -> Vec<f64> {
        // pinv(F) = F^T (F F^T)^-1
        let alpha = surface.curvature_fields(self.parameters.formula);
        let dual = self.times_inverse_root(&self.times_inverse_root(&alpha));
        let mut coefficients = Vec::with_capacity(self.len());
        for (shape, offsets) in &self.shapes {
            let atom = shape.curvature_fields(self.parameters.formula);
            let value: f64 = atom.iter().zip(&dual).map(|(a, d)| a * d).sum();
            coefficients.extend(offsets.iter().map(|_| value));
        }
        coefficients
    }

    /// Signatures of surfaces in their own axes, of which only k1 and k2 matter, by interpolation in
    /// a table; the difference to [`Self::signature`] is below 2e-6 + 2e-5 |w| up
    /// to the curvature of the atoms, and below 2e-4 |w| beyond.
    ///
    /// `curvatures` are (k1, k2) for patches of the given side. Each signature fills one row of
    /// `rows`, with NaN where there is none.
    ///
    /// # Panics
    /// If `curvatures`, `rows` and `statuses` differ in length.
    ///
    /// ```
    /// use surfsig::{Frame, SIGNATURE, Status};
    /// let mut rows = [[0.0; SIGNATURE]; 2];
    /// let mut statuses = [Status::Ok; 2];
    /// // A 40 mm patch of a sphere of radius 50 mm, and of one of 7 mm.
    /// let curvatures = [[20.0, 20.0], [140.0, 140.0]];
    /// Frame::shared().signatures_of_curvatures(0.040, &curvatures, &mut rows, &mut statuses);
    /// assert_eq!(statuses, [Status::Ok, Status::OutsideVocabulary]);
    /// assert!(rows[0][0] != 0.0 && rows[1][0].is_nan());
    /// ```
    pub fn signatures_of_curvatures(
        &self,
        side: f64,
        curvatures: &[[f32; 2]],
        rows: &mut [[f32; SIGNATURE]],
        statuses: &mut [Status],
    ) {
        let table = self.table.get_or_init(|| Table::new(self));
        fill(curvatures, rows, statuses, |&[k1, k2], row| {
            let surface = Paraboloid::of_principal_curvatures(k1, k2, side);
            // 2 a and 2 b are the curvatures in patch units.
            if !table.interpolate(2.0 * surface.a, 2.0 * surface.b, row) {
                *row = self.signature(&surface).unwrap_or([f32::NAN; SIGNATURE]);
            }
            k1.is_finite()
        });
    }

    /// Signatures of surfaces given as a, b, c, d, e, f of eq. (5), for patches of the given side: the
    /// paper's way, in the sensor's axes. Rows and statuses as in [`Self::signatures_of_curvatures`].
    ///
    /// # Panics
    /// If `surfaces`, `rows` and `statuses` differ in length.
    ///
    /// ```
    /// use surfsig::{Frame, Paraboloid, SIGNATURE, Status};
    /// let tilted = [10.0, 5.0, 0.3, 0.0, 0.0, 0.0];
    /// let mut row = [[0.0; SIGNATURE]];
    /// Frame::shared().signatures_of_surfaces(0.040, &[tilted], &mut row, &mut [Status::Ok]);
    /// let expected = Frame::shared().signature(&Paraboloid::of_coefficients(tilted, 0.040)).unwrap();
    /// assert_eq!(row[0], expected);
    /// ```
    pub fn signatures_of_surfaces(
        &self,
        side: f64,
        surfaces: &[[f32; 6]],
        rows: &mut [[f32; SIGNATURE]],
        statuses: &mut [Status],
    ) {
        fill(surfaces, rows, statuses, |&surface, row| {
            let signature = self.signature(&Paraboloid::of_coefficients(surface, side));
            *row = signature.unwrap_or([f32::NAN; SIGNATURE]);
            surface[0].is_finite()
        });
    }

    fn inverse_root_of(&self, part: Part) -> &DMatrix<f64> {
        let place = Part::ALL.iter().position(|p| *p == part).expect("all parts are there");
        &self.inverse_root[place]
    }

    fn times_inverse_root(&self, alpha: &[f64; ALPHA]) -> [f64; ALPHA] {
        let mut product = [0.0; ALPHA];
        for (part, matrix) in Part::ALL.iter().zip(&self.inverse_root) {
            let values = matrix * nalgebra::DVector::from_vec(part.project(alpha));
            part.add_to(values.as_slice(), &mut product);
        }
        product
    }
}

/// Rows for surfaces, on all cores. `make_row` says whether there was a surface at all; a row of NaN
/// is then one beyond the vocabulary.
fn fill<T: Sync>(
    surfaces: &[T],
    rows: &mut [[f32; SIGNATURE]],
    statuses: &mut [Status],
    make_row: impl Fn(&T, &mut [f32; SIGNATURE]) -> bool + Sync,
) {
    assert!(surfaces.len() == rows.len() && rows.len() == statuses.len());
    let work = surfaces.par_iter().zip(rows).zip(statuses).with_min_len(256);
    work.for_each(|((surface, row), status)| {
        if make_row(surface, row) && row[0].is_nan() {
            *status = Status::OutsideVocabulary;
        }
    });
}

/// Singular values, and left singular vectors as columns, of one part of F.
fn decompose(part: &Part, columns: &[[f64; ALPHA]]) -> (Vec<f64>, DMatrix<f64>) {
    let dimension = part.dimension();
    // F^T = Q R, so F = R^T Q^T, and R^T has F's singular values and left vectors; at least as many rows as columns, of zeros if need be.
    let mut transposed = DMatrix::zeros(columns.len().max(dimension), dimension);
    for (row, column) in columns.iter().enumerate() {
        for (i, value) in part.project(column).into_iter().enumerate() {
            transposed[(row, i)] = value;
        }
    }
    let r = transposed.qr().r();
    left_singular_vectors(r.transpose())
}
