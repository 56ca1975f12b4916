//! The columns of an extraction while threads write to them.

use super::{ExtractOptions, Extraction};
use crate::Status;
use crate::curvature::Principal;
use crate::fit::paraboloid::Paraboloids;
use crate::fit::quadric::Quadrics;
use crate::fit::{FitAxes, FitKind, FitUsed};
use rayon::prelude::*;

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
    fit_used: Vec<FitUsed>,
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
    /// Empty where only paraboloids are fitted.
    fit_used: &'a mut [FitUsed],
    count: &'a mut [u32],
    status: &'a mut [Status],
    linearity: &'a mut [f32],
    planarity: &'a mut [f32],
    scattering: &'a mut [f32],
    /// Empty in the surface's axes.
    coefficients: &'a mut [[f32; 6]],
}

/// What was fitted to one query, a lane of a batch.
pub(super) struct Fit<'a> {
    pub paraboloid: &'a Paraboloids,
    /// Where its curvature is the better one.
    pub quadric: Option<&'a Quadrics>,
    pub lane: usize,
}

impl Fit<'_> {
    /// Curvature, residual, and the standard errors of k1, k2 and their mean, in units of the radius.
    fn surface(&self) -> (&Principal, f64, [f64; 3]) {
        let lane = self.lane;
        if let Some(quadric) = self.quadric {
            return (&quadric.principal, quadric.residual.0[lane], quadric.errors.map(|e| e.0[lane]));
        }
        let [c1, _, between, _, _, c2] = self.paraboloid.covariance.map(|c| c.0[lane]);
        let mean = 0.5 * (c1 + between + between + c2).sqrt();
        (&self.paraboloid.principal, self.paraboloid.residual.0[lane], [c1.sqrt(), c2.sqrt(), mean])
    }
}

impl Columns {
    pub fn new(len: usize, radius: f64, own_radii: bool, options: &ExtractOptions<'_>) -> Self {
        // Zeros cost nothing until they are written over, and then in many threads at once.
        let zeros = || vec![0.0; len];
        let fitted = if options.axes == FitAxes::Sensor { len } else { 0 };
        let chosen = if options.fit == FitKind::Paraboloid { 0 } else { len };
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
            fit_used: vec![FitUsed::None; chosen],
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
            fit_used: &mut self.fit_used,
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
        let chosen = !self.fit_used.is_empty();
        let fit_used = if chosen { ordered(self.fit_used, &entries, FitUsed::None) } else { Vec::new() };
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
            fit_used,
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
            fit_used: first(&mut self.fit_used, len),
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
    pub fn write(&mut self, entry: usize, count: f64, radius: f64, fit: &Fit<'_>) {
        let &Fit { paraboloid: fits, quadric, lane } = fit;
        let r = self.radius * radius;
        if let Some(own) = self.radii.get_mut(entry) {
            *own = r as f32;
        }
        let status = if quadric.is_some() && !fits.one_sided.get(lane) {
            Status::Ok
        } else if quadric.is_some() {
            Status::OneSided
        } else if fits.too_few.get(lane) {
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
        let (principal, residual, [k1_std, k2_std, mean_std]) = fit.surface();
        self.normals[entry] = principal.normal.map(|v| if plane { v.0[lane] as f32 } else { f32::NAN });
        self.k1[entry] = curvature(principal.k1.0[lane] / r);
        self.k2[entry] = curvature(principal.k2.0[lane] / r);
        self.residual[entry] = curvature(residual * r);
        self.condition[entry] = curvature(fits.condition.0[lane]);
        self.k1_std[entry] = curvature(k1_std / r);
        self.k2_std[entry] = curvature(k2_std / r);
        self.mean_curvature_std[entry] = curvature(mean_std / r);
        if let Some(used) = self.fit_used.get_mut(entry) {
            *used = match (fitted, quadric) {
                (false, _) => FitUsed::None,
                (true, None) => FitUsed::Paraboloid,
                (true, Some(_)) => FitUsed::Quadric,
            };
        }
        self.directions[entry] = principal.direction.map(|v| curvature(v.0[lane]));
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
