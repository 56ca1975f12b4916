//! The kinds of surfaces.

/// What a surface is.
///
/// ```
/// assert_eq!(surfsig::SurfaceKind::Torus.name(), "torus");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum SurfaceKind {
    /// A plane.
    Plane = 0,
    /// A sphere.
    Sphere = 1,
    /// A circular cylinder.
    Cylinder = 2,
    /// A circular cone, one nappe of it.
    Cone = 3,
    /// A torus.
    Torus = 4,
}

impl SurfaceKind {
    /// All of them, the simplest first.
    pub const ALL: [Self; 5] = [Self::Plane, Self::Sphere, Self::Cylinder, Self::Cone, Self::Torus];

    /// The name, in lower case.
    pub fn name(self) -> &'static str {
        ["plane", "sphere", "cylinder", "cone", "torus"][self as usize]
    }

    /// Number of parameters.
    pub fn parameters(self) -> usize {
        [3, 4, 5, 6, 7][self as usize]
    }

    /// Which parameter its size is, the radius of most; of a plane its shift.
    pub(super) fn size(self) -> usize {
        [0, 3, 4, 4, 6][self as usize]
    }
}
