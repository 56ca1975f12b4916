//! Pieces of one surface that were found in neighbouring parts of a cloud, joined.

use super::FoundSurface;
use super::comparison::{Comparison, SAMPLE, thinned};
use crate::primitive::{Primitive, Vector};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// A piece that failed is compared again once the other one has so many times as many points.
const GROWN: usize = 2;

/// Points of which those are taken that several pieces are compared by.
const MOST_POINTS: usize = 8 * SAMPLE;

/// A surface that was found in a part of a cloud.
///
/// ```
/// use surfsig::{find_surfaces, Monitor, PointCloud, SurfaceOptions, SurfacePiece};
/// let points: Vec<[f64; 3]> = (0..900).map(|i| [(i % 30) as f64, (i / 30) as f64, 0.0]).collect();
/// let found = find_surfaces(&PointCloud::new_f64(&points), &SurfaceOptions::default(), &Monitor::default())?;
/// let piece = SurfacePiece { surface: found.surfaces[0].clone(), points, rounding: found.rounding };
/// assert_eq!(piece.surface.count, 900);
/// # Ok::<(), surfsig::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct SurfacePiece {
    /// The surface.
    pub surface: FoundSurface,
    /// Its points, or some of them.
    pub points: Vec<[f64; 3]>,
    /// [`crate::FoundSurfaces::rounding`] of its part.
    pub rounding: f64,
}

/// Two pieces of parts next to each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct PiecePair {
    /// The number of the one.
    pub first: u32,
    /// The number of the other.
    pub second: u32,
    /// Whether they have points in common. What has none is of one surface only where the gap is narrow.
    pub overlap: bool,
}

/// Which pieces are of one surface.
#[derive(Debug, Clone)]
pub struct JoinedPieces {
    /// Of each piece the number of its surface.
    pub surfaces: Vec<u32>,
    /// The surfaces, fitted to samples of their points.
    pub primitives: Vec<Primitive>,
}

/// Joins pieces where their joint fit is no worse than the separate ones but by chance, as [`crate::find_surfaces`] does
/// within a cloud: the largest first, which grow over the pairs.
///
/// Coordinates must not be so large that their rounding counts beside the noise.
///
/// ```
/// use surfsig::{
///     find_surfaces, join_surface_pieces, Monitor, PiecePair, PointCloud, SurfaceOptions, SurfacePiece,
/// };
/// // A wall in two halves, and a step.
/// let piece = |x: f64, y: f64| {
///     let points: Vec<[f64; 3]> = (0..900).map(|i| [x + (i % 30) as f64, y, (i / 30) as f64]).collect();
///     let cloud = PointCloud::new_f64(&points);
///     let mut found = find_surfaces(&cloud, &SurfaceOptions::default(), &Monitor::default())?;
///     Ok(SurfacePiece { surface: found.surfaces.remove(0), points, rounding: found.rounding })
/// };
/// let pieces = [piece(0.0, 5.0)?, piece(30.0, 5.0)?, piece(60.0, 6.0)?];
/// let pair = |first, second| PiecePair { first, second, overlap: false };
/// let joined = join_surface_pieces(&pieces, &[pair(0, 1), pair(1, 2)]);
/// assert_eq!(joined.surfaces, [0, 0, 1]);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn join_surface_pieces(pieces: &[SurfacePiece], pairs: &[PiecePair]) -> JoinedPieces {
    let singles: Vec<Comparison> = pieces.par_iter().map(compared).collect();
    let mut joining = Joining {
        groups: (0..pieces.len()).map(|piece| Group::new(piece, pieces)).collect(),
        group_of: (0..pieces.len()).collect(),
        pieces,
        singles,
    };
    for pair in pairs {
        let (first, second) = (pair.first as usize, pair.second as usize);
        if first != second && first.max(second) < pieces.len() {
            joining.groups[first].pairs.push((first, second, pair.overlap));
            joining.groups[second].pairs.push((second, first, pair.overlap));
        }
    }
    let mut largest_first: Vec<usize> = (0..pieces.len()).collect();
    largest_first.sort_by_key(|&piece| (std::cmp::Reverse(pieces[piece].surface.count), piece));
    for &seed in &largest_first {
        if joining.group_of[seed] == seed {
            joining.grow(seed);
        }
    }
    let kept: Vec<usize> = (0..pieces.len()).filter(|&piece| joining.group_of[piece] == piece).collect();
    let number = |group: &usize| kept.partition_point(|kept| kept < group) as u32;
    JoinedPieces {
        surfaces: joining.group_of.iter().map(number).collect(),
        primitives: kept.iter().map(|&group| joining.compared(group).primitive).collect(),
    }
}

