//! The samples of a surface by the direction in which a sensor saw them.

use crate::depth_image::SurfacePlace;
use crate::kd_tree::KdTree;
use nalgebra::Vector3;

/// Samples, searched by their direction from a viewpoint: what is before and behind a place, however far.
pub(super) struct LinesOfSight {
    /// From where all was seen.
    pub viewpoint: [f64; 3],
    /// Of the unit vectors to the samples.
    directions: KdTree,
    /// The samples' numbers in the order of the tree.
    numbers: Vec<u32>,
}

impl LinesOfSight {
    pub fn new(samples: &[SurfacePlace], viewpoint: [f64; 3]) -> Self {
        let towards = |sample: &SurfacePlace| {
            let vector = [0, 1, 2].map(|k| f64::from(sample.place[k]) - viewpoint[k]);
            Vector3::from(vector).try_normalize(0.0).map(<[f64; 3]>::from)
        };
        let (numbers, directions): (Vec<u32>, Vec<[f64; 3]>) =
            (0..).zip(samples).filter_map(|(number, sample)| Some((number, towards(sample)?))).unzip();
        let mut directions = KdTree::new(&directions);
        let numbers = directions.renumber().into_iter().map(|entry| numbers[entry as usize]).collect();
        Self { viewpoint, directions, numbers }
    }

    /// Shows the numbers of the samples whose direction is at most an angle off that to a place, in an order that depends on
    /// the samples alone; none where the place is the viewpoint.
    pub fn each_around(&self, place: [f64; 3], angle: f64, mut take: impl FnMut(u32)) {
        let vector = Vector3::from([0, 1, 2].map(|k| place[k] - self.viewpoint[k]));
        let Some(direction) = vector.try_normalize(0.0) else { return };
        // The distance between the ends of two unit vectors.
        let chord = 2.0 * (0.5 * angle).sin();
        self.directions.each_within(direction.into(), chord, |entry| take(self.numbers[entry as usize]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;

    #[test]
    fn samples_in_a_cone_are_those_of_a_search_of_all() {
        let viewpoint = [0.3, -2.0, 5.0];
        let place = |i: usize| [0, 1, 2].map(|k| (8.0 * uniform(3 * i + k, 4) - 4.0) as f32);
        let samples: Vec<SurfacePlace> =
            (0..2000).map(|i| SurfacePlace { place: place(i), normal: [0.0, 0.0, 1.0] }).collect();
        let lines = LinesOfSight::new(&samples, viewpoint);
        for (middle, angle) in [([0.0, 0.0, 0.0], 0.3), ([1.0, 2.0, -3.0], 0.05), ([0.3, 3.0, 5.0], 1.4)] {
            let towards = |point: [f64; 3]| Vector3::from([0, 1, 2].map(|k| point[k] - viewpoint[k]));
            let is_within =
                |sample: &SurfacePlace| towards(sample.place.map(f64::from)).angle(&towards(middle)) <= angle;
            let expected: Vec<u32> = (0..2000).filter(|&i| is_within(&samples[i as usize])).collect();
            let mut found = Vec::new();
            lines.each_around(middle, angle, |number| found.push(number));
            found.sort_unstable();
            assert_eq!(found, expected);
            assert!(found.len() > 3, "{}", found.len());
        }
        let mut found = 0;
        lines.each_around(viewpoint, 1.0, |_| found += 1);
        assert_eq!(found, 0, "the viewpoint itself is in no direction");
    }
}
