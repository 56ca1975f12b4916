//! Many scans as one map: a point for each voxel, and how many scans saw it.

use crate::voxels::voxel_of;
use crate::{Error, PointCloud, Radius, RigidTransform};
use rustc_hash::FxHashMap;

/// Scans in one frame, thinned to a point for each voxel: the mean of all points that lie in it.
///
/// ```
/// use surfsig::{FusedMap, PointCloud, RigidTransform};
/// let mut map = FusedMap::new(0.5)?;
/// let points = [[0.1_f32, 0.0, 1.0], [0.3, 0.0, 1.0]];
/// map.add(&PointCloud::new(&points), &RigidTransform::identity(), [0.0; 3])?;
/// map.add(&PointCloud::new(&points[..1]), &RigidTransform::identity(), [0.0; 3])?;
/// assert_eq!(map.scans(), [2]);
/// assert!((map.points()[0][0] - 0.5 / 3.0).abs() < 1e-6);
/// # Ok::<(), surfsig::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct FusedMap {
    voxel: f64,
    numbers: FxHashMap<[i64; 3], u32>,
    cells: Vec<Cell>,
    added: u32,
}

/// What is known of a voxel that has points.
#[derive(Debug, Clone)]
struct Cell {
    /// Its first point; the others are summed as differences from it, so that all digits are kept far from 0.
    first: [f64; 3],
    sum: [f64; 3],
    points: u32,
    /// The sum of unit vectors from the points to their sensors.
    to_sensor: [f32; 3],
    scans: u32,
    last_scan: u32,
}

impl FusedMap {
    /// A map without points.
    ///
    /// # Errors
    /// [`Error::InvalidRadius`] if the voxel's edge has no meaning.
    ///
    /// ```
    /// assert!(surfsig::FusedMap::new(0.0).is_err());
    /// ```
    pub fn new(voxel: f64) -> Result<Self, Error> {
        Radius::new(voxel)?;
        Ok(Self { voxel, numbers: FxHashMap::default(), cells: Vec::new(), added: 0 })
    }

    /// Adds a scan's finite points; the viewpoint is in the scan's coordinates.
    ///
    /// # Errors
    /// [`Error::TooManyPoints`] if 2^32 voxels have points.
    ///
    /// ```
    /// use surfsig::{FusedMap, PointCloud, RigidTransform};
    /// let mut map = FusedMap::new(1.0)?;
    /// let shift = RigidTransform::from_rotation_vector([0.0; 3], [5.0, 0.0, 0.0]);
    /// map.add(&PointCloud::new(&[[0.5, 0.5, 0.5]]), &shift, [0.0; 3])?;
    /// assert_eq!(map.points(), [[5.5, 0.5, 0.5]]);
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    #[allow(non_snake_case, reason = "the name says from where to where")]
    pub fn add(
        &mut self,
        scan: &PointCloud<'_>,
        T_map_scan: &RigidTransform,
        viewpoint: [f64; 3],
    ) -> Result<(), Error> {
        let sensor = T_map_scan.transform_point(viewpoint);
        for point in (0..scan.len()).filter_map(|index| scan.position(index)) {
            let point = T_map_scan.transform_point(point);
            let next = self.cells.len();
            let number = *self.numbers.entry(voxel_of(&point, self.voxel)).or_insert(next as u32) as usize;
            if number == next {
                if u32::try_from(next + 1).is_err() {
                    return Err(Error::TooManyPoints(next + 1));
                }
                self.cells.push(Cell {
                    first: point,
                    sum: [0.0; 3],
                    points: 0,
                    to_sensor: [0.0; 3],
                    scans: 0,
                    last_scan: u32::MAX,
                });
            }
            let cell = &mut self.cells[number];
            let ray = [0, 1, 2].map(|k| sensor[k] - point[k]);
            let length = ray.iter().map(|x| x * x).sum::<f64>().sqrt();
            for k in 0..3 {
                cell.sum[k] += point[k] - cell.first[k];
                if length > 0.0 {
                    cell.to_sensor[k] += (ray[k] / length) as f32;
                }
            }
            cell.points = cell.points.saturating_add(1);
            if cell.last_scan != self.added {
                cell.last_scan = self.added;
                cell.scans += 1;
            }
        }
        self.added += 1;
        Ok(())
    }

