//! A thread's work where points are dense: whole regions, through the hierarchy.

use super::extraction::ColumnsPart;
use super::shares::DenseCell;
use super::worker::{Pending, Worker};
use crate::cell_index::CellIndex;
use crate::simd::lanes::LANES;
use crate::{Error, Monitor};

impl Worker<'_> {
    /// Fills a part of the columns with the queries of these cells, one after the other; of one ball around each.
    pub(super) fn extract_region(
        &mut self,
        corner: [i64; 3],
        cells: &[DenseCell],
        parts: &mut [ColumnsPart<'_>],
        monitor: &Monitor,
    ) -> Result<(), Error> {
        let CellIndex { x, y, z, .. } = self.asked;
        let offset = |rank: usize| [x[rank], y[rank], z[rank]];
        self.hierarchical.enter_region(corner);
        let mut first = 0;
        for DenseCell { key, cell, ranks } in cells {
            self.hierarchical.enter_cell(*key, *cell, ranks.clone().map(offset));
            while let Some((patch, queries)) = self.hierarchical.next_patch() {
                monitor.check()?;
                for query in queries.clone() {
                    let number = self.hierarchical.number(query);
                    let rank = ranks.start + number;
                    self.pending.push(Pending {
                        key: *key,
                        offset: offset(rank),
                        patch: Some(patch),
                        entry: first + number,
                        query: self.asked.point_of_rank[rank],
                        radius: 1.0,
                    });
                    let moments = if self.exact() {
                        self.hierarchical.moments::<f64>(patch, offset(rank))
                    } else {
                        self.hierarchical.moments::<f32>(patch, offset(rank))
                    };
                    self.moments[0].push(moments);
                    if self.pending.len() == LANES {
                        self.fit_pending(parts);
                    }
                }
                monitor.add(queries.len());
            }
            first += ranks.len();
        }
        self.fit_pending(parts);
        Ok(())
    }
}
