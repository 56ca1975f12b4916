//! Around each place: the large-scale normal, and the support's members pooled about it.

use super::FieldPatches;
use super::support::Support;
use crate::ball::{BallVisitor, DirectWalk};
use crate::cell_index::CellIndex;
use crate::extract::{Extraction, extract_within};
use crate::geometry::axes_across;
use crate::simd::InstructionSet;
use crate::simd::field::{Curved, LANES, Members, Pool, Pooling, along};
use crate::simd::select::Block;
use crate::{Error, ExtractOptions, Monitor, PointCloud, Queries, Radius, Status};
use rayon::prelude::*;

/// Of a patch's radius, within which its axis is fitted.
const AXIS_SHARE: f32 = 0.5;

/// Fewest members of a patch: as many as a paraboloid needs.
const FEWEST: usize = 6;

/// Patches that are made into values together.
const TOGETHER: usize = 8;

/// Rows of queries that a thread takes at a time.
const ROWS: usize = 4;

/// Collects the members of a ball.
struct Patch<'a> {
    /// By their ranks in the index.
    curved: &'a [Curved],
    members: Vec<Members>,
    count: usize,
    pooling: Pooling,
    /// Of the patches that wait to be made into values, and the numbers of their entries.
    pools: Vec<Pool>,
    waiting: Vec<usize>,
}

impl BallVisitor for Patch<'_> {
    const WANTS_RANKS: bool = true;

    fn visit(&mut self, block: &Block, len: usize) {
        for start in (0..len).step_by(LANES) {
            self.members.push(Members::NONE);
            let members = self.members.last_mut().expect("just added");
            for (axis, coordinates) in [&block.x, &block.y, &block.z].into_iter().enumerate() {
                members.place[axis].copy_from_slice(&coordinates[start..start + LANES]);
            }
            for (lane, &rank) in block.rank[start..len.min(start + LANES)].iter().enumerate() {
                members.set(lane, &self.curved[rank as usize]);
            }
        }
        self.count += len;
    }
}

impl Patch<'_> {
    /// The fitted normal, turned to the side of the members' normals near the place.
    fn axis(&self, set: InstructionSet, fitted: [f32; 3]) -> [f32; 3] {
        if along(set, &self.members, &fitted, AXIS_SHARE) < 0.0 { fitted.map(|c| -c) } else { fitted }
    }

    /// Makes the patches that wait into values.
    fn make_values<T>(
        &mut self,
        entries: &mut [Entry<T>],
        set: InstructionSet,
        of_pools: &impl Fn(InstructionSet, &[Pool]) -> Vec<Option<T>>,
    ) {
        let values = of_pools(set, &self.pools);
        for (entry, value) in self.waiting.drain(..).zip(values) {
            entries[entry].value = value;
        }
        self.pools.clear();
    }
}

/// What one query gives.
struct Entry<T> {
    query: u32,
    axis: [f32; 3],
    count: u32,
    value: Option<T>,
}

