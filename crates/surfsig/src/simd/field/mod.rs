//! The two kernels of field signatures: members of a ball pooled into harmonics ([`pooling`]), and harmonics seen in a
//! frame ([`projection`]).

mod pooling;
mod projection;

pub(crate) use pooling::{Pooling, along};
pub(crate) use projection::{ATOMS, AtomBlock, length, project};

/// Rings of the cylindrical grid, from the axis to the ball's radius.
pub(crate) const RINGS: usize = 5;
/// Heights of the grid, over the ball's diameter.
pub(crate) const HEIGHTS: usize = 6;
/// What is pooled: the normal along the axis, outwards and around; the bend; its difference between the two
/// principal directions, and that times cosine and sine of twice the angle to the outward direction.
pub(crate) const QUANTITIES: usize = 7;
/// Angular Fourier orders, 0 included.
pub(crate) const ORDERS: usize = 8;
/// Cosines of all orders, then sines.
pub(crate) const WAVES: usize = 2 * ORDERS;
/// Numbers that each order has: one complex number per bin and quantity.
pub(crate) const FEATURES: usize = RINGS * HEIGHTS * QUANTITIES;
const _: () = assert!(FEATURES.is_multiple_of(2));

/// What is known at a point of the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curved {
    pub normal: [f32; 3],
    /// Along k1.
    pub direction: [f32; 3],
    /// Of the mean curvature, between -1 and 1.
    pub bend: f32,
    /// Of half the difference between the principal curvatures, between 0 and 1.
    pub difference: f32,
}

/// Members of a ball that are worked with side by side.
pub(crate) const LANES: usize = 16;

/// Some members of a ball: their places from its centre in units of its radius, and what they are. Zeros stand beyond
/// the last.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Members {
    pub place: [[f32; LANES]; 3],
    pub normal: [[f32; LANES]; 3],
    pub direction: [[f32; LANES]; 3],
    pub bend: [f32; LANES],
    pub difference: [f32; LANES],
}

impl Members {
    pub const NONE: Self = Self {
        place: [[0.0; LANES]; 3],
        normal: [[0.0; LANES]; 3],
        direction: [[0.0; LANES]; 3],
        bend: [0.0; LANES],
        difference: [0.0; LANES],
    };

    /// Says what one of them is.
    pub fn set(&mut self, lane: usize, member: &Curved) {
        for axis in 0..3 {
            self.normal[axis][lane] = member.normal[axis];
            self.direction[axis][lane] = member.direction[axis];
        }
        self.bend[lane] = member.bend;
        self.difference[lane] = member.difference;
    }
}

const BINS: usize = RINGS * HEIGHTS;

/// Sums of waves over the members of a ball, for each bin (ring by ring, in each by height) and quantity.
#[derive(Clone)]
#[repr(align(64))]
pub(crate) struct Pool {
    bins: [[[f32; WAVES]; QUANTITIES]; BINS],
    /// Bins that members share, a bit for each; all others are zero.
    occupied: u32,
}

impl Pool {
    pub const ZERO: Self = Self { bins: [[[0.0; WAVES]; QUANTITIES]; BINS], occupied: 0 };

    /// The waves of each feature.
    pub fn features(&self) -> &[[f32; WAVES]; FEATURES] {
        self.bins.as_flattened().try_into().expect("as many as there are")
    }
}
