//! A piece of a scan as poses are searched and judged by it: thinned points with normals, their pairs, and what the
//! sensor saw around the piece.

use super::RecurrenceSettings;
use super::point_pairs::PointPairs;
use crate::depth_image::{DepthImage, SurfacePlace};
use crate::random::Generator;
use crate::{Error, PointCloud, Radius, voxel_representatives};
use nalgebra::Vector3;

/// A scan whose pieces are compared.
///
/// ```
/// use surfsig::OrientedScan;
/// let (points, normals) = ([[0.0; 3]], [[0.0, 0.0, 1.0]]);
/// let scan = OrientedScan { points: &points, normals: &normals, spacing: 1.0, tolerance: 0.4 };
/// assert_eq!(scan.points.len(), scan.normals.len());
/// ```
#[derive(Debug, Clone, Copy)]
pub struct OrientedScan<'a> {
    /// All points.
    pub points: &'a [[f64; 3]],
    /// Their unit normals, towards the sensor.
    pub normals: &'a [[f64; 3]],
    /// Distance between points.
    pub spacing: f64,
    /// Distance within which a point is on a surface: several standard deviations of the noise.
    pub tolerance: f64,
}

/// From where a piece was seen, and what supports it; in the coordinates of its scan.
///
/// ```
/// let seen = surfsig::PieceSituation { viewpoint: [0.0, 0.0, 10.0], ..Default::default() };
/// assert!(seen.second_viewpoint.is_none() && seen.support_planes.is_empty());
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PieceSituation {
    /// Where the sensor stood.
    pub viewpoint: [f64; 3],
    /// From where else points had to be seen to be measured, as by the camera of a triangulation scanner.
    pub second_viewpoint: Option<[f64; 3]>,
    /// A point and the unit normal of each plane that supports the piece, which is on the normal's side.
    pub support_planes: Vec<[[f64; 3]; 2]>,
}

/// A piece of a scan, seen from one side; what poses between pieces are searched and judged by.
///
/// Coordinates of poses are about its [`PieceView::center`].
///
/// ```
/// use surfsig::{OrientedScan, PieceSituation, PieceView, RecurrenceSettings};
///
/// // A square of 20 points by 20, of which the left half is the piece.
/// let points: Vec<[f64; 3]> = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
/// let normals = vec![[0.0, 0.0, 1.0]; 400];
/// let piece: Vec<usize> = (0..400).filter(|i| i % 20 < 10).collect();
/// let scan = OrientedScan { points: &points, normals: &normals, spacing: 1.0, tolerance: 0.4 };
/// let seen = PieceSituation { viewpoint: [10.0, 10.0, 1000.0], ..Default::default() };
/// let view = PieceView::new(&scan, &piece, &seen, 1.0, &RecurrenceSettings::default())?;
/// assert_eq!(view.center(), [4.5, 9.5, 0.0]);
/// # Ok::<(), surfsig::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct PieceView {
    /// Thinned evenly, in a random order: the first ones are spread over all of the piece.
    pub(super) points: Vec<SurfacePlace>,
    pub(super) pairs: PointPairs,
    /// What the sensor saw of the piece and around it.
    pub(super) image: DepthImage,
    center: [f64; 3],
    /// Largest distance of the piece's points from the centre.
    pub(super) extent: f64,
    pub(super) tolerance: f32,
    /// Distance between `points`.
    pub(super) voxel: f64,
}

