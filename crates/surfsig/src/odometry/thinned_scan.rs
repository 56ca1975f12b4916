//! A scan as it is aligned: thinned, about its sensor, in voxels.

use super::deskewing::{MeasuredScan, MotionWithin, deskewed};
use super::scale::{distances, median_point};
use super::settings::OdometrySettings;
use crate::Scan;
use crate::alignment::GicpCloud;
use crate::statistics::median;
use crate::visibility::SphericalRangeImage;
use crate::voxels::{Voxels, voxel_means};
use nalgebra::Vector6;

/// Coordinates beyond which the square of a distance leaves float64.
const FARTHEST: f64 = 1e150;

/// The points of a scan about its sensor; lengths are in voxels.
#[derive(Clone)]
pub(super) struct ThinnedScan {
    /// All of them, deskewed where their times are known.
    measured: Vec<[f64; 3]>,
    /// The mean of each voxel's points.
    pub points: Vec<[f64; 3]>,
    /// What GICP takes: the means of coarser voxels.
    pub coarse: GicpCloud,
    /// Some of these, for the first round.
    pub few: GicpCloud,
    /// How far the sensor saw.
    pub range_image: SphericalRangeImage,
    /// With the mean time of each voxel's points, where these are known.
    pub motion: Option<MotionWithin>,
    /// What was measured, where a scan may be deskewed anew.
    raw: Option<MeasuredScan>,
}

impl ThinnedScan {
    /// `expected` is the motion within the scan, in which times are not looked at.
    pub fn new(scan: MeasuredScan, expected: MotionWithin, settings: &OdometrySettings) -> Self {
        let Some(times) = &scan.times else { return Self::of_one_moment(scan.points, settings) };
        let measured = deskewed(&scan.points, times, &expected.twist);
        let voxels = Voxels::new(&measured, 1.0);
        let sums = voxels.sums(times.iter().map(|time| [*time, 0.0, 0.0]));
        // Where a voxel has points of several times, their mean moves with the mean of these.
        let times = sums.iter().zip(&voxels.counts).map(|(sum, count)| sum[0] / f64::from(*count)).collect();
        let motion = MotionWithin { times, ..expected };
        Self::of_points(measured, Some(motion), Some(scan), settings)
    }

    /// Of points about the sensor that were measured at one time.
    pub fn of_one_moment(points: Vec<[f64; 3]>, settings: &OdometrySettings) -> Self {
        Self::of_points(points, None, None, settings)
    }

    fn of_points(
        measured: Vec<[f64; 3]>,
        motion: Option<MotionWithin>,
        raw: Option<MeasuredScan>,
        settings: &OdometrySettings,
    ) -> Self {
        let points = voxel_means(&measured, 1.0);
        let coarse = GicpCloud::new(voxel_means(&points, settings.alignment.coarse_voxel));
        let few = coarse.sample(settings.alignment.first_points);
        let range_image = SphericalRangeImage::new(&points, settings.range_image);
        Self { measured, points, coarse, few, range_image, motion, raw }
    }

    /// The same scan with another motion within; `None` where no times are known.
    pub fn deskewed_anew(&self, twist: Vector6<f64>, settings: &OdometrySettings) -> Option<Self> {
        let motion = MotionWithin { times: Vec::new(), twist, ..self.motion.clone()? };
        Some(Self::new(self.raw.clone()?, motion, settings))
    }

    /// The means of other voxels.
    pub fn means(&self, edge: f64) -> Vec<[f64; 3]> {
        voxel_means(&self.measured, edge)
    }
}

/// Where the sensor is in the frames of its scans.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SensorPosition {
    /// What stands for it in all scans, where viewpoints cannot be meant; decided by the first scan with points.
    substitute: Option<Option<[f64; 3]>>,
}

