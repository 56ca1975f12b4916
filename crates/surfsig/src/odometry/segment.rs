//! A part of a sequence that one map holds, with lengths of its own.

use super::deskewing::{MeasuredScan, MotionWithin};
use super::pose_covariance::Covariance;
use super::result::{LoopClosure, ScanPose, ScanStatus};
use super::scale::Scale;
use super::settings::OdometrySettings;
use super::thinned_scan::ThinnedScan;
use super::tracker::{LEAST_OPEN, Loop, Step, Tracker};
use crate::RigidTransform;
use crate::alignment::{FreeDirection, infinite_along, motions_beyond};
use nalgebra::{Matrix6, Vector6};

/// Voxels from the sensor beyond which no point is measured; they are numbered with 32 bits.
const FARTHEST: f64 = 1e9;

/// A map with its tracker. Lengths are in the scans' unit, but for what the tracker gives.
#[allow(non_snake_case)]
pub(super) struct Segment {
    /// Of the world that poses are given in: segments that are joined have the same.
    pub number: usize,
    /// The scan whose frame is that of the world.
    pub origin: usize,
    /// The map's first scan.
    pub first: usize,
    /// From the map, whose axes are those of its first scan about its sensor, to those of the world's first scan.
    pub T_world_map: RigidTransform,
    /// Of the twist in the map's axes by which `T_world_map` is off.
    pub covariance: Covariance,
    pub scale: Scale,
    pub tracker: Tracker,
    /// Scans with a pose, one after the other.
    pub tracked: usize,
}

impl Segment {
    /// Begins a map with a scan's points about its sensor.
    pub fn new(number: usize, first: usize, points: &[[f64; 3]], settings: &OdometrySettings) -> Self {
        let scale = Scale::new(points, settings.voxel, &settings.scale);
        Self {
            number,
            origin: first,
            first,
            T_world_map: RigidTransform::identity(),
            covariance: Covariance::zeros(),
            tracker: Tracker::new(settings, &scale),
            scale,
            tracked: 0,
        }
    }

    /// A scan as this map takes it; `None` where too little of it is left.
    pub fn thinned(&self, scan: &MeasuredScan, settings: &OdometrySettings) -> Option<ThinnedScan> {
        self.thinned_with(scan, self.tracker.expected_within(), settings)
    }

    /// The same with another motion within the scan, in voxels.
    pub fn thinned_with(
        &self,
        scan: &MeasuredScan,
        within: MotionWithin,
        settings: &OdometrySettings,
    ) -> Option<ThinnedScan> {
        let per_voxel = 1.0 / self.scale.voxel;
        let is_near = |point: &[f64; 3]| point.iter().all(|c| c.abs() * per_voxel < FARTHEST);
        let near: Vec<bool> = scan.points.iter().map(is_near).collect();
        let points = scan.points.iter().zip(&near).filter(|(_, near)| **near);
        let times = scan
            .times
            .as_ref()
            .map(|times| times.iter().zip(&near).filter(|(_, near)| **near).map(|(time, _)| *time).collect());
        let points = points.map(|(point, _)| point.map(|c| c * per_voxel)).collect();
        let scan = ThinnedScan::new(MeasuredScan { points, times }, within, settings);
        // A sparse scan has voxels for a share of its points.
        let least = settings.scale.largest_filled_share * settings.scale.min_points as f64;
        (scan.points.len() as f64 >= least).then_some(scan)
    }

    /// Whether a scan fills far fewer or far more voxels than it should.
    pub fn is_unfit(&self, scan: Option<&ThinnedScan>, points: usize, settings: &OdometrySettings) -> bool {
        let filled = scan.map_or(0, |scan| scan.points.len()) as f64;
        let wanted = settings.scale.wanted(points);
        settings.voxel.is_none()
            && (filled < settings.segments.least_filled * wanted
                || filled > settings.segments.most_filled * settings.scale.voxels_of_scan)
    }

    /// Takes the next scan, or passes over it.
    pub fn follow(&mut self, scan: Option<&ThinnedScan>) -> Vec<Step> {
        let steps = match scan {
            Some(scan) => self.tracker.follow(scan),
            None => {
                self.tracker.skip();
                Vec::new()
            }
        };
        self.tracked = if steps.is_empty() { 0 } else { self.tracked + 1 };
        steps
    }

    /// A scan's pose in the world, about its sensor, and what it is off by, in its axes.
    pub fn in_world(&self, step: &Step) -> (RigidTransform, Covariance) {
        let mut pose = step.T_map_scan;
        pose.translation *= self.scale.voxel;
        let of_map = self.covariance.carried(&pose.inverse());
        (self.T_world_map * pose, step.covariance.scaled(self.scale.voxel).and(&of_map))
    }

    /// The scan of the keyframe next to a pose in the world, and its pose there, about its sensor.
    pub fn keyframe_next_to(&self, pose: &RigidTransform) -> Option<(usize, RigidTransform)> {
        let mut in_map = self.T_world_map.inverse() * *pose;
        in_map.translation /= self.scale.voxel;
        let (number, mut of_keyframe) = self.tracker.keyframe_next_to(&in_map)?;
        of_keyframe.translation *= self.scale.voxel;
        Some((self.first + number, self.T_world_map * of_keyframe))
    }