    /// The mean of the points of each voxel, in the order in which voxels first had one.
    ///
    /// ```
    /// assert!(surfsig::FusedMap::new(1.0)?.points().is_empty());
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn points(&self) -> Vec<[f64; 3]> {
        let mean = |cell: &Cell| [0, 1, 2].map(|k| cell.first[k] + cell.sum[k] / f64::from(cell.points));
        self.cells.iter().map(mean).collect()
    }

    /// Of each voxel how many scans have points in it.
    ///
    /// ```
    /// assert!(surfsig::FusedMap::new(1.0)?.scans().is_empty());
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn scans(&self) -> Vec<u32> {
        self.cells.iter().map(|cell| cell.scans).collect()
    }

    /// Of each voxel the mean direction to the sensors that saw it, of any length.
    ///
    /// ```
    /// use surfsig::{FusedMap, PointCloud, RigidTransform};
    /// let mut map = FusedMap::new(1.0)?;
    /// map.add(&PointCloud::new(&[[0.0, 0.0, 2.0]]), &RigidTransform::identity(), [0.0; 3])?;
    /// assert_eq!(map.directions_to_sensor(), [[0.0, 0.0, -1.0]]);
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn directions_to_sensor(&self) -> Vec<[f32; 3]> {
        self.cells.iter().map(|cell| cell.to_sensor).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(i: usize) -> f64 {
        (i as f64 * 12.9898).sin()
    }

    #[test]
    #[allow(non_snake_case, reason = "the name says from where to where")]
    fn voxels_have_the_means_and_scans_of_a_slow_count() {
        let scans: Vec<Vec<[f64; 3]>> = (0..4)
            .map(|s| (0..300).map(|i| [0, 1, 2].map(|k| 4.0 * number(1000 * s + 3 * i + k))).collect())
            .collect();
        let T_map_scan: Vec<RigidTransform> = (0..4)
            .map(|s| RigidTransform::from_rotation_vector([0.1 * s as f64, 0.2, 0.0], [1e6, s as f64, 0.0]))
            .collect();
        let mut map = FusedMap::new(1.5).unwrap();
        let mut slow = std::collections::BTreeMap::<[i64; 3], Vec<(usize, [f64; 3])>>::new();
        for (s, (scan, transform)) in scans.iter().zip(&T_map_scan).enumerate() {
            map.add(&PointCloud::new_f64(scan), transform, [0.0; 3]).unwrap();
            for &point in scan {
                let moved = transform.transform_point(point);
                slow.entry(moved.map(|x| (x / 1.5).floor() as i64)).or_default().push((s, moved));
            }
        }
        assert_eq!(map.points().len(), slow.len());
        for (point, seen) in map.points().iter().zip(map.scans()) {
            let inside = &slow[&voxel_of(point, 1.5)];
            let of_scans: std::collections::BTreeSet<usize> = inside.iter().map(|(s, _)| *s).collect();
            assert_eq!(seen as usize, of_scans.len());
            for k in 0..3 {
                let mean = inside.iter().map(|(_, point)| point[k]).sum::<f64>() / inside.len() as f64;
                assert!((point[k] - mean).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn what_is_not_finite_is_left_out() {
        let mut map = FusedMap::new(1.0).unwrap();
        let points = [[f64::NAN, 0.0, 0.0], [0.5, 0.5, 0.5], [f64::INFINITY, 0.0, 0.0]];
        map.add(&PointCloud::new_f64(&points), &RigidTransform::identity(), [0.0; 3]).unwrap();
        assert_eq!(map.points(), [[0.5, 0.5, 0.5]]);
    }
}
