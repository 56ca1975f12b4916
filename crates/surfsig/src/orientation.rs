//! Which side of a surface is which, where nobody knows where the sensor stood.

use crate::extract::extract_within;
use crate::kd_tree::KdTree;
use crate::{
    Error, ExtractOptions, Monitor, PointCloud, Queries, Radius, voxel_representatives, with_threads,
};
use rayon::prelude::*;

/// Voxels: the radius of the balls from which normals are taken, some twenty points of a thinned surface.
const BALL: f64 = 2.5;
/// Nearest points that the side is handed on to.
const NEIGHBORS: usize = 10;
/// What a voxel of distance counts against a right angle between normals: of equally parallel ones the nearer comes
/// first.
const DISTANCE_WEIGHT: f64 = 0.01;

/// Of each point a normal that is on one side of its piece of surface, which side is open; `points` are finite.
///
/// The side is handed on from neighbour to neighbour, where normals differ least first (Hoppe and others, Surface
/// reconstruction from unorganized points, 1992). `voxel` is the distance between the points that hand it on.
///
/// # Errors
/// [`Error::InvalidRadius`] for a voxel that is none; [`Error::Threads`], [`Error::Cancelled`].
///
/// ```
/// use surfsig::{consistent_directions, Monitor};
/// let square: Vec<[f64; 3]> = (0..900).map(|i| [f64::from(i % 30), f64::from(i / 30), 0.0]).collect();
/// let found = consistent_directions(&square, 1.0, None, &Monitor::default())?;
/// assert!(found.iter().all(|direction| *direction == found[0]) && found[0][2].abs() > 0.999);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn consistent_directions(
    points: &[[f64; 3]],
    voxel: f64,
    threads: Option<usize>,
    monitor: &Monitor,
) -> Result<Vec<[f32; 3]>, Error> {
    with_threads(threads, || directions_within(points, voxel, monitor))?
}

/// The same, on the threads that are there.
pub(crate) fn directions_within(
    points: &[[f64; 3]],
    voxel: f64,
    monitor: &Monitor,
) -> Result<Vec<[f32; 3]>, Error> {
    let cloud = PointCloud::new_f64(points);
    let chosen = voxel_representatives(&cloud, Radius::new(voxel)?)?;
    let ball = Radius::new(BALL * voxel)?;
    let options = ExtractOptions::default();
    let found = extract_within(&cloud, ball.into(), &Queries::Indices(&chosen), &options, &monitor.apart())?;
    let known: Vec<usize> = (0..chosen.len()).filter(|&i| found.normals[i][0].is_finite()).collect();
    let samples: Vec<[f64; 3]> = known.iter().map(|&i| points[chosen[i] as usize]).collect();
    let mut normals: Vec<[f32; 3]> = known.iter().map(|&i| found.normals[i]).collect();
    let tree = KdTree::new(&samples);
    if samples.is_empty() {
        return Ok(vec![[0.0, 0.0, 1.0]; points.len()]);
    }
    let edges = neighbor_edges(&samples, &normals, &tree, voxel);
    for (normal, is_flipped) in normals.iter_mut().zip(flips(samples.len(), edges)) {
        if is_flipped {
            *normal = normal.map(|x| -x);
        }
    }
    monitor.check()?;
    let nearest = |point: &[f64; 3]| {
        tree.nearest(*point, f64::INFINITY).map_or([0.0, 0.0, 1.0], |(index, _)| normals[index as usize])
    };
    Ok(points.par_iter().with_min_len(1024).map(nearest).collect())
}

/// Two neighbours, and whether their normals are on opposite sides.
struct Edge {
    weight: f64,
    ends: [u32; 2],
    is_flipped: bool,
}

