//! Which points are next to each other.

use crate::ball::{BallVisitor, DirectWalk};
use crate::cell_index::CellIndex;
use crate::simd::InstructionSet;
use crate::simd::select::Block;
use crate::{Error, Monitor, Radius};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Points that are neighbours of each point.
pub(super) const NEIGHBOURS: usize = 12;

/// Times that the ball is doubled for points that have too few neighbours in it.
const DOUBLINGS: usize = 5;

/// No neighbour.
pub(super) const NOBODY: u32 = u32::MAX;

/// The nearest neighbours of each point, the nearest first.
pub(super) struct Graph {
    pub neighbours: Vec<[u32; NEIGHBOURS]>,
    /// Distance to the first of them; infinite where there is none.
    pub nearest: Vec<f32>,
}

/// A point, and its neighbours: the square of each distance, and its rank.
type Near = (u32, Vec<(f32, u32)>);

/// Remembers the members of a ball by their distance.
#[derive(Default)]
struct Nearest(Vec<(f32, u32)>);

impl BallVisitor for Nearest {
    const WANTS_RANKS: bool = true;

    fn visit(&mut self, block: &Block, len: usize) {
        let square = |i: usize| block.x[i] * block.x[i] + block.y[i] * block.y[i] + block.z[i] * block.z[i];
        self.0.extend((0..len).map(|i| (square(i), block.rank[i])));
    }
}

impl Graph {
    /// Of points within a radius that holds enough for most. A point with a stride has every n-th of its nearest
    /// points for neighbours.
    pub fn new(
        positions: &[[f64; 3]],
        strides: &[u8],
        radius: Radius,
        monitor: &Monitor,
    ) -> Result<Self, Error> {
        let mut graph = Self {
            neighbours: vec![[NOBODY; NEIGHBOURS]; positions.len()],
            nearest: vec![f32::INFINITY; positions.len()],
        };
        let mut left: Vec<u32> = (0..positions.len() as u32).collect();
        let mut size = radius.get();
        for _ in 0..=DOUBLINGS {
            let radius = Radius::new(size)?;
            let index = CellIndex::of_positions(positions.len(), |i| Some(positions[i]), radius, monitor)?;
            let wanted = NEIGHBOURS.min(index.len().saturating_sub(1));
            // Those that are not asked for have no stride.
            let mut asked = vec![0; positions.len()];
            left.iter().for_each(|&i| asked[i as usize] = strides[i as usize]);
            graph.fill(&index, &asked, size as f32, monitor)?;
            left.retain(|&i| wanted > 0 && graph.neighbours[i as usize][wanted - 1] == NOBODY);
            if left.is_empty() {
                break;
            }
            size *= 2.0;
        }
        Ok(graph)
    }

    /// Looks through the balls of the points that are asked for.
    fn fill(&mut self, index: &CellIndex, asked: &[u8], size: f32, monitor: &Monitor) -> Result<(), Error> {
        let set = InstructionSet::detect();
        let rows: Vec<Vec<Near>> = index
            .rows
            .par_chunks(16)
            .map_init(
                || (DirectWalk::new(index, set), Nearest::default()),
                |(walk, nearest), rows| {
                    monitor.check()?;
                    let mut found = Vec::new();
                    for row in rows {
                        for rank in row.start..row.end {
                            let point = index.point_of_rank[rank];
                            let stride = usize::from(asked[point as usize]);
                            if stride == 0 {
                                continue;
                            }
                            let most = NEIGHBOURS * stride;
                            let offset = [index.x[rank], index.y[rank], index.z[rank]];
                            walk.enter_row(row.key);
                            walk.enter_run(offset, offset);
                            nearest.0.clear();
                            walk.visit(offset, nearest);
                            let members = &mut nearest.0;
                            members.retain(|&(_, other)| other as usize != rank);
                            let order =
                                |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
                            if members.len() > most {
                                members.select_nth_unstable_by(most - 1, order);
                                members.truncate(most);
                            }
                            members.sort_unstable_by(order);
                            found.push((point, members.iter().copied().step_by(stride).collect()));
                        }
                    }
                    Ok(found)
                },
            )
            .collect::<Result<_, Error>>()?;
        for (point, members) in rows.into_iter().flatten() {
            let point = point as usize;
            for (slot, (_, rank)) in self.neighbours[point].iter_mut().zip(&members) {
                *slot = index.point_of_rank[*rank as usize];
            }
            if let Some((square, _)) = members.first() {
                self.nearest[point] = size * square.sqrt();
            }
        }
        Ok(())
    }

    /// The graph of all points, if this is that of some, one in each voxel: the others' only neighbour is that one.
    pub fn with_left_out(self, positions: &[[f64; 3]], chosen: &[u32], edge: f64) -> Self {
        let voxel = |i: usize| positions[i].map(|c| (c / edge).floor() as i64);
        let in_voxel: FxHashMap<[i64; 3], u32> = chosen.iter().map(|&i| (voxel(i as usize), i)).collect();
        let mut neighbours: Vec<_> = (0..positions.len())
            .map(|i| {
                let mut only = [NOBODY; NEIGHBOURS];
                only[0] = in_voxel[&voxel(i)];
                only
            })
            .collect();
        for (own, &i) in self.neighbours.iter().zip(chosen) {
            neighbours[i as usize] = own.map(|other| chosen.get(other as usize).copied().unwrap_or(NOBODY));
        }
        let mut nearest = vec![f32::INFINITY; positions.len()];
        self.nearest.iter().zip(chosen).for_each(|(&own, &i)| nearest[i as usize] = own);
        Self { neighbours, nearest }
    }

    /// The neighbours of a point.
    pub fn of(&self, point: u32) -> impl Iterator<Item = u32> + '_ {
        self.neighbours[point as usize].iter().copied().take_while(|&other| other != NOBODY)
    }
}