    /// The loops that the last scan has closed.
    pub fn take_loops(&mut self) -> Vec<FoundLoop> {
        let in_unit = |mut transform: RigidTransform| {
            transform.translation *= self.scale.voxel;
            transform
        };
        let found = |one: Loop| FoundLoop {
            scan: self.first + one.scan,
            earlier: self.first + one.earlier,
            origin: self.origin,
            T_earlier_scan: in_unit(one.T_earlier_scan),
            T_world_scan_before: self.T_world_map * in_unit(one.T_map_scan_before),
        };
        self.tracker.take_loops().into_iter().map(found).collect()
    }

    /// What a step says.
    pub fn found(&self, step: &Step) -> FoundPose {
        let (pose, covariance) = self.in_world(step);
        FoundPose {
            scan: self.first + step.number,
            segment: self.number,
            origin: self.origin,
            T_world_sensor: pose,
            covariance,
            free_directions: step.free_directions.clone(),
            status: step.status,
            overlap: step.overlap,
            voxel: self.scale.voxel,
            unit: self.scale.median_range,
            twist: step.twist.map(|twist| {
                Vector6::from_fn(|k, _| if k < 3 { twist[k] } else { twist[k] * self.scale.voxel })
            }),
        }
    }
}

/// A scan that lies on what an earlier one saw: poses about their sensors, in the scans' unit.
#[allow(non_snake_case)]
pub(super) struct FoundLoop {
    pub scan: usize,
    pub earlier: usize,
    /// The scan whose frame is the world's.
    pub origin: usize,
    pub T_earlier_scan: RigidTransform,
    pub T_world_scan_before: RigidTransform,
}

impl FoundLoop {
    /// From the sensors' axes to the scans' own frames.
    pub fn in_frames(&self, sensors: &[[f64; 3]]) -> LoopClosure {
        let to = |scan: usize| RigidTransform::from_rotation_vector([0.0; 3], sensors[scan]);
        let from_sensor = to(self.scan).inverse();
        LoopClosure {
            scan: self.scan,
            earlier: self.earlier,
            T_earlier_scan: to(self.earlier) * self.T_earlier_scan * from_sensor,
            T_map_scan_before: to(self.origin) * self.T_world_scan_before * from_sensor,
        }
    }
}

/// A scan's pose about its sensor, in the scans' unit, but for free directions, which are in voxels.
#[allow(non_snake_case)]
pub(super) struct FoundPose {
    pub scan: usize,
    pub segment: usize,
    /// The scan whose frame is the world's.
    pub origin: usize,
    /// In the axes of the world's first sensor.
    pub T_world_sensor: RigidTransform,
    /// In the sensor's axes.
    pub covariance: Covariance,
    pub free_directions: Vec<FreeDirection>,
    pub status: ScanStatus,
    pub overlap: f64,
    pub voxel: f64,
    /// The length by which a rotation moves points.
    pub unit: f64,
    /// From scan to scan, in the sensor's axes.
    pub twist: Option<Vector6<f64>>,
}

impl FoundPose {
    /// From the sensor's axes to the scan's own frame, and from those of the world's first sensor to that scan's, by
    /// where sensors are in the frames of their scans.
    pub fn in_frames(&self, sensors: &[[f64; 3]]) -> ScanPose {
        let to = |translation: [f64; 3]| RigidTransform::from_rotation_vector([0.0; 3], translation);
        let (pose, of_pose) = (self.T_world_sensor, &self.covariance);
        let (voxel, unit) = (self.voxel, self.unit);
        let from_sensor = to(sensors[self.scan]);
        // A twist about the sensor as one in the scan's frame.
        let adjoint = from_sensor.adjoint();
        let carried = Matrix6::from_fn(|i, j| adjoint[i][j]);
        let both = of_pose.random + of_pose.systematic;
        let open: Vec<Vector6<f64>> = motions_beyond(&of_pose.open, LEAST_OPEN * voxel, unit)
            .iter()
            .map(|motion| carried * motion)
            .collect();
        let covariance = infinite_along(&(carried * both * carried.transpose()), &open, unit);
        let in_unit = |direction: &FreeDirection| match *direction {
            FreeDirection::Translation { axis } => FreeDirection::Translation { axis },
            FreeDirection::Rotation { axis, point } => {
                FreeDirection::Rotation { axis, point: point.map(|c| c * voxel) }
            }
            FreeDirection::RotationAboutPoint { point } => {
                FreeDirection::RotationAboutPoint { point: point.map(|c| c * voxel) }
            }
        };
        let free = self.free_directions.iter().map(|direction| in_unit(direction).transformed(&from_sensor));
        ScanPose {
            scan: self.scan,
            segment: self.segment,
            T_map_scan: Some(to(sensors[self.origin]) * pose * from_sensor.inverse()),
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i, j)])),
            free_directions: free.collect(),
            status: self.status,
            overlap: self.overlap,
            twist: self.twist.map(|twist| (carried * twist).into()),
        }
    }
}
