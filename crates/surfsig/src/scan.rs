//! A scan: points, and what says on which side of their surface the sensor was.

use crate::PointCloud;
use crate::statistics::median;
use crate::voxels::Voxels;
use nalgebra::Vector3;

/// A point cloud with what is known of the sensor.
///
/// ```
/// use surfsig::{PointCloud, Scan};
/// let points = [[0.0_f32, 0.0, 1.0]];
/// let scan = Scan::new(PointCloud::new(&points)).seen_from([0.0; 3]);
/// assert!(scan.is_oriented());
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Scan<'a> {
    /// The points.
    pub cloud: PointCloud<'a>,
    /// Where the sensor stood, in the cloud's coordinates.
    pub viewpoint: Option<[f64; 3]>,
    /// In place of a viewpoint: for each point a vector to the side from which it was seen, of any length.
    pub directions: Option<&'a [[f32; 3]]>,
}

impl<'a> Scan<'a> {
    /// Points of which nobody knows from where they were seen.
    ///
    /// ```
    /// assert!(!surfsig::Scan::new(surfsig::PointCloud::new(&[])).is_oriented());
    /// ```
    pub fn new(cloud: PointCloud<'a>) -> Self {
        Self { cloud, viewpoint: None, directions: None }
    }

    /// All points were seen from one place.
    ///
    /// ```
    /// let scan = surfsig::Scan::new(surfsig::PointCloud::new(&[])).seen_from([1.0, 2.0, 3.0]);
    /// assert_eq!(scan.viewpoint, Some([1.0, 2.0, 3.0]));
    /// ```
    #[must_use]
    pub fn seen_from(self, viewpoint: [f64; 3]) -> Self {
        Self { viewpoint: Some(viewpoint), ..self }
    }

    /// Each point has a vector to its own side.
    ///
    /// ```
    /// let points = [[0.0_f32; 3]];
    /// let scan = surfsig::Scan::new(surfsig::PointCloud::new(&points)).facing(&[[0.0, 0.0, 1.0]]);
    /// assert!(scan.is_oriented());
    /// ```
    #[must_use]
    pub fn facing(self, directions: &'a [[f32; 3]]) -> Self {
        Self { directions: Some(directions), ..self }
    }

    /// Whether anything says on which side the sensor was.
    pub fn is_oriented(&self) -> bool {
        self.viewpoint.is_some() || self.directions.is_some()
    }
}

/// From the middle of a scan, in any unit: what is farther counts as not finite, so that products of four coordinates
/// are.
const FARTHEST: f64 = 1e70;

/// A scan's finite points about their middle: all digits are kept, wherever the scan lies.
#[derive(Debug, Clone)]
pub(crate) struct CenteredScan {
    pub points: Vec<[f64; 3]>,
    /// Numbers of the points in the scan that was given; none after thinning.
    pub numbers: Vec<usize>,
    /// In the scan's coordinates: the median of each coordinate.
    pub center: [f64; 3],
    /// About the centre, as the points.
    pub viewpoint: Option<[f64; 3]>,
    /// One for each of the points.
    pub directions: Option<Vec<[f32; 3]>>,
}

impl CenteredScan {
    pub fn new(scan: &Scan<'_>) -> Self {
        let finite = (0..scan.cloud.len()).filter_map(|i| Some((i, scan.cloud.position(i)?)));
        let finite: Vec<(usize, [f64; 3])> = finite.collect();
        let center =
            [0, 1, 2].map(|k| median(finite.iter().map(|(_, point)| point[k]).collect()).unwrap_or(0.0));
        let about = |point: [f64; 3]| [0, 1, 2].map(|k| point[k] - center[k]);
        let is_near = |point: [f64; 3]| about(point).iter().all(|x| x.abs() <= FARTHEST);
        let near = || finite.iter().filter(|(_, point)| is_near(*point));
        Self {
            points: near().map(|(_, point)| about(*point)).collect(),
            numbers: near().map(|(i, _)| *i).collect(),
            center,
            viewpoint: scan.viewpoint.map(about),
            directions: scan.directions.map(|all| near().map(|(i, _)| all[*i]).collect()),
        }
    }

