//! Points with the normals of the surface around each, as generalised ICP aligns them.

use crate::kd_tree::KdTree;
use crate::random::some_of;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;

/// Nearest points from which a normal is taken, as in small_gicp.
const NEIGHBORS: usize = 20;
/// Points that a thread takes at a time.
const PART: usize = 512;

/// Points with the normals of the surface around each.
///
/// ```
/// let square: Vec<[f64; 3]> = (0..100).map(|i| [f64::from(i % 10), f64::from(i / 10), 0.0]).collect();
/// let cloud = surfsig::GicpCloud::new(square);
/// assert!(cloud.normals().iter().all(|normal| normal[2].abs() > 0.999));
/// ```
#[derive(Debug, Clone)]
pub struct GicpCloud {
    pub(super) points: Vec<[f64; 3]>,
    pub(super) normals: Vec<[f64; 3]>,
    tree: KdTree,
}

impl GicpCloud {
    /// Takes finite points, thinned to about one for each voxel; normals are those of the 20 nearest.
    ///
    /// ```
    /// assert_eq!(surfsig::GicpCloud::new(vec![[0.0; 3]]).len(), 1);
    /// ```
    pub fn new(points: Vec<[f64; 3]>) -> Self {
        let tree = KdTree::new(&points);
        let normals = points
            .par_iter()
            .with_min_len(PART)
            .map_init(Vec::new, |found, &point| {
                tree.nearest_k(point, NEIGHBORS, found);
                plane_of(found.iter().map(|&(_, index)| points[index as usize])).normal
            })
            .collect();
        Self { points, normals, tree }
    }

    /// Those of the points that are wanted, with the normals that they have among all.
    pub(crate) fn some(&self, is_wanted: impl Fn([f64; 3]) -> bool + Sync) -> Self {
        let all = self.points.par_iter().zip(&self.normals).with_min_len(PART);
        let (points, normals): (Vec<[f64; 3]>, Vec<[f64; 3]>) =
            all.filter(|(point, _)| is_wanted(**point)).map(|(point, normal)| (*point, *normal)).unzip();
        let tree = KdTree::new(&points);
        Self { points, normals, tree }
    }

    /// At most `count` of the points, with the normals that they have among all.
    pub(crate) fn sample(&self, count: usize) -> Self {
        let numbers = some_of(self.len(), count);
        let (points, normals): (Vec<[f64; 3]>, Vec<[f64; 3]>) =
            numbers.into_iter().map(|number| (self.points[number], self.normals[number])).unzip();
        let tree = KdTree::new(&points);
        Self { points, normals, tree }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The points.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Unit normals, of which the side is open.
    pub fn normals(&self) -> &[[f64; 3]] {
        &self.normals
    }
}

/// What [`super::gicp`] aligns with: points that are searched, with the normal of the surface around each.
///
/// A [`GicpCloud`] is one; a map to which points are added keeps its own.
pub(crate) trait GicpTarget: Sync {
    /// What is kept of a point of the source from step to step.
    type Memory: Clone + Default + Send;
    /// The number of the nearest point within a reach.
    fn nearest(&self, at: [f64; 3], reach: f64) -> Option<u32>;
    /// The same for a point of the source that moves a little at each step.
    fn nearest_again(&self, at: [f64; 3], reach: f64, memory: &mut Self::Memory) -> Option<u32>;
    /// The point of a number, and its unit normal, of which the side is open; 0 where it is on no plane.
    fn surface(&self, number: u32) -> ([f64; 3], [f64; 3]);
}

impl GicpTarget for GicpCloud {
    type Memory = ();

    fn nearest(&self, at: [f64; 3], reach: f64) -> Option<u32> {
        self.tree.nearest(at, reach).map(|(number, _)| number)
    }

    fn nearest_again(&self, at: [f64; 3], reach: f64, (): &mut ()) -> Option<u32> {
        self.nearest(at, reach)
    }

    fn surface(&self, number: u32) -> ([f64; 3], [f64; 3]) {
        (self.points[number as usize], self.normals[number as usize])
    }
}

/// The plane along which points extend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plane {
    /// Unit normal, of which the side is open.
    pub normal: [f64; 3],
    /// Standard deviation along the normal over the smaller one within the plane: 0 of a plane, 1 of a ball or a line.
    pub thickness: f64,
}

/// The plane of points, of which the first is the one that it is for.
pub(crate) fn plane_of(points: impl Iterator<Item = [f64; 3]> + Clone) -> Plane {
    let first = points.clone().next().map_or_else(Vector3::zeros, Vector3::from);
    let (mut count, mut sum, mut products) = (0.0_f64, Vector3::zeros(), Matrix3::zeros());
    // From the first point, where sums lose nothing at large coordinates.
    for offset in points.map(|point| Vector3::from(point) - first) {
        count += 1.0;
        sum += offset;
        products += offset * offset.transpose();
    }
    let mean = sum / count.max(1.0);
    let eigen = SymmetricEigen::new(products / count.max(1.0) - mean * mean.transpose());
    let least = eigen.eigenvalues.imin();
    let within = eigen.eigenvalues.iter().enumerate().filter(|(k, _)| *k != least);
    let smaller = within.fold(f64::INFINITY, |smaller, (_, value)| smaller.min(*value));
    let thickness = (eigen.eigenvalues[least].max(0.0) / smaller).sqrt();
    Plane {
        normal: eigen.eigenvectors.column(least).into_owned().into(),
        thickness: if smaller > 0.0 { thickness } else { 1.0 },
    }
}