impl SensorPosition {
    /// A scan's points about its sensor, with their times, and the sensor's position in the scan's frame: the viewpoint,
    /// or 0.
    ///
    /// In the coordinates of a map that is far from all points (a PCD's viewpoint is 0 where nobody set it), and the
    /// median of the first scan stands for it.
    pub fn about_sensor(
        &mut self,
        scan: &Scan<'_>,
        times: Option<&[f64]>,
        farthest_viewpoint: f64,
    ) -> (MeasuredScan, [f64; 3]) {
        let Scan { cloud, viewpoint, .. } = scan;
        let viewpoint = viewpoint.filter(|at| at.iter().all(|c| c.abs() < FARTHEST)).unwrap_or([0.0; 3]);
        // Offsets from the origin lose nothing where both are large.
        let offsets = cloud.with_origin([0.0; 3]);
        let is_known = |point: &[f64; 3]| point.iter().all(|c| c.abs() < FARTHEST);
        let known = |index: usize| offsets.position(index).filter(is_known).map(|point| (index, point));
        let (numbers, mut points): (Vec<usize>, Vec<[f64; 3]>) = (0..cloud.len()).filter_map(known).unzip();
        let times = times.map(|times| numbers.iter().map(|number| times[*number]).collect());
        let from = |sensor: [f64; 3]| [0, 1, 2].map(|k| cloud.origin[k] - sensor[k]);
        if self.substitute.is_none() && !points.is_empty() {
            let middle = median_point(&points);
            let spread = median(distances(&points, middle)).unwrap_or(0.0);
            let offset = from(viewpoint);
            let away = (0..3).map(|k| (middle[k] + offset[k]).powi(2)).sum::<f64>().sqrt();
            let is_far = away > farthest_viewpoint * spread;
            self.substitute = Some(is_far.then(|| [0, 1, 2].map(|k| middle[k] + cloud.origin[k])));
        }
        let sensor = self.substitute.flatten().unwrap_or(viewpoint);
        let offset = from(sensor);
        for point in &mut points {
            for k in 0..3 {
                point[k] += offset[k];
            }
        }
        (MeasuredScan { points, times }, sensor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PointCloud;

    fn around(middle: [f64; 3]) -> Vec<[f64; 3]> {
        (0..27).map(|i| [0, 1, 2].map(|k| middle[k] + f64::from(i / 3_i32.pow(k as u32) % 3) - 1.0)).collect()
    }

    #[test]
    fn points_are_about_the_viewpoint_at_any_origin() {
        let points = around([3.0, 0.0, 1.0]);
        let cloud = PointCloud::new_f64(&points).with_origin([5e5, 5e6, 100.0]);
        let viewpoint = [5e5 + 1.0, 5e6, 100.0];
        let (found, sensor) =
            SensorPosition::default().about_sensor(&Scan::new(cloud).seen_from(viewpoint), None, 30.0);
        assert_eq!(sensor, viewpoint);
        assert_eq!(found.points, around([2.0, 0.0, 1.0]));
    }

    #[test]
    fn where_the_viewpoint_is_far_from_all_points_the_first_scan_s_median_stands_for_it() {
        let points = around([0.0; 3]);
        let mut position = SensorPosition::default();
        let empty = PointCloud::new_f64(&[]);
        assert_eq!(position.about_sensor(&Scan::new(empty), None, 30.0).1, [0.0; 3]);
        let far = PointCloud::new_f64(&points).with_origin([5e5, 0.0, 0.0]);
        let (found, sensor) = position.about_sensor(&Scan::new(far), None, 30.0);
        assert_eq!((found.points, sensor), (points.clone(), [5e5, 0.0, 0.0]));
        // And so it does for the next one.
        let next = far.with_origin([5e5 + 2.0, 0.0, 0.0]);
        let (found, sensor) = position.about_sensor(&Scan::new(next).seen_from([0.0; 3]), None, 30.0);
        assert_eq!((found.points, sensor), (around([2.0, 0.0, 0.0]), [5e5, 0.0, 0.0]));
    }

    #[test]
    fn points_without_a_position_are_left_out() {
        let points = [vec![[f64::NAN, 0.0, 0.0], [1e200, 0.0, 0.0]], around([3.0, 0.0, 1.0])].concat();
        let cloud = PointCloud::new_f64(&points);
        let (found, _) = SensorPosition::default().about_sensor(&Scan::new(cloud), None, 30.0);
        assert_eq!(found.points, points[2..]);
    }
}
