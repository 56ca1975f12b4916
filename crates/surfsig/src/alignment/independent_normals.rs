//! Whether a surface holds a motion, or only the errors of its normals do.
//!
//! Normals err, and a scan that slides along a smooth corridor leaves thousands of slightly wrong planes: to least squares
//! that looks like a surface that holds it. Two normals of one place that err independently of each other, of two scans
//! or of two halves of a neighbourhood, tell both apart: what the square of one says about a motion is too much by its
//! error; the product of both is right in the mean (an instrumental variable: Fuller, Measurement Error Models, 1987,
//! section 1.4).

use super::gicp_cloud::{GicpCloud, GicpTarget};
use super::observability::{FreeDirection, Motions, UNOBSERVABLE};
use super::point_to_surface::PointToSurface;
use super::rivals::RivalSettings;
use nalgebra::Vector3;
use std::borrow::Borrow;
use std::cell::LazyCell;

/// Voxels within which the normal of a voxel is that of a point: its own or a neighbouring one.
const REACH: f64 = 2.0;

/// From when on a surface holds a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HeldLimits {
    /// Share of what the normals that are used say about a motion that both others say alike.
    pub share: f64,
    /// What both say alike, in standard errors.
    pub deviations: f64,
}

/// A place of a surface with unit normals, of which the sides are open.
pub(crate) struct PlaceNormals {
    pub point: [f64; 3],
    /// The one along which a transform was fitted.
    pub used: [f64; 3],
    /// Two that err independently of each other.
    pub independent: [[f64; 3]; 2],
}

/// Places of a surface, each with two normals that err independently of each other.
pub(crate) struct IndependentNormals(Vec<PlaceNormals>);

impl IndependentNormals {
    pub fn new(places: impl Iterator<Item = PlaceNormals>) -> Self {
        Self(places.collect())
    }

    /// Whether the surface holds points that move with a velocity: what both normals say alike is no chance, and so large
    /// a share of what the used ones say that the surface says more than their errors do.
    pub fn hold(&self, velocity: impl Fn(&[f64; 3]) -> Vector3<f64>, limits: HeldLimits) -> bool {
        let (mut said, mut alike, mut variance) = (0.0, 0.0, 0.0);
        for PlaceNormals { point, used, independent } in &self.0 {
            let velocity = velocity(point);
            let [one, other] = independent.map(Vector3::from);
            // The mean of this product, of normals on one side, is the square of what the true normal says; that of
            // `said` is larger.
            let product = one.dot(&velocity) * other.dot(&velocity) * one.dot(&other).signum();
            alike += product;
            variance += product * product;
            said += Vector3::from(*used).dot(&velocity).powi(2);
        }
        alike > limits.share * said && alike > limits.deviations * f64::sqrt(variance)
    }
}

impl PointToSurface {
    /// Motions that the inliers do not determine, in the target: along some the surface slides over itself, along others,
    /// which are weak, only errors of normals would hold it. Normals are those of the source and the target, of which
    /// each has one point for a voxel; they are asked for only where some motion is weak.
    pub fn free_directions<C: Borrow<[GicpCloud; 2]>>(
        &self,
        clouds: impl FnOnce() -> C,
        voxel: f64,
        settings: &RivalSettings,
    ) -> Vec<FreeDirection> {
        let reach = REACH * voxel;
        let limits = HeldLimits { share: settings.held_share, deviations: settings.held_deviations };
        let motions = Motions::new(&self.points, &self.normals);
        let to_source = self.T_target_source.inverse();
        let both = LazyCell::new(|| {
            let clouds = clouds();
            let [source, target] = clouds.borrow();
            let normals_at = |(point, used): (&[f64; 3], &[f64; 3])| {
                let ours = source.surface(source.nearest(to_source.transform_point(*point), reach)?).1;
                let theirs = target.surface(target.nearest(*point, reach)?).1;
                let independent = [self.T_target_source.transform_vector(ours), theirs];
                Some(PlaceNormals { point: *point, used: *used, independent })
            };
            IndependentNormals::new(self.points.iter().zip(&self.normals).filter_map(normals_at))
        });
        motions.named(|sliding, number| {
            sliding <= UNOBSERVABLE
                || sliding <= settings.weak && !both.hold(|point| motions.velocity(number, point), limits)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::point_to_surface::PointToSurfaceSettings;
    use super::super::target_surface::TargetSurface;
    use super::*;
    use crate::geometry::RigidTransform;
    use crate::random::uniform;

    const LIMITS: HeldLimits = HeldLimits { share: 0.5, deviations: 3.0 };

    /// The motions of a noisy square of 60 x 60, with a step of a height in its middle, that two scans of it leave open.
    fn free(noise: f64, height: f64) -> Vec<FreeDirection> {
        let scan = |number: usize| {
            let at = |i: usize, k: u64| uniform(i + 100_000 * number, k) - 0.5;
            let floor = (0..3600).map(|i| {
                let x = 60.0 * at(i, 0);
                [x, 60.0 * at(i, 1), noise * at(i, 2) + if x > 0.0 { height } else { 0.0 }]
            });
            let riser = (0..(60.0 * height) as usize)
                .map(|i| [noise * at(i, 3), 60.0 * at(i, 4), height * (0.5 + at(i, 5))]);
            floor.chain(riser).collect::<Vec<[f64; 3]>>()
        };
        let [source, target] = [scan(0), scan(1)];
        let surface = TargetSurface::new(target.clone(), 1.0);
        let settings = PointToSurfaceSettings::default();
        let found = surface.align(&source, RigidTransform::identity(), &settings).expect("it was at the end");
        let clouds = [source, target].map(GicpCloud::new);
        found.free_directions(|| clouds, 1.0, &RivalSettings::default())
    }

    #[test]
    fn a_noisy_square_slides_and_turns_over_itself() {
        for noise in [0.1, 0.5] {
            assert_eq!(free(noise, 0.0).len(), 3, "noise {noise}");
        }
    }

    #[test]
    fn a_step_leaves_the_motion_along_it_only() {
        for noise in [0.1, 0.5] {
            let found = free(noise, 8.0);
            let [FreeDirection::Translation { axis }] = found[..] else { panic!("{noise}: {found:?}") };
            assert!(axis[1].abs() > 0.99, "{noise}: {axis:?}");
        }
    }

    #[test]
    fn sides_of_normals_are_of_no_account() {
        let flipped = |sign: f64| {
            let places = (0..500).map(|i| {
                let x = f64::from(i) / 500.0 - 0.5;
                let normal = [0.6, 0.0, 0.8];
                PlaceNormals {
                    point: [x, 0.0, 0.0],
                    used: normal,
                    independent: [normal, normal.map(|n| n * sign)],
                }
            });
            IndependentNormals::new(places).hold(|_| Vector3::x(), LIMITS)
        };
        assert!(flipped(1.0) && flipped(-1.0));
        assert!(!IndependentNormals::new(std::iter::empty()).hold(|_| Vector3::x(), LIMITS));
    }
}
