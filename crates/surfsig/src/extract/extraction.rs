//! What an extraction gives: one struct of arrays, a status per point.

use super::declaration::{Entry, extraction};
use super::{ExtractOptions, Queries};
use crate::curvature::Paraboloid;
use crate::fit::{FitAxes, FitKind, FitUsed};
use crate::{PointCloud, Resolution, Status};
use rayon::prelude::*;

extraction! {
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
    /// assert_eq!(found.status[middle], Status::Ok);
    /// assert!((found.k1[middle] - 10.0).abs() < 0.02);
    /// assert!(found.k2[middle].abs() < 0.02);
    /// assert!(found.directions[middle][1].abs() < 1e-2);
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub struct Extraction {
        /// Radius of the balls; of nearest neighbours, of the largest ball that was looked through.
        radius: f64,
        /// Axes in which the paraboloids were fitted.
        axes: FitAxes,
        /// Whether a known sensor oriented the normals; otherwise the side of each normal, and with it
        /// the sign of curvature, is a convention.
        oriented: bool,
    }

    columns {
        /// Larger principal curvature by value; a bump seen from the sensor is positive.
        k1: f32, of_fit;
        /// Smaller principal curvature by value.
        k2: f32, of_fit;
        /// Unit normals of the fitted surface, towards the sensor.
        normals: [f32; 3], of_points;
        /// Unit tangents along k1; the sign means nothing.
        directions: [f32; 3], of_fit;
        /// Standard error of (k1 + k2) / 2. NaN in the sensor's axes.
        mean_curvature_std: f32, of_fit;
        /// Standard error of k1: right where k1 and k2 differ significantly.
        k1_std: f32, of_fit;
        /// Standard error of k2.
        k2_std: f32, of_fit;
        /// Root mean square of the points' heights above the fit.
        residual: f32, of_fit;
        /// How much, at least, the worst determined coefficient suffers from the points' arrangement: the
        /// factor on its standard error (1: not at all; about 1.5 on a full disc).
        condition: f32, of_fit;
        /// Points in the ball, the query itself included where it is one of the cloud's.
        count: u32, of_points;
        /// What became of each query.
        status: Status, of_points;
        /// (l1 - l2) / l1 of the covariance's eigenvalues: 1 on a line.
        linearity: f32, of_points;
        /// (l2 - l3) / l1: 1 on a plane.
        planarity: f32, of_points;
        /// l3 / l1: 1 in a volume.
        scattering: f32, of_points;
        /// Whose curvature each query has. Empty where only paraboloids were fitted.
        fit_used: FitUsed, of_fit if chosen_fit;
        /// Radius of each query's neighbourhood, where each has its own: the distance to its farthest
        /// point. Empty where all have the same.
        radii: f32, of_points if own_radii;
        /// a, b, c, d, e, f of eq. (5) about each query, along the cloud's x and y, with heights that grow
        /// away from the sensor as in the paper: along z, or against it where a viewpoint is above the
        /// surface. Empty in the surface's axes.
        coefficients: [f32; 6], of_fit if sensor_axes;
    }
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

    /// Radius of a query's neighbourhood.
    ///
    /// # Panics
    /// If `index` is outside.
    pub fn radius_of(&self, index: usize) -> f64 {
        if self.radii.is_empty() { self.radius } else { f64::from(self.radii[index]) }
    }

    /// Marks the queries whose coordinates are too coarse for their radius, and takes their curvature away.
    pub(super) fn mark_too_coarse(
        &mut self,
        resolution: &Resolution,
        cloud: &PointCloud<'_>,
        queries: &Queries<'_>,
    ) {
        if !resolution.single_precision && resolution.lattice == [0.0; 3] {
            return;
        }
        for (i, position) in queries.positions(cloud).enumerate() {
            let valued = match self.status[i] {
                Status::NotFinite | Status::TooFewPoints => false,
                // The nearest points may be in one place, and then have no radius to speak of.
                Status::Degenerate => self.radii.is_empty(),
                _ => true,
            };
            if valued && resolution.is_too_coarse(position, self.normals[i], self.radius_of(i)) {
                self.status[i] = Status::TooCoarse;
                self.clear_fit(i);
            }
        }
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
        let side = 2.0 * self.radius_of(index);
        match self.axes {
            FitAxes::Surface => Paraboloid::of_principal_curvatures(self.k1[index], self.k2[index], side),
            FitAxes::Sensor => Paraboloid::of_coefficients(self.coefficients[index], side),
        }
    }
}

/// The queries' entries among those that threads wrote.
pub(super) struct Entries(Vec<u32>);

impl Entries {
    const NOWHERE: u32 = u32::MAX;

    /// `query_of_entry` names each entry's query; queries without an entry are those of points that are not finite.
    pub fn new(queries: usize, query_of_entry: impl Iterator<Item = u32>) -> Self {
        let mut entries = vec![Self::NOWHERE; queries];
        for (entry, query) in query_of_entry.enumerate() {
            entries[query as usize] = entry as u32;
        }
        Self(entries)
    }

    fn of<T: Entry>(&self, column: Vec<T>) -> Vec<T> {
        let at = |&entry: &u32| if entry == Self::NOWHERE { T::MISSING } else { column[entry as usize] };
        self.0.par_iter().with_min_len(4096).map(at).collect()
    }
}

/// Under which columns are there that not each extraction has.
#[derive(Clone, Copy)]
pub(super) struct Conditions {
    /// Each query has a radius of its own.
    pub own_radii: bool,
    /// There is a choice between kinds of fit.
    pub chosen_fit: bool,
    /// The paraboloids are fitted in the sensor's axes.
    pub sensor_axes: bool,
}

impl Conditions {
    pub fn new(own_radii: bool, options: &ExtractOptions<'_>) -> Self {
        Self {
            own_radii,
            chosen_fit: options.fit != FitKind::Paraboloid,
            sensor_axes: options.axes == FitAxes::Sensor,
        }
    }

    fn of(found: &Extraction) -> Self {
        Self {
            own_radii: !found.radii.is_empty(),
            chosen_fit: !found.fit_used.is_empty(),
            sensor_axes: found.axes == FitAxes::Sensor,
        }
    }
}

/// A column of an extraction, one entry for each query.
///
/// ```
/// let column = surfsig::Column::from(vec![1.0_f32, 2.0]);
/// assert_eq!(column, surfsig::Column::Scalars(vec![1.0, 2.0]));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Column {
    /// Numbers.
    Scalars(Vec<f32>),
    /// Vectors.
    Vectors(Vec<[f32; 3]>),
    /// Coefficients of eq. (5).
    Coefficients(Vec<[f32; 6]>),
    /// Numbers of points.
    Counts(Vec<u32>),
    /// Statuses.
    Statuses(Vec<Status>),
    /// Kinds of fit.
    FitsUsed(Vec<FitUsed>),
}

macro_rules! column_of {
    ($($variant:ident: $entry:ty;)*) => {
        $(impl From<Vec<$entry>> for Column {
            fn from(entries: Vec<$entry>) -> Self {
                Self::$variant(entries)
            }
        })*
    };
}

column_of! {
    Scalars: f32;
    Vectors: [f32; 3];
    Coefficients: [f32; 6];
    Counts: u32;
    Statuses: Status;
    FitsUsed: FitUsed;
}
