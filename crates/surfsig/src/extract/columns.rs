//! What was fitted to a query, written into the columns of an extraction.

use super::extraction::ColumnsPart;
use crate::Status;
use crate::curvature::Principal;
use crate::fit::FitUsed;
use crate::fit::paraboloid::Paraboloids;
use crate::fit::quadric::Quadrics;

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

impl ColumnsPart<'_> {
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
