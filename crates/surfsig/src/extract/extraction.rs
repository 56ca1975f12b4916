//! What an extraction gives: one struct of arrays, a status per point.

use super::Status;
use crate::curvature::Paraboloid;
use crate::fit::FitAxes;
use crate::fit::paraboloid::Paraboloids;
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering::Relaxed};

/// Curvature and what belongs to it, one entry for each query, in the order of the queries.
///
/// Lengths are in the cloud's unit, curvatures per that unit. NaN where there is no value.
///
/// ```
/// use surfsig::{extract, ExtractOptions, PointCloud, Radius, Status};
/// // A cylinder of radius 0.1 along y.
/// let points: Vec<[f64; 3]> = (0..60)
///     .flat_map(|i| (0..60).map(move |j| (0.001 * f64::from(i), 0.001 * f64::from(j))))
///     .map(|(s, y)| [0.1 * (10.0 * s).sin(), y, 0.1 * (10.0 * s).cos()])
///     .collect();
/// let found = extract(&PointCloud::new_f64(&points), Radius::new(0.008)?, &ExtractOptions::default())?;
/// let middle = 30 * 60 + 30;
/// assert_eq!(found.status[middle], Status::Ok as u8);
/// assert!((found.k1[middle] - 10.0).abs() < 0.02);
/// assert!(found.k2[middle].abs() < 0.02);
/// assert!(found.directions[middle][1].abs() < 1e-2);
/// # Ok::<(), surfsig::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Extraction {
    /// Radius of the balls.
    pub radius: f64,
    /// Axes in which the paraboloids were fitted.
    pub axes: FitAxes,
    /// Whether a known sensor oriented the normals; otherwise the side of each normal, and with it
    /// the sign of curvature, is a convention.
    pub oriented: bool,
    /// Larger principal curvature by value; a bump seen from the sensor is positive.
    pub k1: Vec<f32>,
    /// Smaller principal curvature by value.
    pub k2: Vec<f32>,
    /// Unit normals of the fitted surface, towards the sensor.
    pub normals: Vec<[f32; 3]>,
    /// Unit tangents along k1; the sign means nothing.
    pub directions: Vec<[f32; 3]>,
    /// Root mean square of the points' heights above the fit.
    pub residual: Vec<f32>,
    /// How much, at least, the worst determined coefficient suffers from the points' arrangement: the
    /// factor on its standard error (1: not at all; about 1.5 on a full disc).
    pub condition: Vec<f32>,
    /// Points in the ball, the query itself included where it is one of the cloud's.
    pub count: Vec<u32>,
    /// [`Status`] as a number.
    pub status: Vec<u8>,
    /// (l1 - l2) / l1 of the covariance's eigenvalues: 1 on a line.
    pub linearity: Vec<f32>,
    /// (l2 - l3) / l1: 1 on a plane.
    pub planarity: Vec<f32>,
    /// l3 / l1: 1 in a volume.
    pub scattering: Vec<f32>,
    /// a, b, c, d, e, f of eq. (5) about each query, along the cloud's x and y, with heights that grow
    /// away from the sensor as in the paper: along z, or against it where a viewpoint is above the
    /// surface. Empty in the surface's axes.
    pub coefficients: Vec<[f32; 6]>,
}

impl Extraction {
    /// Number of queries.
    pub fn len(&self) -> usize {
        self.k1.len()
    }

    /// Whether there was no query.
    pub fn is_empty(&self) -> bool {
        self.k1.is_empty()
    }

    /// The fitted paraboloid of a query in patch units (lengths divided by the patch's side, twice
    /// the radius), from which a signature is made. In the surface's axes x runs along k1.
    ///
    /// # Panics
    /// If `index` is outside.
    ///
    /// ```
    /// # use surfsig::{extract, ExtractOptions, PointCloud, Radius};
    /// let found = extract(&PointCloud::new(&[[0.0; 3]]), Radius::new(1.0)?, &ExtractOptions::default())?;
    /// assert!(found.paraboloid(0).a.is_nan());
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn paraboloid(&self, index: usize) -> Paraboloid {
        let side = 2.0 * self.radius;
        match self.axes {
            FitAxes::Surface => Paraboloid::of_principal_curvatures(self.k1[index], self.k2[index], side),
            FitAxes::Sensor => Paraboloid::of_coefficients(self.coefficients[index], side),
        }
    }
}

/// The columns while many threads write to them, each to its own entries, in any order.
///
/// Relaxed atomics are plain stores on every processor; they let the compiler see that no two
/// threads race, without `unsafe` and without a copy of the result.
pub(super) struct Columns {
    radius: f64,
    scalars: [Vec<AtomicU32>; 7],
    normals: Vec<[AtomicU32; 3]>,
    directions: Vec<[AtomicU32; 3]>,
    coefficients: Vec<[AtomicU32; 6]>,
    count: Vec<AtomicU32>,
    status: Vec<AtomicU8>,
}