/// Of each sample to its neighbours, those whose normals differ least first.
fn neighbor_edges(samples: &[[f64; 3]], normals: &[[f32; 3]], tree: &KdTree, voxel: f64) -> Vec<Edge> {
    let of_one = |found: &mut Vec<(f64, u32)>, (i, point): (usize, &[f64; 3])| -> Vec<Edge> {
        tree.nearest_k(*point, NEIGHBORS + 1, found);
        let others = found.iter().filter(|(_, other)| *other as usize != i);
        let edge = |&(square, other): &(f64, u32)| {
            let cosine: f32 = (0..3).map(|k| normals[i][k] * normals[other as usize][k]).sum();
            let weight = 1.0 - f64::from(cosine.abs()) + DISTANCE_WEIGHT * square.sqrt() / voxel;
            Edge { weight, ends: [i as u32, other], is_flipped: cosine < 0.0 }
        };
        others.map(edge).collect()
    };
    let edges = samples.par_iter().enumerate().with_min_len(256).map_init(Vec::new, of_one);
    let mut edges: Vec<Edge> = edges.flatten_iter().collect();
    edges.sort_by(|a, b| a.weight.total_cmp(&b.weight).then(a.ends.cmp(&b.ends)));
    edges
}

/// Which of the samples must be flipped to be on the side of the first one of their piece.
///
/// The minimum spanning forest of Kruskal; each tree keeps of every sample whether it is opposite to the tree's root.
fn flips(count: usize, edges: Vec<Edge>) -> Vec<bool> {
    let mut forest = Forest { parent: (0..count as u32).collect(), is_opposite: vec![false; count] };
    for Edge { ends: [a, b], is_flipped, .. } in edges {
        let ((root_a, opposite_a), (root_b, opposite_b)) = (forest.root(a), forest.root(b));
        if root_a != root_b {
            // The first sample of a piece is its root.
            let (root, other) = (root_a.min(root_b), root_a.max(root_b));
            forest.parent[other as usize] = root;
            forest.is_opposite[other as usize] = opposite_a ^ opposite_b ^ is_flipped;
        }
    }
    (0..count as u32).map(|sample| forest.root(sample).1).collect()
}

struct Forest {
    parent: Vec<u32>,
    /// To the parent.
    is_opposite: Vec<bool>,
}

impl Forest {
    /// The root of a sample's tree, and whether the sample is opposite to it.
    fn root(&mut self, sample: u32) -> (u32, bool) {
        let mut path = Vec::new();
        let mut at = sample;
        while self.parent[at as usize] != at {
            path.push(at);
            at = self.parent[at as usize];
        }
        let mut opposite = false;
        for &below in path.iter().rev() {
            opposite ^= self.is_opposite[below as usize];
            self.is_opposite[below as usize] = opposite;
            self.parent[below as usize] = at;
        }
        (at, opposite)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_of_a_sphere_are_all_outwards_or_all_inwards() {
        let golden = std::f64::consts::PI * (5.0_f64.sqrt() - 1.0);
        let points: Vec<[f64; 3]> = (0..4000)
            .map(|i| {
                let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / 4000.0;
                let (sine, cosine) = (golden * f64::from(i)).sin_cos();
                let r = (1.0 - z * z).sqrt();
                [r * cosine, r * sine, z]
            })
            .collect();
        let found = consistent_directions(&points, 0.1, None, &Monitor::default()).unwrap();
        let outwards = |(point, normal): (&[f64; 3], &[f32; 3])| {
            (0..3).map(|k| point[k] * f64::from(normal[k])).sum::<f64>()
        };
        let signs: Vec<f64> = points.iter().zip(&found).map(outwards).collect();
        assert!(signs.iter().all(|&s| s > 0.9) || signs.iter().all(|&s| s < -0.9));
        assert_eq!(consistent_directions(&points, 0.1, Some(1), &Monitor::default()).unwrap(), found);
    }

    #[test]
    fn points_without_a_surface_get_some_direction() {
        let points = [[0.0; 3], [5.0, 0.0, 0.0]];
        let found = consistent_directions(&points, 0.1, None, &Monitor::default()).unwrap();
        assert_eq!(found, [[0.0, 0.0, 1.0]; 2]);
    }
}
