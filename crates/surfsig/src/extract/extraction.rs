//! What an extraction gives: one struct of arrays, a status per point.

use super::Queries;
use crate::curvature::Paraboloid;
use crate::fit::{FitAxes, FitUsed};
use crate::{PointCloud, Resolution, Status};

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
#[derive(Debug, Clone)]
pub struct Extraction {
    /// Radius of the balls; of nearest neighbours, of the largest ball that was looked through.
    pub radius: f64,
    /// Radius of each query's neighbourhood, where each has its own: the distance to its farthest
    /// point. Empty where all have the same.
    pub radii: Vec<f32>,
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
    /// Standard error of (k1 + k2) / 2. NaN in the sensor's axes.
    pub mean_curvature_std: Vec<f32>,
    /// Standard error of k1: right where k1 and k2 differ significantly.
    pub k1_std: Vec<f32>,
    /// Standard error of k2.
    pub k2_std: Vec<f32>,
    /// Whose curvature each query has. Empty where only paraboloids were fitted.
    pub fit_used: Vec<FitUsed>,
    /// Points in the ball, the query itself included where it is one of the cloud's.
    pub count: Vec<u32>,
    /// What became of each query.
    pub status: Vec<Status>,
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

    /// Radius of a query's neighbourhood.
    ///
    /// # Panics
    /// If `index` is outside.
    pub fn radius_of(&self, index: usize) -> f64 {
        if self.radii.is_empty() { self.radius } else { f64::from(self.radii[index]) }
    }

    /// Takes over values from another extraction: (number here, number there).
    pub(crate) fn take_over(&mut self, entries: impl Iterator<Item = (usize, usize)> + Clone, with: &Self) {
        let take = Take(entries);
        take.over(&mut self.radii, &with.radii);
        take.over(&mut self.k1, &with.k1);
        take.over(&mut self.k2, &with.k2);
        take.over(&mut self.normals, &with.normals);
        take.over(&mut self.directions, &with.directions);
        take.over(&mut self.residual, &with.residual);
        take.over(&mut self.condition, &with.condition);
        take.over(&mut self.mean_curvature_std, &with.mean_curvature_std);
        take.over(&mut self.k1_std, &with.k1_std);
        take.over(&mut self.k2_std, &with.k2_std);
        take.over(&mut self.fit_used, &with.fit_used);
        take.over(&mut self.count, &with.count);
        take.over(&mut self.status, &with.status);
        take.over(&mut self.linearity, &with.linearity);
        take.over(&mut self.planarity, &with.planarity);
        take.over(&mut self.scattering, &with.scattering);
        take.over(&mut self.coefficients, &with.coefficients);
    }

    /// Marks the queries whose coordinates are too coarse for their radius, and takes their curvature away.
    pub(super) fn mark_too_coarse(&mut self, cloud: &PointCloud<'_>, queries: &Queries<'_>) {
        let resolution = Resolution::of(cloud);
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
                for column in [
                    &mut self.k1,
                    &mut self.k2,
                    &mut self.residual,
                    &mut self.condition,
                    &mut self.mean_curvature_std,
                    &mut self.k1_std,
                    &mut self.k2_std,
                ] {
                    column[i] = f32::NAN;
                }
                self.directions[i] = [f32::NAN; 3];
                if let Some(used) = self.fit_used.get_mut(i) {
                    *used = FitUsed::None;
                }
                if let Some(coefficients) = self.coefficients.get_mut(i) {
                    *coefficients = [f32::NAN; 6];
                }
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

/// Which entries go where.
struct Take<I>(I);

impl<I: Iterator<Item = (usize, usize)> + Clone> Take<I> {
    /// A column that is not there on either side stays as it is.
    fn over<T: Copy>(&self, column: &mut [T], with: &[T]) {
        if column.is_empty() || with.is_empty() {
            return;
        }
        for (here, there) in self.0.clone() {
            column[here] = with[there];
        }
    }
}
