//! Which points have been seen.

/// Which points have been seen; cleared in no time.
pub(super) struct Stamps {
    stamps: Vec<u32>,
    now: u32,
}

impl Stamps {
    pub fn new(len: usize) -> Self {
        Self { stamps: vec![0; len], now: 0 }
    }

    pub fn clear(&mut self) {
        self.now += 1;
    }

    /// Notes a point; says whether it is new.
    pub fn set(&mut self, point: u32) -> bool {
        let stamp = &mut self.stamps[point as usize];
        let new = *stamp != self.now;
        *stamp = self.now;
        new
    }

    pub fn has(&self, point: u32) -> bool {
        self.stamps[point as usize] == self.now
    }
}