/// A piece alone.
fn compared(piece: &SurfacePiece) -> Comparison {
    let points: Vec<Vector> = thinned(&piece.points, SAMPLE).map(Vector::from).collect();
    let near = piece.surface.primitive().beside(&middle(&points));
    let FoundSurface { tolerance, is_exact, .. } = piece.surface;
    Comparison::new(near, points, tolerance, piece.rounding, is_exact)
}

fn middle(points: &[Vector]) -> Vector {
    points.iter().sum::<Vector>() / points.len().max(1) as f64
}

/// Pieces that are of one surface so far.
struct Group {
    members: Vec<usize>,
    /// Points of all of them.
    count: usize,
    /// What is compared of several pieces; of one, that is its own.
    several: Option<Comparison>,
    /// Every `stride`-th point of the pieces' samples, ...
    points: Vec<Vector>,
    /// ... with the same stride in all pieces.
    stride: usize,
    /// Pairs of a member and another piece, and whether they overlap.
    pairs: Vec<(usize, usize, bool)>,
}

impl Group {
    fn new(piece: usize, pieces: &[SurfacePiece]) -> Self {
        let count = pieces[piece].surface.count;
        Self { members: vec![piece], count, several: None, points: Vec::new(), stride: 1, pairs: Vec::new() }
    }
}

/// In which order groups are tried: those with points in common first, and the largest of them. Whether there are none in
/// common, the points, and the number of the group.
type Order = (bool, Reverse<usize>, usize);

/// All pieces, and what they have become.
struct Joining<'a> {
    pieces: &'a [SurfacePiece],
    singles: Vec<Comparison>,
    groups: Vec<Group>,
    /// Of each piece the number of its group, which is that of its first piece.
    group_of: Vec<usize>,
}