    /// The median distance of the points from their centre: a size that outliers do not change.
    pub fn size(&self) -> f64 {
        let distances = self.points.iter().map(|point| point.iter().map(|x| x * x).sum::<f64>().sqrt());
        median(distances.collect()).unwrap_or(0.0)
    }

    /// The same scan with one point for each voxel, the mean of those in it; directions are added up.
    pub fn thinned(&self, voxel: f64) -> Self {
        let voxels = Voxels::new(&self.points, voxel);
        let sum_of = |directions: &Vec<[f32; 3]>| -> Vec<[f32; 3]> {
            let unit = |v: &[f32; 3]| {
                let v = Vector3::from(v.map(f64::from));
                v.try_normalize(0.0).unwrap_or_default().into()
            };
            voxels.sums(directions.iter().map(unit)).into_iter().map(|sum| sum.map(|x| x as f32)).collect()
        };
        Self {
            points: voxels.means(&self.points),
            numbers: Vec::new(),
            directions: self.directions.as_ref().map(sum_of),
            ..*self
        }
    }

    /// The same scan with the sign of x changed: its axes are left-handed then.
    pub fn mirrored(&self) -> Self {
        let mirror = |[x, y, z]: [f64; 3]| [-x, y, z];
        let mirror_direction = |[x, y, z]: [f32; 3]| [-x, y, z];
        Self {
            points: self.points.iter().map(|&point| mirror(point)).collect(),
            numbers: self.numbers.clone(),
            center: mirror(self.center),
            viewpoint: self.viewpoint.map(mirror),
            directions: self
                .directions
                .as_ref()
                .map(|all| all.iter().map(|&direction| mirror_direction(direction)).collect()),
        }
    }

    /// Those of the points that are wanted.
    pub fn some(&self, is_wanted: impl Fn(&[f64; 3]) -> bool) -> Self {
        let chosen: Vec<usize> = (0..self.points.len()).filter(|&i| is_wanted(&self.points[i])).collect();
        Self {
            points: chosen.iter().map(|&i| self.points[i]).collect(),
            numbers: chosen.iter().filter_map(|&i| self.numbers.get(i).copied()).collect(),
            directions: self.directions.as_ref().map(|all| chosen.iter().map(|&i| all[i]).collect()),
            ..*self
        }
    }

    pub fn scan(&self) -> Scan<'_> {
        Scan {
            cloud: PointCloud::new_f64(&self.points),
            viewpoint: self.viewpoint,
            directions: self.directions.as_deref(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_far_away_is_the_same_scan_about_its_centre() {
        let points = [[0.5_f32, 1.0, 2.0], [f32::NAN, 0.0, 0.0], [1.5, 3.0, 1.0], [2.5, 2.0, 0.0]];
        let directions = [[1.0, 0.0, 0.0], [9.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let near = Scan::new(PointCloud::new(&points)).facing(&directions);
        let far = Scan { cloud: near.cloud.with_origin([4e6, 5e6, 100.0]), ..near };
        let [near, far] = [near, far].map(|scan| CenteredScan::new(&scan));
        assert_eq!(near.points, far.points);
        assert_eq!(near.center, [1.5, 2.0, 1.0]);
        assert_eq!(near.directions.unwrap(), [directions[0], directions[2], directions[3]]);
        assert_eq!(far.center, [4e6 + 1.5, 5e6 + 2.0, 101.0]);
        let odd = [[0.0; 3], [1.0; 3], [2.0; 3], [1e300, 0.0, 0.0], [f64::MIN, f64::MAX, 0.0]];
        let odd = CenteredScan::new(&Scan::new(PointCloud::new_f64(&odd)));
        assert_eq!((odd.points.len(), odd.size().is_finite()), (3, true));
    }
}
