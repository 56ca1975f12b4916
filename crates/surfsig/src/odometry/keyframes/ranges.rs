//! How far a scan sees: what tells, whatever way it is turned, where it cannot have been taken.

use super::super::scale::distances;

/// Quantiles that are compared: enough to tell a long room from a short one, and few enough to cost nothing.
const QUANTILES: usize = 16;

/// Quantiles of the distances of a scan's points from its sensor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ranges([f64; QUANTILES]);

impl Ranges {
    /// Of points about the sensor, of which each stands for as much surface.
    pub fn new(points: &[[f64; 3]]) -> Self {
        let mut lengths = distances(points, [0.0; 3]);
        lengths.sort_by(f64::total_cmp);
        let at = |k: usize| lengths.get((2 * k + 1) * lengths.len() / (2 * QUANTILES)).copied();
        Self(std::array::from_fn(|k| at(k).unwrap_or(0.0)))
    }

    /// The mean difference to those of another scan, as a part of its ranges.
    pub fn difference(&self, other: &Self) -> f64 {
        let part = |(a, b): (&f64, &f64)| (a - b).abs() / a.max(*b).max(f64::MIN_POSITIVE);
        self.0.iter().zip(&other.0).map(part).sum::<f64>() / QUANTILES as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RigidTransform;

    /// The walls of a room about a sensor in its middle.
    fn room(half: [f64; 2]) -> Vec<[f64; 3]> {
        let [x, y] = half;
        (-50..=50)
            .map(|k| f64::from(k) / 50.0)
            .flat_map(|k| [[k * x, y, 1.0], [k * x, -y, 1.0], [x, k * y, 1.0], [-x, k * y, 1.0]])
            .collect()
    }

    #[test]
    fn a_turned_scan_sees_as_far_and_one_in_another_room_does_not() {
        let scan = room([20.0, 8.0]);
        let turn = RigidTransform::from_rotation_vector([0.3, -1.0, 2.0], [0.0; 3]);
        let turned = Ranges::new(&turn.transform_points(&scan));
        let ranges = Ranges::new(&scan);
        assert!(ranges.difference(&turned) < 1e-9);
        assert!(ranges.difference(&Ranges::new(&room([20.0, 12.0]))) > 0.1);
        assert_eq!(Ranges::new(&[]).difference(&Ranges::new(&[])), 0.0);
    }
}
