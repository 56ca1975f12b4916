//! What both sensors would have seen: points of one scan where the other's sensor looked through.

use super::settings::FreeSpaceSettings;
use crate::geometry::RigidTransform;
use crate::scan::CenteredScan;
use crate::visibility::{RangeImageSettings, SphericalRangeImage, Visibility, all_seen_from};

/// What two sensors saw, as far as is known from where they saw all of their scans, and some points of both.
#[derive(Clone)]
pub(super) struct BothSensors<'a> {
    of_source: Option<SensorView>,
    of_target: Option<SensorView>,
    source: &'a [[f64; 3]],
    target: &'a [[f64; 3]],
    settings: FreeSpaceSettings,
}

impl<'a> BothSensors<'a> {
    /// Takes both scans, each with points that are spread evenly over it, and the distance between these.
    pub fn new(
        [source, target]: [&CenteredScan; 2],
        samples: [&'a [[f64; 3]]; 2],
        voxel: f64,
        settings: FreeSpaceSettings,
    ) -> Self {
        Self {
            of_source: SensorView::new(source, samples[0], voxel, &settings),
            of_target: SensorView::new(target, samples[1], voxel, &settings),
            source: samples[0],
            target: samples[1],
            settings,
        }
    }

    /// The same sensors with other points, of which so many must be in sight.
    pub fn with_points(&self, source: &'a [[f64; 3]], target: &'a [[f64; 3]], min_points: usize) -> Self {
        Self { source, target, settings: FreeSpaceSettings { min_points, ..self.settings }, ..self.clone() }
    }

    /// Where both sensors stood, if it is known of both.
    pub fn viewpoints(&self) -> Option<[[f64; 3]; 2]> {
        Some([self.of_source.as_ref()?.viewpoint, self.of_target.as_ref()?.viewpoint])
    }

    /// Whether a point is behind what the target's sensor saw: what lies there it cannot have measured.
    pub fn is_hidden_from_target(&self, point: [f64; 3]) -> bool {
        self.of_target.as_ref().is_some_and(|view| view.is_hidden(point))
    }

    /// The larger share of points of one scan that lie in the other sensor's free space, of those that it would have
    /// measured; NaN where neither sensor can tell.
    #[allow(non_snake_case)]
    pub fn free_space(&self, T_target_source: &RigidTransform) -> f64 {
        let share = |view: &Option<SensorView>, points: &[[f64; 3]], to_scan: &RigidTransform| {
            view.as_ref().map_or(f64::NAN, |view| view.free_space(points, to_scan, self.settings.min_points))
        };
        let in_source = share(&self.of_source, self.target, &T_target_source.inverse());
        let in_target = share(&self.of_target, self.source, T_target_source);
        // The larger one, or the one that is known.
        in_source.max(in_target)
    }
}

/// What a sensor saw that has seen all points of its scan.
#[derive(Clone)]
struct SensorView {
    viewpoint: [f64; 3],
    image: SphericalRangeImage,
}

impl SensorView {
    /// `None` where no viewpoint is known, or it cannot have seen all: scans that were fused from several views.
    fn new(
        scan: &CenteredScan,
        sample: &[[f64; 3]],
        voxel: f64,
        settings: &FreeSpaceSettings,
    ) -> Option<Self> {
        let viewpoint = scan.viewpoint.filter(|&viewpoint| all_seen_from(viewpoint, sample, voxel))?;
        let about = |point: &[f64; 3]| std::array::from_fn(|k| point[k] - viewpoint[k]);
        let seen: Vec<[f64; 3]> = scan.points.iter().map(about).collect();
        let image = RangeImageSettings {
            pixel: settings.pixel,
            margin: settings.margin * voxel,
            relative_margin: settings.relative_margin,
        };
        Some(Self { viewpoint, image: SphericalRangeImage::new(&seen, image) })
    }

    fn is_hidden(&self, point: [f64; 3]) -> bool {
        let from_viewpoint = std::array::from_fn(|k| point[k] - self.viewpoint[k]);
        self.image.visibility(from_viewpoint) == Visibility::Hidden
    }

    /// The share of points in free space, of those that the sensor would have measured; NaN where these are few.
    fn free_space(&self, points: &[[f64; 3]], to_scan: &RigidTransform, min_points: usize) -> f64 {
        let from_viewpoint = |point: &[f64; 3]| {
            let moved = to_scan.transform_point(*point);
            std::array::from_fn(|k| moved[k] - self.viewpoint[k])
        };
        let (free, in_sight) = self.image.free_space_counts(points.iter().map(from_viewpoint));
        if in_sight < min_points { f64::NAN } else { free as f64 / in_sight as f64 }
    }
}
