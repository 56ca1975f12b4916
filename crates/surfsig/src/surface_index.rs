//! Places of a surface, found by where they are and how they face; and poses of other surfaces fitted to them.

use crate::depth_image::{SurfacePlace, dot};
use crate::geometry::RigidTransform;
use nalgebra::{Matrix6, SymmetricEigen, Vector3, Vector6};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Cosine between normals that face alike; those of narrow surfaces and of edges are smoothed.
const ALIKE: f32 = 0.8;
/// Places on the other surface without which a pose stays as it is: twice the unknowns.
const FEWEST: usize = 12;
/// Share of the largest eigenvalue below which a motion is one that the surface does not hold.
const FREE: f64 = 1e-3;

/// Places of a surface in a grid of cells.
///
/// ```
/// use surfsig::{SurfaceIndex, SurfacePlace};
///
/// // A square, one apart, and a place over it.
/// let square: Vec<SurfacePlace> = (0..400)
///     .map(|i| SurfacePlace { place: [(i % 20) as f32, (i / 20) as f32, 0.0], normal: [0.0, 0.0, 1.0] })
///     .collect();
/// let index = SurfaceIndex::new(square, 1.0);
/// let over = SurfacePlace { place: [3.1, 2.0, 0.5], normal: [0.0, 0.0, 1.0] };
/// assert_eq!(index.nearest(&over, 1.0), Some(43));
/// assert_eq!(index.nearest(&SurfacePlace { normal: [0.0, 0.0, -1.0], ..over }, 1.0), None);
/// ```
#[derive(Debug, Clone)]
pub struct SurfaceIndex {
    places: Vec<SurfacePlace>,
    /// The places once more, cell by cell, with their numbers.
    sorted: Vec<(SurfacePlace, u32)>,
    cells: FxHashMap<[i32; 3], (u32, u32)>,
    cell: f32,
}

impl SurfaceIndex {
    /// Sorts places into cells of this size; a search is fast up to a few of them.
    ///
    /// # Panics
    /// If there are 2^32 places or more, or `cell` is not above 0.
    pub fn new(places: Vec<SurfacePlace>, cell: f32) -> Self {
        assert!(cell > 0.0, "a cell has a size");
        let count = u32::try_from(places.len()).expect("fewer than 2^32 places");
        let keys: Vec<[i32; 3]> = places.iter().map(|point| cell_of(&point.place, cell)).collect();
        let mut order: Vec<u32> = (0..count).collect();
        order.sort_by_key(|&number| (keys[number as usize], number));
        let mut cells = FxHashMap::default();
        let mut start = 0;
        for run in order.chunk_by(|&a, &b| keys[a as usize] == keys[b as usize]) {
            let end = start + run.len() as u32;
            cells.insert(keys[run[0] as usize], (start, end));
            start = end;
        }
        let sorted = order.into_iter().map(|number| (places[number as usize], number)).collect();
        Self { places, sorted, cells, cell }
    }

    /// The number of the place that is nearest of those that face alike, within `reach`; the first of several.
    pub fn nearest(&self, point: &SurfacePlace, reach: f32) -> Option<usize> {
        let low = cell_of(&point.place.map(|x| x - reach), self.cell);
        let high = cell_of(&point.place.map(|x| x + reach), self.cell);
        let mut best = (reach * reach, usize::MAX);
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let Some(&(start, end)) = self.cells.get(&[x, y, z]) else { continue };
                    for (other, number) in &self.sorted[start as usize..end as usize] {
                        let way = [0, 1, 2].map(|k| other.place[k] - point.place[k]);
                        let found = (dot(&way, &way), *number as usize);
                        if found <= best && dot(&other.normal, &point.normal) > ALIKE {
                            best = found;
                        }
                    }
                }
            }
        }
        (best.1 < usize::MAX).then_some(best.1)
    }

    /// For places that a pose moves to this surface the numbers of [`SurfaceIndex::nearest`].
    pub fn partners(&self, pose: &RigidTransform, places: &[SurfacePlace], reach: f32) -> Vec<Option<usize>> {
        places.iter().map(|point| self.nearest(&moved(pose, point), reach)).collect()
    }

    /// Fits poses of other surface places to this surface by point to plane: a step for each of `reaches`.
    ///
    /// Motions that the surface does not hold are not made.
    pub fn settle_all(
        &self,
        poses: &[RigidTransform],
        places: &[SurfacePlace],
        reaches: &[f32],
    ) -> Vec<RigidTransform> {
        let settled = |pose: &RigidTransform| {
            let mut pose = *pose;
            for &reach in reaches {
                let Some(better) = self.stepped(&pose, places, reach) else { break };
                pose = better;
            }
            pose
        };
        poses.par_iter().map(settled).collect()
    }

    /// One step of point to plane; `None` where too little of the places is near.
    fn stepped(&self, pose: &RigidTransform, places: &[SurfacePlace], reach: f32) -> Option<RigidTransform> {
        let pairs: Vec<(Vector3<f64>, &SurfacePlace)> = places
            .iter()
            .filter_map(|point| {
                let there = moved(pose, point);
                let partner = &self.places[self.nearest(&there, reach)?];
                Some((vector(&there.place), partner))
            })
            .collect();
        if pairs.len() < FEWEST {
            return None;
        }
        let count = pairs.len() as f64;
        let middle = pairs.iter().map(|(place, _)| place).sum::<Vector3<f64>>() / count;
        // Turns in units of this length are as large as shifts.
        let square = pairs.iter().map(|(place, _)| (place - middle).norm_squared()).sum::<f64>() / count;
        let unit = if square > 0.0 { square.sqrt() } else { 1.0 };
        let mut normal_matrix = Matrix6::zeros();
        let mut right = Vector6::zeros();
        for (place, partner) in &pairs {
            let normal = vector(&partner.normal);
            let turn = ((place - middle) / unit).cross(&normal);
            let row = Vector6::new(turn.x, turn.y, turn.z, normal.x, normal.y, normal.z);
            normal_matrix += row * row.transpose();
            right += row * normal.dot(&(vector(&partner.place) - place));
        }
        let [x, y, z, translation @ ..] = <[f64; 6]>::from(held_solution(normal_matrix, &right));
        let rotation_vector = [x, y, z].map(|angle| angle / unit);
        Some(RigidTransform::about(middle.into(), rotation_vector, translation) * *pose)
    }
}