impl PieceView {
    /// Prepares the piece with these numbers of a scan's points.
    ///
    /// `pair_unit` is the distance that counts as much as a radian where pairs of points are compared; pieces that are
    /// compared have the same.
    ///
    /// # Errors
    /// [`Error::InvalidLength`] for a spacing, tolerance, unit, or distance to a viewpoint that is none, and for a piece
    /// without extent or with coordinates that are not finite; [`Error::DirectionsMismatch`],
    /// [`Error::IndexOutOfRange`]; [`Error::RadiusBelowResolution`] for a spacing far too small.
    pub fn new(
        scan: &OrientedScan<'_>,
        piece: &[usize],
        situation: &PieceSituation,
        pair_unit: f64,
        settings: &RecurrenceSettings,
    ) -> Result<Self, Error> {
        let (points, normals) = (scan.points, scan.normals);
        if normals.len() != points.len() {
            return Err(Error::DirectionsMismatch { directions: normals.len(), queries: points.len() });
        }
        if let Some(&index) = piece.iter().find(|&&index| index >= points.len()) {
            return Err(Error::IndexOutOfRange { index, len: points.len() });
        }
        let sum = piece.iter().map(|&i| Vector3::from(points[i])).sum::<Vector3<f64>>();
        let center = sum / piece.len().max(1) as f64;
        let from_center = |point: [f64; 3]| Vector3::from(point) - center;
        let local: Vec<[f64; 3]> = piece.iter().map(|&i| from_center(points[i]).into()).collect();
        let is_finite = local.as_flattened().iter().all(|x| x.is_finite());
        let farthest = local.iter().map(|&point| Vector3::from(point).norm()).fold(0.0, f64::max);
        let extent = if is_finite { farthest } else { f64::NAN };
        let to_viewpoint = from_center(situation.viewpoint);
        let to_second = situation.second_viewpoint.map(from_center);
        for (name, length) in [
            ("the spacing of points", scan.spacing),
            ("the tolerance of distances", scan.tolerance),
            ("the unit of pairs", pair_unit),
            ("the extent of a piece", extent),
            ("the distance to the viewpoint", to_viewpoint.norm()),
            ("the distance to the second viewpoint", to_second.map_or(1.0, |to_second| to_second.norm())),
        ] {
            if !(length > 0.0 && length.is_finite()) {
                return Err(Error::InvalidLength { name, length });
            }
        }
        let surface = |number: usize| SurfacePlace {
            place: from_center(points[number]).map(|x| x as f32).into(),
            normal: normals[number].map(|x| x as f32),
        };
        let voxel = settings.spacings_per_voxel * scan.spacing;
        let mut judged = thinned(&local, voxel)?;
        Generator::new(&[piece.len() as u64]).shuffled(&mut judged, usize::MAX);
        let paired = thinned(&local, extent / settings.pair_voxels_per_extent)?;
        let paired: Vec<_> = paired.iter().map(|&k| (local[k], normals[piece[k]])).collect();
        let reach = extent * settings.image_reach;
        let is_near = |number: &usize| from_center(points[*number]).norm_squared() <= (2.0 * reach).powi(2);
        let around: Vec<usize> = (0..points.len()).filter(is_near).collect();
        let mut is_own = vec![false; points.len()];
        piece.iter().for_each(|&number| is_own[number] = true);
        let own: Vec<bool> = around.iter().map(|&number| is_own[number]).collect();
        let around: Vec<SurfacePlace> = around.into_iter().map(surface).collect();
        let plane = |&[point, normal]: &[[f64; 3]; 2]| SurfacePlace {
            place: from_center(point).map(|x| x as f32).into(),
            normal: normal.map(|x| x as f32),
        };
        let planes: Vec<SurfacePlace> = situation.support_planes.iter().map(plane).collect();
        let image = DepthImage::new(
            &around,
            &own,
            to_viewpoint.into(),
            scan.spacing,
            reach,
            to_second.map(<[f64; 3]>::from),
        );
        Ok(Self {
            points: judged.into_iter().map(|k| surface(piece[k])).collect(),
            pairs: PointPairs::new(paired, pair_unit, settings),
            image: image.supported_by(&planes),
            center: center.into(),
            extent,
            tolerance: scan.tolerance as f32,
            voxel,
        })
    }

    /// The mirror image of the piece and of what is around it, x to -x.
    pub(super) fn mirrored(&self) -> Self {
        let mirror = |[x, y, z]: [f32; 3]| [-x, y, z];
        let mirrored =
            |point: &SurfacePlace| SurfacePlace { place: mirror(point.place), normal: mirror(point.normal) };
        Self {
            points: self.points.iter().map(mirrored).collect(),
            pairs: self.pairs.mirrored(),
            image: self.image.mirrored(),
            ..*self
        }
    }

    /// The places of the first `most` points.
    pub(super) fn places(&self, most: usize) -> Vec<[f64; 3]> {
        self.points.iter().take(most).map(|point| point.place.map(f64::from)).collect()
    }

    /// The mean of the piece's points, in the scan: the origin of poses.
    ///
    /// ```
    /// use surfsig::{OrientedScan, PieceSituation, PieceView, RecurrenceSettings};
    /// let (points, normals) = ([[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]; 2]);
    /// let scan = OrientedScan { points: &points, normals: &normals, spacing: 1.0, tolerance: 0.4 };
    /// let seen = PieceSituation { viewpoint: [0.0, 0.0, 9.0], ..Default::default() };
    /// let view = PieceView::new(&scan, &[0, 1], &seen, 1.0, &RecurrenceSettings::default())?;
    /// assert_eq!(view.center(), [2.0, 0.0, 0.0]);
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn center(&self) -> [f64; 3] {
        self.center
    }
}

/// The numbers of points that stand for their voxels, in ascending order.
fn thinned(points: &[[f64; 3]], voxel: f64) -> Result<Vec<usize>, Error> {
    let chosen = voxel_representatives(&PointCloud::new_f64(points), Radius::new(voxel)?)?;
    Ok(chosen.into_iter().map(|number| number as usize).collect())
}
