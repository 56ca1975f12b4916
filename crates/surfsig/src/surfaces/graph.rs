//! Which points are next to each other.

use rustc_hash::FxHashMap;

/// Points that are neighbours of each point.
pub(super) const NEIGHBOURS: usize = 12;

/// No neighbour.
pub(super) const NOBODY: u32 = u32::MAX;

/// The nearest neighbours of each point, the nearest first.
pub(super) struct Graph {
    pub neighbours: Vec<[u32; NEIGHBOURS]>,
    /// Distance to the first of them; infinite where there is none.
    pub nearest: Vec<f32>,
}

/// The neighbours of one point, the nearest first, and the distance to the first.
pub(super) struct Neighbours {
    points: [u32; NEIGHBOURS],
    nearest: f32,
}

impl Neighbours {
    /// Every n-th of the nearest points of one, which may itself be among them.
    pub fn of(point: u32, nearest: &[(f64, u32)], stride: usize) -> Self {
        let mut points = [NOBODY; NEIGHBOURS];
        let others = || nearest.iter().filter(|&&(_, other)| other != point);
        points.iter_mut().zip(others().step_by(stride)).for_each(|(slot, &(_, other))| *slot = other);
        Self { points, nearest: others().next().map_or(f32::INFINITY, |(square, _)| square.sqrt() as f32) }
    }
}

impl Graph {
    /// Of so many points without neighbours.
    pub fn unconnected(count: usize) -> Self {
        Self { neighbours: vec![[NOBODY; NEIGHBOURS]; count], nearest: vec![f32::INFINITY; count] }
    }

    /// Gives a point its neighbours.
    pub fn connect(&mut self, point: u32, neighbours: Neighbours) {
        self.neighbours[point as usize] = neighbours.points;
        self.nearest[point as usize] = neighbours.nearest;
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
