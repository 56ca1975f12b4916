//! In which directions a surface can be rotated or translated without a change.
//!
//! Gelfand, Guibas: Shape segmentation using local slippage analysis (SGP 2004).

use super::least_squares::LinearisedDistances;
use crate::geometry::RigidTransform;
use nalgebra::{SMatrix, SVD, Vector3, Vector6};

/// Largest root mean square of the residuals that an unobservable motion makes, over that of its points' paths: what
/// noise and small features leave of a cylinder or a plane in scans.
pub(crate) const UNOBSERVABLE: f64 = 0.04;
/// Part of a motion that is a rotation below which it is a translation.
const ROTATIONAL: f64 = 0.3;

/// A motion that does not change a surface: a transform of it is not determined in that direction.
///
/// ```
/// use surfsig::FreeDirection;
/// let along_x = FreeDirection::Translation { axis: [1.0, 0.0, 0.0] };
/// assert_ne!(along_x, FreeDirection::RotationAboutPoint { point: [0.0; 3] });
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FreeDirection {
    /// Along a unit vector.
    Translation {
        /// Unit vector.
        axis: [f64; 3],
    },
    /// About a line.
    Rotation {
        /// Unit vector along the line.
        axis: [f64; 3],
        /// A point on it.
        point: [f64; 3],
    },
    /// About every line through a point, as of a sphere.
    RotationAboutPoint {
        /// The point.
        point: [f64; 3],
    },
}

impl FreeDirection {
    /// The same motion in the target of a transform.
    ///
    /// ```
    /// use surfsig::{FreeDirection, RigidTransform};
    /// let moved = RigidTransform::from_rotation_vector([0.0; 3], [1.0, 2.0, 3.0]);
    /// let about = FreeDirection::RotationAboutPoint { point: [0.0; 3] };
    /// assert_eq!(about.transformed(&moved), FreeDirection::RotationAboutPoint { point: [1.0, 2.0, 3.0] });
    /// ```
    #[must_use]
    pub fn transformed(&self, transform: &RigidTransform) -> Self {
        let (vector, point) = (|v| transform.transform_vector(v), |p: [f64; 3]| transform.transform_point(p));
        match *self {
            Self::Translation { axis } => Self::Translation { axis: vector(axis) },
            Self::Rotation { axis, point: p } => Self::Rotation { axis: vector(axis), point: point(p) },
            Self::RotationAboutPoint { point: p } => Self::RotationAboutPoint { point: point(p) },
        }
    }

    /// Twists about `center`, rotation first: one, or three of all rotations about a point.
    pub(crate) fn twists(&self, center: [f64; 3]) -> Vec<Vector6<f64>> {
        let rotation = |axis: Vector3<f64>, point: [f64; 3]| {
            let velocity = axis.cross(&(Vector3::from(center) - Vector3::from(point)));
            Vector6::new(axis.x, axis.y, axis.z, velocity.x, velocity.y, velocity.z)
        };
        match *self {
            Self::Translation { axis: [x, y, z] } => vec![Vector6::new(0.0, 0.0, 0.0, x, y, z)],
            Self::Rotation { axis, point } => vec![rotation(axis.into(), point)],
            Self::RotationAboutPoint { point } => {
                [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| rotation(axis, point)).into()
            }
        }
    }
}

/// The motions along which points with unit normals slide over their own surface; its rims do not count.
///
/// ```
/// use surfsig::{free_directions, FreeDirection};
/// let square: Vec<[f64; 3]> = (0..100).map(|i| [f64::from(i % 10), f64::from(i / 10), 0.0]).collect();
/// let found = free_directions(&square, &[[0.0, 0.0, 1.0]; 100]);
/// assert_eq!(found.len(), 3);
/// assert!(matches!(found[0], FreeDirection::Rotation { axis: [_, _, z], .. } if z.abs() > 0.999));
/// ```
pub fn free_directions(points: &[[f64; 3]], normals: &[[f64; 3]]) -> Vec<FreeDirection> {
    let motions = Motions::new(points, normals);
    motions.named(|sliding, _| sliding <= UNOBSERVABLE)
}

