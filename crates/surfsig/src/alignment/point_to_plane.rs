//! Many transforms of one surface, each fitted to another by the distances of points from tangent planes.

use super::least_squares::LinearisedDistances;
use super::nearest_by_cell::NearestByCell;
use crate::depth_image::{ALIKE, SurfacePlace, dot};
use crate::geometry::RigidTransform;
use crate::kd_tree::KdTree;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Correspondences without which a transform stays as it is: twice the unknowns.
const MIN_CORRESPONDENCES: usize = 12;
/// Share of the largest eigenvalue below which a motion is not observable; it is not made.
const UNOBSERVABLE: f64 = 1e-3;

/// Cosine to the line of sight below which a point faces away, so far that no normal of a visible one is alike.
pub(crate) const FACING_AWAY: f32 = -0.2;

/// Points with unit normals, searched for the nearest one whose normal is alike.
#[derive(Debug)]
pub(crate) struct OrientedSurface {
    points: Vec<SurfacePlace>,
    tree: KdTree,
    cells: Option<NearestByCell>,
}

impl OrientedSurface {
    /// Sorts points, whose coordinates are finite. They are in the order of the tree from then on: those near each other
    /// are near in memory, which most searches wait for.
    pub fn new(points: &[SurfacePlace]) -> Self {
        let positions: Vec<[f64; 3]> = points.iter().map(|point| point.place.map(f64::from)).collect();
        let mut tree = KdTree::new(&positions);
        let points = tree.renumber().into_iter().map(|number| points[number as usize]).collect();
        Self { points, tree, cells: None }
    }

    /// The same, to which many transforms are aligned: the nearest points are kept in cells with an edge, up to a distance.
    /// Correspondences are those of the cells' middles then.
    pub fn with_cells(self, edge: f64, distance: f64) -> Self {
        let cells = NearestByCell::new(&self.points, edge, distance);
        Self { cells: Some(cells), ..self }
    }

    pub fn points(&self) -> &[SurfacePlace] {
        &self.points
    }

    /// The number of the nearest point whose normal is alike, nearer than `max_distance`.
    pub fn nearest(&self, point: &SurfacePlace, max_distance: f64) -> Option<usize> {
        let is_alike = |other: u32| dot(&self.points[other as usize].normal, &point.normal) > ALIKE;
        let found = self.tree.nearest_where(point.place.map(f64::from), max_distance, is_alike);
        found.map(|(number, _)| number as usize)
    }

    /// The same as [`OrientedSurface::nearest`] where no cells are kept; else about the nearest of those that face about the
    /// same way.
    fn correspondence(&self, point: &SurfacePlace, max_distance: f64) -> Option<usize> {
        let Some(cells) = &self.cells else { return self.nearest(point, max_distance) };
        let number = cells.nearest(point)?;
        let nearest = &self.points[number];
        let gap = [0, 1, 2].map(|k| nearest.place[k] - point.place[k]);
        let is_near = f64::from(dot(&gap, &gap)) < max_distance * max_distance;
        (is_near && dot(&nearest.normal, &point.normal) > ALIKE).then_some(number)
    }

    /// The transforms of a source fitted to this surface by point to plane: a step for each of the largest distances
    /// between correspondences. Motions that the correspondences do not determine are not made.
    ///
    /// Where all of this surface was seen from a viewpoint, source points that face away from it have no
    /// correspondence, and none is searched.
    pub fn align_all(
        &self,
        transforms: &[RigidTransform],
        source: &[SurfacePlace],
        max_distances: &[f64],
        viewpoint: Option<[f64; 3]>,
    ) -> Vec<RigidTransform> {
        let aligned = |start: &RigidTransform| {
            let mut transform = *start;
            for &max_distance in max_distances {
                let facing: Vec<SurfacePlace> = match viewpoint {
                    Some(viewpoint) => facing(&transform, source, viewpoint),
                    None => source.to_vec(),
                };
                let Some(better) = self.stepped(&transform, &facing, max_distance) else { break };
                transform = better;
            }
            transform
        };
        transforms.par_iter().map(aligned).collect()
    }

    /// One step; `None` where there are too few correspondences.
    fn stepped(
        &self,
        transform: &RigidTransform,
        source: &[SurfacePlace],
        max_distance: f64,
    ) -> Option<RigidTransform> {
        let correspondence = |point: &SurfacePlace| {
            let moved = transformed(transform, point);
            let target = &self.points[self.correspondence(&moved, max_distance)?];
            let [point, foot, normal] = [moved.place, target.place, target.normal].map(vector);
            Some((point, normal, normal.dot(&(point - foot))))
        };
        let rows: Vec<_> = source.iter().filter_map(correspondence).collect();
        if rows.len() < MIN_CORRESPONDENCES {
            return None;
        }
        let (step, _) = LinearisedDistances::new(&rows).step(UNOBSERVABLE);
        Some(step * *transform)
    }
}

