//! What an extraction gives: one struct of arrays, a status per point.

use super::Status;
use crate::curvature::Paraboloid;
use crate::fit::FitAxes;
use crate::fit::paraboloid::Paraboloids;
use rayon::prelude::*;

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

    /// Takes over the values of some queries, by their numbers, from another extraction.
    pub(super) fn replace(&mut self, queries: &[usize], with: &Self) {
        fn take<T: Copy>(column: &mut [T], queries: &[usize], with: &[T]) {
            for (&query, &value) in queries.iter().zip(with) {
                column[query] = value;
            }
        }
        self.radius = with.radius;
        take(&mut self.radii, queries, &with.radii);
        take(&mut self.k1, queries, &with.k1);
        take(&mut self.k2, queries, &with.k2);
        take(&mut self.normals, queries, &with.normals);
        take(&mut self.directions, queries, &with.directions);
        take(&mut self.residual, queries, &with.residual);
        take(&mut self.condition, queries, &with.condition);
        take(&mut self.mean_curvature_std, queries, &with.mean_curvature_std);
        take(&mut self.k1_std, queries, &with.k1_std);
        take(&mut self.k2_std, queries, &with.k2_std);
        take(&mut self.count, queries, &with.count);
        take(&mut self.status, queries, &with.status);
        take(&mut self.linearity, queries, &with.linearity);
        take(&mut self.planarity, queries, &with.planarity);
        take(&mut self.scattering, queries, &with.scattering);
        take(&mut self.coefficients, queries, &with.coefficients);
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

/// The columns while threads write to them, in the order of the lattice: each thread then writes to
/// memory of its own, one entry after the other.
pub(super) struct Columns {
    radius: f64,
    radii: Vec<f32>,
    k1: Vec<f32>,
    k2: Vec<f32>,
    normals: Vec<[f32; 3]>,
    directions: Vec<[f32; 3]>,
    residual: Vec<f32>,
    condition: Vec<f32>,
    mean_curvature_std: Vec<f32>,
    k1_std: Vec<f32>,
    k2_std: Vec<f32>,
    count: Vec<u32>,
    status: Vec<Status>,
    linearity: Vec<f32>,
    planarity: Vec<f32>,
    scattering: Vec<f32>,
    coefficients: Vec<[f32; 6]>,
}

/// Some neighbouring entries of the columns.
pub(super) struct ColumnsPart<'a> {
    radius: f64,
    /// Empty where all queries have one radius.
    radii: &'a mut [f32],
    k1: &'a mut [f32],
    k2: &'a mut [f32],
    normals: &'a mut [[f32; 3]],
    directions: &'a mut [[f32; 3]],
    residual: &'a mut [f32],
    condition: &'a mut [f32],
    mean_curvature_std: &'a mut [f32],
    k1_std: &'a mut [f32],
    k2_std: &'a mut [f32],
    count: &'a mut [u32],
    status: &'a mut [Status],
    linearity: &'a mut [f32],
    planarity: &'a mut [f32],
    scattering: &'a mut [f32],
    /// Empty in the surface's axes.
    coefficients: &'a mut [[f32; 6]],
}

impl Columns {
    pub fn new(len: usize, radius: f64, own_radii: bool, axes: FitAxes) -> Self {
        // Zeros cost nothing until they are written over, and then in many threads at once.
        let zeros = || vec![0.0; len];
        let fitted = if axes == FitAxes::Sensor { len } else { 0 };
        Self {
            radius,
            radii: if own_radii { zeros() } else { Vec::new() },
            k1: zeros(),
            k2: zeros(),
            normals: vec![[0.0; 3]; len],
            directions: vec![[0.0; 3]; len],
            residual: zeros(),
            condition: zeros(),
            mean_curvature_std: zeros(),
            k1_std: zeros(),
            k2_std: zeros(),
            count: vec![0; len],
            status: vec![Status::NotFinite; len],
            linearity: zeros(),
            planarity: zeros(),
            scattering: zeros(),
            coefficients: vec![[0.0; 6]; fitted],
        }
    }