/// Solves A x = b in the directions that A holds.
fn held_solution(matrix: Matrix6<f64>, right: &Vector6<f64>) -> Vector6<f64> {
    let eigen = SymmetricEigen::new(matrix);
    let least = FREE * eigen.eigenvalues.max();
    let mut solution = Vector6::zeros();
    for (value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > least {
            solution += direction * (direction.dot(right) / value);
        }
    }
    solution
}

fn moved(pose: &RigidTransform, point: &SurfacePlace) -> SurfacePlace {
    SurfacePlace {
        place: pose.transform_point(point.place.map(f64::from)).map(|x| x as f32),
        normal: pose.transform_vector(point.normal.map(f64::from)).map(|x| x as f32),
    }
}

fn vector(v: &[f32; 3]) -> Vector3<f64> {
    Vector3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]))
}

/// The cell of a place; far away the last one there is.
fn cell_of(place: &[f32; 3], cell: f32) -> [i32; 3] {
    place.map(|x| (x / cell).floor() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places all over a box, one apart, outwards.
    fn box_places() -> Vec<SurfacePlace> {
        let half = [9.0_f32, 6.0, 4.0];
        let mut places = Vec::new();
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
                        places.push(SurfacePlace { place, normal });
                    }
                }
            }
        }
        places
    }

    #[test]
    fn the_nearest_place_is_that_of_a_search_through_all() {
        let places = box_places();
        for cell in [0.7, 2.0, 30.0] {
            let index = SurfaceIndex::new(places.clone(), cell);
            for (number, point) in places.iter().enumerate() {
                let asked = SurfacePlace { place: point.place.map(|x| 1.1 * x + 0.3), ..*point };
                let far = |other: &SurfacePlace| {
                    let way = [0, 1, 2].map(|k| other.place[k] - asked.place[k]);
                    (dot(&other.normal, &asked.normal) > ALIKE).then_some(dot(&way, &way))
                };
                let found = (0..places.len()).filter_map(|i| Some((far(&places[i])?, i)));
                let slow = found.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|found| found.0 <= 4.0);
                assert_eq!(index.nearest(&asked, 2.0), slow.map(|found| found.1), "cell {cell}, {number}");
            }
        }
    }

    #[test]
    fn a_box_settles_where_it_was() {
        let places = box_places();
        let index = SurfaceIndex::new(places.clone(), 2.0);
        let reaches: Vec<f32> = (0..12).map(|k| 4.0 * 0.9_f32.powi(k)).collect();
        let starts = [
            RigidTransform::from_rotation_vector([0.05, -0.04, 0.06], [0.8, -0.6, 0.5]),
            RigidTransform::from_rotation_vector([0.0; 3], [100.0, 0.0, 0.0]),
        ];
        let found = index.settle_all(&starts, &places, &reaches);
        for difference in found[0].log() {
            assert!(difference.abs() < 1e-5, "{:?}", found[0]);
        }
        assert_eq!(found[1], starts[1], "far from everything");
    }

    #[test]
    fn a_plane_does_not_move_what_it_does_not_hold() {
        let plane: Vec<SurfacePlace> =
            box_places().into_iter().filter(|point| point.normal == [0.0, 0.0, 1.0]).collect();
        let index = SurfaceIndex::new(plane.clone(), 2.0);
        let [found] = index.settle_all(
            &[RigidTransform::from_rotation_vector([0.0, 0.0, 0.3], [0.7, -0.4, 0.5])],
            &plane,
            &[2.0; 4],
        )[..] else {
            panic!("one pose")
        };
        let wanted = RigidTransform::from_rotation_vector([0.0, 0.0, 0.3], [0.7, -0.4, 0.0]);
        for difference in (found * wanted.inverse()).log() {
            assert!(difference.abs() < 1e-6, "{found:?}");
        }
    }
}