/// A point and its normal in the target.
pub(crate) fn transformed(transform: &RigidTransform, point: &SurfacePlace) -> SurfacePlace {
    SurfacePlace {
        place: transform.transform_point(point.place.map(f64::from)).map(|x| x as f32),
        normal: transform.transform_vector(point.normal.map(f64::from)).map(|x| x as f32),
    }
}

/// The source's points that face a viewpoint in the target under T_target_source.
fn facing(transform: &RigidTransform, source: &[SurfacePlace], viewpoint: [f64; 3]) -> Vec<SurfacePlace> {
    // In the source only one point has to be moved.
    let from = transform.inverse().transform_point(viewpoint).map(|x| x as f32);
    source.iter().filter(|point| cosine_towards(point, from) > FACING_AWAY).copied().collect()
}

/// Of the angle between a point's normal and the direction from it to another.
pub(crate) fn cosine_towards(point: &SurfacePlace, other: [f32; 3]) -> f32 {
    let towards = [0, 1, 2].map(|k| other[k] - point.place[k]);
    dot(&point.normal, &towards) / dot(&towards, &towards).sqrt()
}

fn vector(v: [f32; 3]) -> Vector3<f64> {
    Vector3::from(v.map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points all over a box, one apart, with outward normals.
    fn box_points() -> Vec<SurfacePlace> {
        let half = [9.0_f32, 6.0, 4.0];
        let mut points = Vec::new();
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for sign in [-1.0_f32, 1.0] {
                for i in 0..2 * half[u] as i32 {
                    for k in 0..2 * half[v] as i32 {
                        let (mut place, mut normal) = ([0.0; 3], [0.0; 3]);
                        place[axis] = sign * half[axis];
                        place[u] = i as f32 + 0.5 - half[u];
                        place[v] = k as f32 + 0.5 - half[v];
                        normal[axis] = sign;
                        points.push(SurfacePlace { place, normal });
                    }
                }
            }
        }
        points
    }

    #[test]
    fn the_nearest_point_is_that_of_a_search_through_all() {
        let surface = OrientedSurface::new(&box_points());
        // In the order of the tree.
        let points = surface.points();
        for (number, point) in points.iter().enumerate() {
            let asked = SurfacePlace { place: point.place.map(|x| 1.1 * x + 0.3), ..*point };
            let square = |other: &SurfacePlace| {
                let gap = [0, 1, 2].map(|k| f64::from(other.place[k]) - f64::from(asked.place[k]));
                let square = gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2];
                (dot(&other.normal, &asked.normal) > ALIKE).then_some(square)
            };
            let found = (0..points.len()).filter_map(|i| Some((square(&points[i])?, i)));
            let slow = found.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|found| found.0 < 4.0);
            assert_eq!(surface.nearest(&asked, 2.0), slow.map(|found| found.1), "{number}");
        }
    }

    #[test]
    fn a_box_converges_where_it_was() {
        let points = box_points();
        let surface = OrientedSurface::new(&points);
        let distances: Vec<f64> = (0..12).map(|k| 4.0 * 0.9_f64.powi(k)).collect();
        let starts = [
            RigidTransform::from_rotation_vector([0.05, -0.04, 0.06], [0.8, -0.6, 0.5]),
            RigidTransform::from_rotation_vector([0.0; 3], [100.0, 0.0, 0.0]),
        ];
        let found = surface.align_all(&starts, &points, &distances, None);
        assert!(found[0].log().iter().all(|component| component.abs() < 1e-5), "{:?}", found[0]);
        assert_eq!(found[1], starts[1], "far from everything");
    }

    #[test]
    fn what_faces_away_from_the_viewpoint_is_not_needed() {
        let points = box_points();
        let viewpoint = [30.0, 40.0, 50.0];
        let seen = facing(&RigidTransform::identity(), &points, viewpoint);
        assert!(seen.len() < points.len() && seen.iter().all(|point| point.normal.iter().sum::<f32>() > 0.0));
        let surface = OrientedSurface::new(&seen);
        let start = RigidTransform::from_rotation_vector([0.02, -0.01, 0.02], [0.4, -0.3, 0.2]);
        let [all, some] = [None, Some(viewpoint)]
            .map(|viewpoint| surface.align_all(&[start], &points, &[1.5; 4], viewpoint)[0]);
        assert_eq!(all, some);
        assert!(some.log().iter().all(|component| component.abs() < 0.05), "{some:?}");
    }

    #[test]
    fn a_plane_makes_no_motion_that_it_does_not_determine() {
        let plane: Vec<SurfacePlace> =
            box_points().into_iter().filter(|point| point.normal == [0.0, 0.0, 1.0]).collect();
        let surface = OrientedSurface::new(&plane);
        let start = RigidTransform::from_rotation_vector([0.0, 0.0, 0.3], [0.7, -0.4, 0.5]);
        let [found] = surface.align_all(&[start], &plane, &[2.0; 4], None)[..] else {
            panic!("one transform")
        };
        let wanted = RigidTransform::from_rotation_vector([0.0, 0.0, 0.3], [0.7, -0.4, 0.0]);
        let off = (found * wanted.inverse()).log();
        assert!(off.iter().all(|component| component.abs() < 1e-6), "{found:?}");
    }
}
