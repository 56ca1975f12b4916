//! Whether the map's surface holds a motion, or only the errors of its normals do.
//!
//! Normals err, and a scan that slides along a smooth corridor leaves thousands of slightly wrong planes: to least squares
//! that looks like a surface that holds it. Normals of two halves of each neighbourhood err independently of each other.
//! What the square of one says about a motion is too much by its error; the product of both is right in the mean (an
//! instrumental variable: Fuller, Measurement Error Models, 1987, section 1.4).

use super::local_map::LocalMap;
use super::settings::ScanAlignmentSettings;
use crate::RigidTransform;
use nalgebra::Vector3;

/// A correspondence with the normals of both halves of the map's neighbourhood; in the scan's coordinates.
struct Row {
    point: [f64; 3],
    normal: Vector3<f64>,
    halves: [Vector3<f64>; 2],
}

/// Normals of correspondences, each with those of both halves of its neighbourhood.
pub(super) struct HalfNormals(Vec<Row>);

impl HalfNormals {
    /// Of a scan's points, and the numbers of the map's points that correspond to them.
    pub fn new(map: &LocalMap, pose: &RigidTransform, pairs: impl Iterator<Item = ([f64; 3], u32)>) -> Self {
        let to_scan = pose.inverse();
        let row = |(point, target): ([f64; 3], u32)| {
            let normal = Vector3::from(to_scan.transform_vector(map.normal(target)?));
            let halves = map.half_normals(target)?.map(|half| {
                let half = Vector3::from(to_scan.transform_vector(half));
                // An eigenvector has no side of its own.
                half * half.dot(&normal).signum()
            });
            Some(Row { point, normal, halves })
        };
        Self(pairs.filter_map(row).collect())
    }

    /// Whether the surface holds points that move with a velocity: what both halves say alike is no chance, and most of
    /// what the normals say.
    pub fn hold(
        &self,
        velocity: impl Fn(&[f64; 3]) -> Vector3<f64>,
        settings: &ScanAlignmentSettings,
    ) -> bool {
        let (mut said, mut alike, mut variance) = (0.0, 0.0, 0.0);
        for Row { point, normal, halves: [one, other] } in &self.0 {
            let velocity = velocity(point);
            // The mean of this product is the square of what the true normal says; that of `said` is larger.
            let product = one.dot(&velocity) * other.dot(&velocity);
            alike += product;
            variance += product * product;
            said += normal.dot(&velocity).powi(2);
        }
        alike > settings.held_share * said && alike > settings.held_deviations * f64::sqrt(variance)
    }
}

#[cfg(test)]
mod tests {
    use super::super::settings::MapSettings;
    use super::*;
    use crate::random::uniform;

    /// Whether a noisy floor, with a step of a height in its middle, holds what moves along x.
    fn is_held(noise: f64, height: f64) -> bool {
        let mut map = LocalMap::new(&MapSettings::default());
        let at = |i: usize, k: u64| uniform(i, k) - 0.5;
        let floor = (0..20_000).map(|i| {
            let x = 80.0 * at(i, 0);
            [x, 60.0 * at(i, 1), noise * at(i, 2) + if x > 0.0 { height } else { 0.0 }]
        });
        let riser = (0..(60.0 * height * 4.0) as usize)
            .map(|i| [noise * at(i, 3), 60.0 * at(i, 4), height * (0.5 + at(i, 5))]);
        map.add(floor.chain(riser), 0);
        let points = map.points().to_vec();
        let pairs = points.into_iter().zip(0..);
        HalfNormals::new(&map, &RigidTransform::identity(), pairs)
            .hold(|_| Vector3::x(), &ScanAlignmentSettings::default())
    }

    #[test]
    fn errors_of_normals_hold_nothing_and_a_step_does() {
        for noise in [0.05, 0.3, 0.6] {
            assert!(!is_held(noise, 0.0), "a floor with noise {noise}");
            assert!(is_held(noise, 5.0), "a step with noise {noise}");
        }
    }
}