/// The patches around places, the pools made into values.
pub(super) fn patches<T: Send>(
    support: &Support,
    places: &[[f64; 3]],
    radius: Radius,
    set: InstructionSet,
    monitor: &Monitor,
    of_pools: &(impl Fn(InstructionSet, &[Pool]) -> Vec<Option<T>> + Sync),
    none: &(impl Fn() -> T + Sync),
) -> Result<FieldPatches<T>, Error> {
    let surface = PointCloud::new_f64(&support.positions);
    let ball = Radius::new(radius.get() * f64::from(AXIS_SHARE))?;
    let queries = Queries::Positions(PointCloud::new_f64(places));
    let fitted =
        extract_within(&surface, ball.into(), &queries, &ExtractOptions::default(), &monitor.apart())?;
    let index = CellIndex::of_positions(surface.len(), |i| surface.position(i), radius, monitor)?;
    let curved: Vec<Curved> = index.point_of_rank.iter().map(|&i| support.curved[i as usize]).collect();
    let finite = |i: usize| Some(places[i]).filter(|place| place.iter().all(|c| c.is_finite()));
    let asked = CellIndex::of_positions(places.len(), finite, radius, monitor)?;
    let worker = || {
        let (pools, waiting) = (Vec::with_capacity(TOGETHER), Vec::with_capacity(TOGETHER));
        let (members, pooling) = (Vec::new(), Pooling::new());
        let patch = Patch { curved: &curved, members, count: 0, pooling, pools, waiting };
        (DirectWalk::new(&index, set), patch)
    };
    let entries: Vec<Vec<Entry<T>>> = asked
        .rows
        .par_chunks(ROWS)
        .map_init(worker, |(walk, patch), rows| {
            let mut entries = Vec::new();
            for row in rows {
                monitor.check()?;
                walk.enter_row(row.key);
                for rank in row.start..row.end {
                    let offset = [asked.x[rank], asked.y[rank], asked.z[rank]];
                    walk.enter_run(offset, offset);
                    let query = asked.point_of_rank[rank];
                    entries.push(entry(
                        walk,
                        patch,
                        offset,
                        query,
                        fitted.normals[query as usize],
                        entries.len(),
                    ));
                    if patch.pools.len() == TOGETHER {
                        patch.make_values(&mut entries, set, of_pools);
                    }
                }
                monitor.add(row.end - row.start);
            }
            patch.make_values(&mut entries, set, of_pools);
            Ok(entries)
        })
        .collect::<Result<_, Error>>()?;
    // Places that are not finite are in no row.
    monitor.add(places.len() - asked.len());
    Ok(in_order(entries.into_iter().flatten(), &fitted, none))
}

/// The patch around a place; its pool waits to become the value of the entry with this number.
fn entry<T>(
    walk: &mut DirectWalk<'_>,
    patch: &mut Patch<'_>,
    offset: [f32; 3],
    query: u32,
    fitted: [f32; 3],
    number: usize,
) -> Entry<T> {
    patch.members.clear();
    patch.count = 0;
    walk.visit(offset, patch);
    let count = patch.count;
    let axis = patch.axis(walk.set, fitted);
    if axis[0].is_finite() && count >= FEWEST {
        let [x, y] = axes_across(&axis.into()).map(Into::into);
        patch.pools.push(Pool::ZERO);
        let sums = patch.pools.last_mut().expect("just added");
        patch.pooling.pool(walk.set, &patch.members, count, &[x, y, axis], sums);
        patch.waiting.push(number);
    }
    Entry { query, axis, count: count as u32, value: None }
}

/// The entries in the order of the queries.
fn in_order<T>(
    entries: impl Iterator<Item = Entry<T>>,
    fitted: &Extraction,
    none: &impl Fn() -> T,
) -> FieldPatches<T> {
    let mut of_query: Vec<Option<Entry<T>>> = (0..fitted.len()).map(|_| None).collect();
    for entry in entries {
        let query = entry.query as usize;
        of_query[query] = Some(entry);
    }
    let mut found = FieldPatches {
        values: Vec::with_capacity(fitted.len()),
        axes: Vec::with_capacity(fitted.len()),
        tangents: Vec::with_capacity(fitted.len()),
        count: Vec::with_capacity(fitted.len()),
        status: Vec::with_capacity(fitted.len()),
    };
    for (query, entry) in of_query.into_iter().enumerate() {
        let (axis, count, value) = entry.map_or(([f32::NAN; 3], 0, None), |e| (e.axis, e.count, e.value));
        found.status.push(match (&value, fitted.status[query]) {
            (Some(_), _) => Status::Ok,
            (None, status @ (Status::NotFinite | Status::Degenerate)) => status,
            (None, _) => Status::TooFewPoints,
        });
        found.axes.push(axis);
        let known = axis[0].is_finite();
        found.tangents.push(if known { axes_across(&axis.into())[0].into() } else { [f32::NAN; 3] });
        found.count.push(count);
        found.values.push(value.unwrap_or_else(none));
    }
    found
}