/// Places of the columns in `Columns::scalars`.
const K1: usize = 0;
const K2: usize = 1;
const RESIDUAL: usize = 2;
const CONDITION: usize = 3;
const LINEARITY: usize = 4;
const PLANARITY: usize = 5;
const SCATTERING: usize = 6;

fn nan() -> AtomicU32 {
    AtomicU32::new(f32::NAN.to_bits())
}

fn store(cell: &AtomicU32, value: f64) {
    cell.store((value as f32).to_bits(), Relaxed);
}

fn value(cell: AtomicU32) -> f32 {
    f32::from_bits(cell.into_inner())
}

impl Columns {
    /// Entries that nobody writes to are those of points that are not finite.
    pub fn new(len: usize, radius: f64, axes: FitAxes) -> Self {
        let column = || (0..len).map(|_| nan()).collect();
        let vectors = || (0..len).map(|_| [nan(), nan(), nan()]).collect();
        let fitted = if axes == FitAxes::Sensor { len } else { 0 };
        Self {
            radius,
            scalars: std::array::from_fn(|_| column()),
            normals: vectors(),
            directions: vectors(),
            coefficients: (0..fitted).map(|_| std::array::from_fn(|_| nan())).collect(),
            count: (0..len).map(|_| AtomicU32::new(0)).collect(),
            status: (0..len).map(|_| AtomicU8::new(Status::NotFinite as u8)).collect(),
        }
    }

    /// Writes one lane of a batch, which came in units of the radius.
    pub fn write(&self, entry: usize, count: f64, fits: &Paraboloids, lane: usize) {
        let r = self.radius;
        let status = if fits.too_few.get(lane) {
            Status::TooFewPoints
        } else if fits.no_plane.get(lane) || fits.singular.get(lane) {
            Status::Degenerate
        } else if !fits.converged.get(lane) {
            Status::NotConverged
        } else {
            Status::Ok
        };
        self.status[entry].store(status as u8, Relaxed);
        self.count[entry].store(count as u32, Relaxed);
        let [l1, l2, l3] = fits.spread.map(|l| l.0[lane]);
        store(&self.scalars[LINEARITY][entry], (l1 - l2) / l1);
        store(&self.scalars[PLANARITY][entry], (l2 - l3) / l1);
        store(&self.scalars[SCATTERING][entry], l3 / l1);
        if fits.no_plane.get(lane) {
            return;
        }
        for axis in 0..3 {
            store(&self.normals[entry][axis], fits.principal.normal[axis].0[lane]);
        }
        if matches!(status, Status::TooFewPoints | Status::Degenerate) {
            return;
        }
        store(&self.scalars[K1][entry], fits.principal.k1.0[lane] / r);
        store(&self.scalars[K2][entry], fits.principal.k2.0[lane] / r);
        store(&self.scalars[RESIDUAL][entry], fits.residual.0[lane] * r);
        store(&self.scalars[CONDITION][entry], fits.condition.0[lane]);
        for axis in 0..3 {
            store(&self.directions[entry][axis], fits.principal.direction[axis].0[lane]);
        }
        if let Some(cells) = self.coefficients.get(entry) {
            // Heights grow away from the sensor, and the normal points to it.
            let sign = if fits.principal.normal[2].0[lane] > 0.0 { -1.0 } else { 1.0 };
            let units = [1.0 / r, 1.0 / r, 1.0, 1.0, 1.0 / r, r].map(|unit| sign * unit);
            for (cell, (coefficient, unit)) in cells.iter().zip(fits.coefficients.iter().zip(units)) {
                store(cell, coefficient.0[lane] * unit);
            }
        }
    }

    pub fn finish(self, axes: FitAxes, oriented: bool) -> Extraction {
        let [k1, k2, residual, condition, linearity, planarity, scattering] =
            self.scalars.map(|column| column.into_iter().map(value).collect());
        Extraction {
            radius: self.radius,
            axes,
            oriented,
            k1,
            k2,
            normals: self.normals.into_iter().map(|v| v.map(value)).collect(),
            directions: self.directions.into_iter().map(|v| v.map(value)).collect(),
            residual,
            condition,
            count: self.count.into_iter().map(AtomicU32::into_inner).collect(),
            status: self.status.into_iter().map(AtomicU8::into_inner).collect(),
            linearity,
            planarity,
            scattering,
            coefficients: self.coefficients.into_iter().map(|v| v.map(value)).collect(),
        }
    }
}