/// Six motions of a surface, those along which it slides most first.
pub(crate) struct Motions {
    pub center: Vector3<f64>,
    /// Rotations in units of this length move points as far as translations do.
    pub unit: f64,
    /// The root mean square of the distances from the surface that a motion makes, over that of its points' paths; and
    /// the unit twist about `center`, rotations in units of `unit`.
    pub all: Vec<(f64, Vector6<f64>)>,
}

impl Motions {
    /// Of points with unit normals.
    pub fn new(points: &[[f64; 3]], normals: &[[f64; 3]]) -> Self {
        let rows: Vec<_> =
            points.iter().zip(normals).map(|(p, n)| (Vector3::from(*p), Vector3::from(*n), 0.0)).collect();
        let LinearisedDistances { center, unit, information, .. } = LinearisedDistances::new(&rows);
        let mut all = Vec::new();
        if !points.is_empty() {
            let eigen = (information / points.len() as f64).symmetric_eigen();
            let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
            all = pairs.map(|(value, vector)| (value.max(0.0).sqrt(), vector.into_owned())).collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        Self { center, unit, all }
    }

    /// Those that are free, as rotations and translations; of each is known how little it slides, and its number.
    pub fn named(&self, is_free: impl Fn(f64, usize) -> bool) -> Vec<FreeDirection> {
        let numbered = self.all.iter().enumerate();
        let free = numbered.filter(|(number, (sliding, _))| is_free(*sliding, *number));
        let motions: Vec<Vector6<f64>> = free.map(|(_, (_, motion))| *motion).collect();
        named(&motions, self.center, self.unit)
    }

    /// Of a point along a motion, of which a root mean square of 1 is unit.
    pub fn velocity(&self, number: usize, point: &[f64; 3]) -> Vector3<f64> {
        let motion = &self.all[number].1;
        let rotation = motion.fixed_rows::<3>(0) / self.unit;
        motion.fixed_rows::<3>(3) + rotation.cross(&(Vector3::from(*point) - self.center))
    }
}

/// Rotations and translations that span free motions, which are twists about `center` with rotations in units of
/// `unit`: at most six, of unit length and square to each other.
pub(super) fn named(motions: &[Vector6<f64>], center: Vector3<f64>, unit: f64) -> Vec<FreeDirection> {
    if motions.is_empty() {
        return Vec::new();
    }
    // The combinations of free motions with the largest rotational parts come first: left singular vectors of these.
    let mut rotational = SMatrix::<f64, 6, 3>::zeros();
    for (row, motion) in motions.iter().enumerate() {
        rotational.fixed_view_mut::<1, 3>(row, 0).copy_from(&motion.fixed_rows::<3>(0).transpose());
    }
    let product = rotational * rotational.transpose();
    let used = motions.len();
    let eigen = product.view((0, 0), (used, used)).into_owned().symmetric_eigen();
    let mut order: Vec<usize> = (0..used).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let rotations = order.iter().filter(|&&k| eigen.eigenvalues[k] > ROTATIONAL.powi(2)).count();
    let mixed: Vec<Vector6<f64>> = order
        .iter()
        .map(|&k| {
            motions.iter().zip(eigen.eigenvectors.column(k).iter()).map(|(motion, part)| motion * *part).sum()
        })
        .collect();
    let parts = |motion: &Vector6<f64>| -> (Vector3<f64>, Vector3<f64>) {
        (motion.fixed_rows::<3>(0).into_owned(), motion.fixed_rows::<3>(3).into_owned())
    };
    let mut found = Vec::new();
    if rotations == 3 {
        // v = w x (p - c) for all w: the centre is where every rotation's axis passes.
        let mut design = SMatrix::<f64, 9, 3>::zeros();
        let mut right = SMatrix::<f64, 9, 1>::zeros();
        for (k, motion) in mixed[..3].iter().enumerate() {
            let (w, v) = parts(motion);
            design.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&w.cross_matrix());
            right.fixed_rows_mut::<3>(3 * k).copy_from(&-v);
        }
        let offset = SVD::new(design, true, true).solve(&right, 1e-12).unwrap_or_default();
        found.push(FreeDirection::RotationAboutPoint { point: (center + unit * offset).into() });
    } else {
        for motion in &mixed[..rotations] {
            let (w, v) = parts(motion);
            let axis = w.normalize();
            let offset = axis.cross(&v) / w.norm();
            found.push(FreeDirection::Rotation { axis: axis.into(), point: (center + unit * offset).into() });
        }
    }
    for motion in &mixed[rotations..] {
        found.push(FreeDirection::Translation { axis: parts(motion).1.normalize().into() });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::axes_across;

    fn grid() -> impl Iterator<Item = (f64, f64)> {
        (0..900).map(|i| (f64::from(i % 30) / 30.0 + 0.01, f64::from(i / 30) / 30.0 + 0.01))
    }

    fn moved(points: Vec<[f64; 3]>, normals: Vec<[f64; 3]>) -> (RigidTransform, Vec<FreeDirection>) {
        let pose = RigidTransform::from_rotation_vector([0.4, -0.7, 0.3], [5.0, -3.0, 2.0]);
        let normals: Vec<[f64; 3]> =
            normals.into_iter().map(|normal| pose.transform_vector(normal)).collect();
        (pose, free_directions(&pose.transform_points(&points), &normals))
    }

    fn parallel(a: [f64; 3], b: [f64; 3]) -> bool {
        Vector3::from(a).dot(&Vector3::from(b)).abs() > 1.0 - 1e-9
    }

    #[test]
    fn a_cylinder_rotates_about_its_axis_and_slides_along_it() {
        let around = |(u, v): (f64, f64)| {
            let (sine, cosine) = (6.0 * u).sin_cos();
            ([2.0 * cosine, 2.0 * sine, 6.0 * v], [cosine, sine, 0.0])
        };
        let (points, normals) = grid().map(around).unzip();
        let (pose, found) = moved(points, normals);
        let axis = pose.transform_vector([0.0, 0.0, 1.0]);
        let [FreeDirection::Rotation { axis: about, point }, FreeDirection::Translation { axis: along }] =
            found[..]
        else {
            panic!("{found:?}")
        };
        assert!(parallel(about, axis) && parallel(along, axis));
        let offset = Vector3::from(pose.inverse().transform_point(point));
        assert!(offset.xy().norm() < 1e-9, "the point is on the axis");
    }

    #[test]
    fn a_sphere_rotates_about_its_centre() {
        let on = |(u, v): (f64, f64)| {
            let normal = Vector3::new(u - 0.4, v - 0.7, 0.5).normalize();
            (<[f64; 3]>::from(3.0 * normal), <[f64; 3]>::from(normal))
        };
        let (points, normals) = grid().map(on).unzip();
        let (pose, found) = moved(points, normals);
        let [FreeDirection::RotationAboutPoint { point }] = found[..] else { panic!("{found:?}") };
        let off = Vector3::from(point) - Vector3::from(pose.transform_point([0.0; 3]));
        assert!(off.norm() < 1e-9);
    }

    #[test]
    fn a_plane_rotates_about_its_normal_and_slides_across_it() {
        let (points, normals) = grid().map(|(u, v)| ([u, v, 0.0], [0.0, 0.0, 1.0])).unzip();
        let (pose, found) = moved(points, normals);
        let normal = pose.transform_vector([0.0, 0.0, 1.0]);
        assert!(matches!(found[0], FreeDirection::Rotation { axis, .. } if parallel(axis, normal)));
        for direction in &found[1..] {
            let FreeDirection::Translation { axis } = direction else { panic!("{found:?}") };
            assert!(Vector3::from(*axis).dot(&Vector3::from(normal)).abs() < 1e-9);
        }
        assert_eq!(found.len(), 3);
    }

    #[test]
    fn a_corner_is_free_in_nothing() {
        let walls = grid().flat_map(|(u, v)| {
            [([u, v, 0.0], [0.0, 0.0, 1.0]), ([u, 0.0, v], [0.0, 1.0, 0.0]), ([0.0, u, v], [1.0, 0.0, 0.0])]
        });
        let (points, normals) = walls.unzip();
        assert_eq!(moved(points, normals).1, []);
        assert_eq!(free_directions(&[], &[]), []);
        let [u, v] = axes_across(&Vector3::<f64>::z());
        assert!(u.dot(&v).abs() < 1e-15);
    }
}
