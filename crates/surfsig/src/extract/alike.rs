//! Where else a surface is: zeta of all queries with one, with a flat atom as long as the noise asks for.

use super::Extraction;
use crate::frame::{Frame, SIGNATURE};
use crate::similarity::similarity;
use crate::statistics::median;
use crate::{FitAxes, Status};
use rayon::prelude::*;

/// Signatures that a thread makes at a time: half a megabyte.
const PART: usize = 512;

impl Extraction {
    /// The flat atom's length that follows the median standard error of the mean curvature, in a frame. `None` where
    /// no query has one, as in the sensor's axes, and where the noise is beyond the vocabulary's end.
    ///
    /// ```
    /// use surfsig::{extract, ExtractOptions, Frame, PointCloud, Radius};
    /// let rough = |i: i32| [0.1 * (i % 30) as f32, 0.1 * (i / 30) as f32, 0.001 * (7 * i % 11) as f32];
    /// let points: Vec<[f32; 3]> = (0..900).map(rough).collect();
    /// let found = extract(&PointCloud::new(&points), Radius::new(0.4)?, &ExtractOptions::default())?;
    /// assert!(found.flat_atom_length(Frame::shared()).unwrap() > 0.0);
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn flat_atom_length(&self, frame: &Frame) -> Option<f64> {
        let in_patch_units = |i: usize| 2.0 * self.radius_of(i) * f64::from(self.mean_curvature_std[i]);
        let noises = (0..self.len()).map(in_patch_units).filter(|noise| noise.is_finite()).collect();
        frame.flat_atom_length(median(noises)?)
    }

    /// zeta of eq. (12) of each query with one of them, both with a flat atom of this length, or without one where
    /// it is 0. Where no sensor is known, that of the more similar side. NaN where there is no signature, and for all
    /// where the query has none; in the sensor's axes, which give curvature no axes of its own, for all.
    ///
    /// # Panics
    /// If `query` is outside.
    ///
    /// ```
    /// use surfsig::{extract, ExtractOptions, Frame, PointCloud, Radius};
    /// // A cylinder of radius 1 along y.
    /// let points: Vec<[f64; 3]> = (0..900)
    ///     .map(|i| (0.05 * f64::from(i % 30) - 0.75, 0.05 * f64::from(i / 30)))
    ///     .map(|(s, y)| [s.sin(), y, s.cos()])
    ///     .collect();
    /// let found = extract(&PointCloud::new_f64(&points), Radius::new(0.3)?, &ExtractOptions::default())?;
    /// let zeta = found.similarities(465, 0.0, Frame::shared());
    /// assert!(zeta[465] > 0.999_999 && zeta[435] > 0.9);
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn similarities(&self, query: usize, flat_atom: f64, frame: &Frame) -> Vec<f32> {
        let mut zeta = vec![f32::NAN; self.len()];
        let Some(references) = self.references(query, flat_atom, frame) else { return zeta };
        zeta.par_chunks_mut(PART).enumerate().for_each(|(part, zeta)| {
            let start = part * PART;
            let mut rows = vec![[0.0; SIGNATURE]; zeta.len()];
            let mut statuses = self.status[start..start + zeta.len()].to_vec();
            let curvatures: Vec<_> = (start..start + zeta.len()).map(|i| self.in_patch_units(i)).collect();
            frame.signatures_of_curvatures(1.0, &curvatures, &mut rows, &mut statuses);
            for (zeta, row) in zeta.iter_mut().zip(&rows) {
                let own = with_flat_atom(row, flat_atom);
                let alike = references.iter().map(|reference| similarity(&own, reference));
                *zeta = alike.fold(f64::NAN, f64::max) as f32;
            }
        });
        zeta
    }