    /// The columns cut into parts of these lengths.
    pub fn parts(&mut self, lengths: impl Iterator<Item = usize>) -> Vec<ColumnsPart<'_>> {
        let mut rest = ColumnsPart {
            radius: self.radius,
            radii: &mut self.radii,
            k1: &mut self.k1,
            k2: &mut self.k2,
            normals: &mut self.normals,
            directions: &mut self.directions,
            residual: &mut self.residual,
            condition: &mut self.condition,
            mean_curvature_std: &mut self.mean_curvature_std,
            k1_std: &mut self.k1_std,
            k2_std: &mut self.k2_std,
            count: &mut self.count,
            status: &mut self.status,
            linearity: &mut self.linearity,
            planarity: &mut self.planarity,
            scattering: &mut self.scattering,
            coefficients: &mut self.coefficients,
        };
        lengths.map(|len| rest.split_off(len)).collect()
    }

    /// The entries in the order of the queries. `query_of_entry` names each entry's query; queries
    /// without an entry are those of points that are not finite.
    pub fn finish(
        self,
        queries: usize,
        query_of_entry: impl Iterator<Item = u32>,
        axes: FitAxes,
        oriented: bool,
    ) -> Extraction {
        const NOWHERE: u32 = u32::MAX;
        let mut entries = vec![NOWHERE; queries];
        for (entry, query) in query_of_entry.enumerate() {
            entries[query as usize] = entry as u32;
        }
        // One column after the other, so that hardly more than one is there twice.
        fn ordered<T: Copy + Send + Sync>(column: Vec<T>, entries: &[u32], missing: T) -> Vec<T> {
            let at = |&entry: &u32| if entry == NOWHERE { missing } else { column[entry as usize] };
            entries.par_iter().with_min_len(4096).map(at).collect()
        }
        let scalar = |column| ordered(column, &entries, f32::NAN);
        let vector = |column| ordered(column, &entries, [f32::NAN; 3]);
        let radii = if self.radii.is_empty() { Vec::new() } else { scalar(self.radii) };
        let coefficients = match axes {
            FitAxes::Surface => Vec::new(),
            FitAxes::Sensor => ordered(self.coefficients, &entries, [f32::NAN; 6]),
        };
        Extraction {
            radius: self.radius,
            radii,
            axes,
            oriented,
            k1: scalar(self.k1),
            k2: scalar(self.k2),
            normals: vector(self.normals),
            directions: vector(self.directions),
            residual: scalar(self.residual),
            condition: scalar(self.condition),
            mean_curvature_std: scalar(self.mean_curvature_std),
            k1_std: scalar(self.k1_std),
            k2_std: scalar(self.k2_std),
            count: ordered(self.count, &entries, 0),
            status: ordered(self.status, &entries, Status::NotFinite),
            linearity: scalar(self.linearity),
            planarity: scalar(self.planarity),
            scattering: scalar(self.scattering),
            coefficients,
        }
    }
}

impl ColumnsPart<'_> {
    /// Takes the first entries away, and returns them.
    fn split_off(&mut self, len: usize) -> Self {
        /// Of columns that are not wanted there are none.
        fn first<'a, T>(column: &mut &'a mut [T], len: usize) -> &'a mut [T] {
            column.split_off_mut(..len).unwrap_or_default()
        }
        Self {
            radius: self.radius,
            radii: first(&mut self.radii, len),
            k1: first(&mut self.k1, len),
            k2: first(&mut self.k2, len),
            normals: first(&mut self.normals, len),
            directions: first(&mut self.directions, len),
            residual: first(&mut self.residual, len),
            condition: first(&mut self.condition, len),
            mean_curvature_std: first(&mut self.mean_curvature_std, len),
            k1_std: first(&mut self.k1_std, len),
            k2_std: first(&mut self.k2_std, len),
            count: first(&mut self.count, len),
            status: first(&mut self.status, len),
            linearity: first(&mut self.linearity, len),
            planarity: first(&mut self.planarity, len),
            scattering: first(&mut self.scattering, len),
            coefficients: first(&mut self.coefficients, len),
        }
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.k1.len()
    }

    /// Writes one lane of a batch, which came in units of its neighbourhood's radius; that one is in
    /// units of the lattice's.
    pub fn write(&mut self, entry: usize, count: f64, radius: f64, fits: &Paraboloids, lane: usize) {
        let r = self.radius * radius;
        if let Some(own) = self.radii.get_mut(entry) {
            *own = r as f32;
        }
        let status = if fits.too_few.get(lane) {
            Status::TooFewPoints
        } else if fits.no_plane.get(lane) || fits.singular.get(lane) {
            Status::Degenerate
        } else if !fits.converged.get(lane) {
            Status::NotConverged
        } else if fits.one_sided.get(lane) {
            Status::OneSided
        } else {
            Status::Ok
        };
        let fitted = !matches!(status, Status::TooFewPoints | Status::Degenerate);
        let curvature = |value: f64| if fitted { value as f32 } else { f32::NAN };
        self.status[entry] = status;
        self.count[entry] = count as u32;
        let [l1, l2, l3] = fits.spread.map(|l| l.0[lane]);
        self.linearity[entry] = ((l1 - l2) / l1) as f32;
        self.planarity[entry] = ((l2 - l3) / l1) as f32;
        self.scattering[entry] = (l3 / l1) as f32;
        let plane = !fits.no_plane.get(lane);
        self.normals[entry] = fits.principal.normal.map(|v| if plane { v.0[lane] as f32 } else { f32::NAN });
        self.k1[entry] = curvature(fits.principal.k1.0[lane] / r);
        self.k2[entry] = curvature(fits.principal.k2.0[lane] / r);
        self.residual[entry] = curvature(fits.residual.0[lane] * r);
        self.condition[entry] = curvature(fits.condition.0[lane]);
        let [c1, _, between, _, _, c2] = fits.covariance.map(|c| c.0[lane]);
        self.k1_std[entry] = curvature(c1.sqrt() / r);
        self.k2_std[entry] = curvature(c2.sqrt() / r);
        self.mean_curvature_std[entry] = curvature(0.5 * (c1 + between + between + c2).sqrt() / r);
        self.directions[entry] = fits.principal.direction.map(|v| curvature(v.0[lane]));
        if let Some(coefficients) = self.coefficients.get_mut(entry) {
            // Heights grow away from the sensor, and the normal points to it.
            let sign = if fits.principal.normal[2].0[lane] > 0.0 { -1.0 } else { 1.0 };
            let units = [1.0 / r, 1.0 / r, 1.0, 1.0, 1.0 / r, r];
            for (value, (coefficient, unit)) in
                coefficients.iter_mut().zip(fits.coefficients.iter().zip(units))
            {
                *value = curvature(sign * coefficient.0[lane] * unit);
            }
        }
    }
}