impl Joining<'_> {
    fn compared(&self, group: usize) -> &Comparison {
        self.groups[group].several.as_ref().unwrap_or(&self.singles[group])
    }

    /// Lets a group take over those next to it that are of the same surface.
    fn grow(&mut self, own: usize) {
        // Of each group that failed, the points of both at that time.
        let mut failed: FxHashMap<usize, (usize, usize)> = FxHashMap::default();
        loop {
            let count = self.groups[own].count;
            let mut next: BTreeMap<Order, Vec<(usize, usize)>> = BTreeMap::new();
            for &(member, piece, overlap) in &self.groups[own].pairs {
                let group = self.group_of[piece];
                let others = self.groups[group].count;
                let is_new = failed
                    .get(&group)
                    .is_none_or(|&(own, other)| count >= GROWN * own || others >= GROWN * other);
                if group != own && is_new {
                    next.entry((!overlap, Reverse(others), group)).or_default().push((member, piece));
                }
            }
            let joined = next.iter().find_map(|(&(is_apart, others, group), pairs)| {
                let found = self.joint(own, group, is_apart, pairs);
                if found.is_none() {
                    failed.insert(group, (count, others.0));
                }
                found.map(|primitive| (group, primitive))
            });
            let Some((group, primitive)) = joined else { break };
            self.take_over(own, group, primitive);
        }
    }

    /// The surface of two groups with pairs of pieces next to each other.
    fn joint(&self, own: usize, other: usize, is_apart: bool, pairs: &[(usize, usize)]) -> Option<Primitive> {
        let (large, small) = (self.compared(own), self.compared(other));
        let is_narrow = |&(member, piece): &(usize, usize)| {
            let (member, piece) = (&self.singles[member], &self.singles[piece]);
            member.is_narrow(piece, &member.gap(piece))
        };
        if !large.is_near(small) || is_apart && !pairs.iter().any(is_narrow) {
            return None;
        }
        large.joint(small)
    }

    fn take_over(&mut self, own: usize, other: usize, primitive: Primitive) {
        let Group { members, count, pairs, .. } =
            std::mem::replace(&mut self.groups[other], Group::new(other, self.pieces));
        members.iter().for_each(|&member| self.group_of[member] = own);
        let of_several = [own, other].map(|group| &self.pieces[group].surface);
        let (rounding, tolerance) = (
            f64::max(self.pieces[own].rounding, self.pieces[other].rounding),
            f64::max(of_several[0].tolerance, of_several[1].tolerance),
        );
        let is_exact = of_several.iter().all(|surface| surface.is_exact);
        let singles = &self.singles;
        let group = &mut self.groups[own];
        if group.points.is_empty() {
            group.points = singles[own].points.clone();
        }
        for &member in &members {
            group.points.extend(singles[member].points.iter().step_by(group.stride));
        }
        while group.points.len() > MOST_POINTS {
            group.points = group.points.iter().step_by(2).copied().collect();
            group.stride *= 2;
        }
        group.members.extend(members);
        group.count += count;
        group.pairs.extend(pairs);
        let points: Vec<Vector> = thinned(&group.points, 2 * SAMPLE).collect();
        let near = primitive.beside(&middle(&points));
        group.several = Some(Comparison::new(near, points, tolerance, rounding, is_exact));
        let group_of = &self.group_of;
        group.pairs.retain(|&(_, piece, _)| group_of[piece] != own);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::samples::Draws;
    use crate::{Monitor, PointCloud, SurfaceKind, SurfaceOptions, find_surfaces};

    /// Parts of 1,000 points of a pipe along x, each 2 long, with noise, and shifted by so much from part to part.
    fn parts_of_pipe(parts: u32, shift: f64, draws: &mut Draws) -> Vec<SurfacePiece> {
        let piece = |part: u32| {
            let place = |_| {
                let (x, turn) = (draws.between(0.0, 2.2), draws.between(0.0, std::f64::consts::TAU));
                let away = 0.3 + 0.005 * draws.normal();
                let z = away * turn.sin() + f64::from(part) * shift;
                [2.0 * f64::from(part) + x, away * turn.cos(), z]
            };
            let points: Vec<[f64; 3]> = (0..1000).map(place).collect();
            let options = SurfaceOptions { kinds: vec![SurfaceKind::Cylinder], ..SurfaceOptions::default() };
            let cloud = PointCloud::new_f64(&points);
            let mut found = find_surfaces(&cloud, &options, &Monitor::default()).unwrap();
            assert_eq!(found.surfaces.len(), 1);
            SurfacePiece { surface: found.surfaces.remove(0), points, rounding: found.rounding }
        };
        (0..parts).map(piece).collect()
    }

    fn chain(pieces: u32, overlap: bool) -> Vec<PiecePair> {
        (1..pieces).map(|second| PiecePair { first: second - 1, second, overlap }).collect()
    }

    #[test]
    fn parts_of_a_pipe_are_one_in_any_order_of_pairs() {
        let pieces = parts_of_pipe(12, 0.0, &mut Draws(31));
        let mut pairs = chain(12, true);
        let joined = join_surface_pieces(&pieces, &pairs);
        assert_eq!(joined.surfaces, [0; 12]);
        assert!((joined.primitives[0].radius() - 0.3).abs() < 0.001);
        pairs.reverse();
        assert_eq!(join_surface_pieces(&pieces, &pairs).primitives, joined.primitives);
    }

    #[test]
    fn pipes_that_are_out_of_line_stay_apart() {
        // By eight standard deviations of a point.
        let pieces = parts_of_pipe(4, 0.04, &mut Draws(32));
        assert_eq!(join_surface_pieces(&pieces, &chain(4, true)).surfaces, [0, 1, 2, 3]);
    }

    #[test]
    fn what_has_no_points_in_common_must_be_near() {
        let pieces = parts_of_pipe(4, 0.0, &mut Draws(33));
        assert_eq!(join_surface_pieces(&pieces, &chain(4, false)).surfaces, [0; 4]);
        let pair = |overlap| [PiecePair { first: 0, second: 3, overlap }];
        assert_eq!(join_surface_pieces(&pieces, &pair(false)).surfaces, [0, 1, 2, 3]);
        assert_eq!(join_surface_pieces(&pieces, &[]).surfaces, [0, 1, 2, 3]);
        let nobody = [PiecePair { first: 7, second: 3, overlap: true }];
        assert_eq!(join_surface_pieces(&pieces, &nobody).surfaces, [0, 1, 2, 3]);
        assert!(join_surface_pieces(&[], &[]).surfaces.is_empty());
    }
}