    /// The signature of a query, and that of its other side where no sensor is known.
    fn references(&self, query: usize, flat_atom: f64, frame: &Frame) -> Option<Vec<Vec<f32>>> {
        if self.axes == FitAxes::Sensor {
            return None;
        }
        let [k1, k2] = self.in_patch_units(query);
        // From the other side k1 and k2 change places and signs.
        let sides = [[k1, k2], [-k2, -k1]];
        let sides = if self.oriented { &sides[..1] } else { &sides[..] };
        let mut rows = vec![[0.0; SIGNATURE]; sides.len()];
        frame.signatures_of_curvatures(1.0, sides, &mut rows, &mut vec![Status::Ok; sides.len()]);
        rows.iter().all(|row| row[0].is_finite()).then(|| {
            let reference = |row: &[f32; SIGNATURE]| with_flat_atom(row, flat_atom);
            rows.iter().map(reference).collect()
        })
    }

    /// k1 and k2 of a query where the side of its patch is 1.
    fn in_patch_units(&self, query: usize) -> [f32; 2] {
        let side = 2.0 * self.radius_of(query);
        [self.k1[query], self.k2[query]].map(|k| (f64::from(k) * side) as f32)
    }
}

/// A signature and one more coordinate, the same for all surfaces.
fn with_flat_atom(row: &[f32; SIGNATURE], length: f64) -> Vec<f32> {
    row.iter().copied().chain([length as f32]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ExtractOptions, PointCloud, Radius, extract};

    /// A cylinder of radius 1 beside a plane, with a little noise.
    fn scene() -> Vec<[f64; 3]> {
        let noise =
            |i: u32| 2e-4 * (f64::from(i.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24) - 0.5);
        let cylinder = (0..900_u32).map(|i| (i, 0.05 * f64::from(i % 30) - 0.75, 0.05 * f64::from(i / 30)));
        let cylinder = cylinder.map(|(i, s, y)| [(1.0 + noise(i)) * s.sin(), y, (1.0 + noise(i)) * s.cos()]);
        let plane =
            (0..900_u32).map(|i| [5.0 + 0.05 * f64::from(i % 30), 0.05 * f64::from(i / 30), noise(i)]);
        cylinder.chain(plane).collect()
    }

    #[test]
    fn similarities_are_those_of_signatures_one_by_one_of_the_more_similar_side() {
        let (points, frame) = (scene(), Frame::shared());
        let seen_from = |viewpoint| ExtractOptions { viewpoint, ..Default::default() };
        for viewpoint in [None, Some([2.0, 0.0, 9.0])] {
            let cloud = PointCloud::new_f64(&points);
            let found = extract(&cloud, Radius::new(0.3).unwrap(), &seen_from(viewpoint)).unwrap();
            let flat = found.flat_atom_length(frame).unwrap();
            let zeta = found.similarities(465, flat, frame);
            let signature = |k1: f32, k2: f32| {
                let mut row = frame
                    .signature(&crate::Paraboloid::of_principal_curvatures(k1, k2, 0.6))
                    .unwrap()
                    .to_vec();
                row.push(flat as f32);
                row
            };
            let own = signature(found.k1[465], found.k2[465]);
            for i in (0..points.len()).step_by(37) {
                let same_side = similarity(&own, &signature(found.k1[i], found.k2[i]));
                let other_side = similarity(&own, &signature(-found.k2[i], -found.k1[i]));
                let expected = if viewpoint.is_none() { same_side.max(other_side) } else { same_side };
                assert!((f64::from(zeta[i]) - expected).abs() < 1e-3, "{i}: {} {expected}", zeta[i]);
            }
            assert!(zeta[435] > 0.99 && zeta[900 + 465] < 0.9);
        }
    }

    #[test]
    fn without_a_fit_there_is_neither_a_flat_atom_nor_a_similarity() {
        let found = extract(
            &PointCloud::new(&[[0.0_f32; 3]; 3]),
            Radius::new(1.0).unwrap(),
            &ExtractOptions::default(),
        )
        .unwrap();
        assert_eq!(found.flat_atom_length(Frame::shared()), None);
        assert!(found.similarities(0, 0.0, Frame::shared()).iter().all(|zeta| zeta.is_nan()));
    }
}
