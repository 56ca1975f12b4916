//! The kinds of surfaces, and of curves.

/// What a surface is, or a curve.
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
    /// A circle in space: a curve, which only [`crate::fit_primitive`] fits.
    Circle = 5,
    /// A straight line: a curve, which only [`crate::fit_primitive`] fits.
    Line = 6,
}

impl SurfaceKind {
    /// All surfaces, the simplest first.
    pub const ALL: [Self; 5] = [Self::Plane, Self::Sphere, Self::Cylinder, Self::Cone, Self::Torus];

    /// The curves: a point's distance from one has two components.
    pub const CURVES: [Self; 2] = [Self::Circle, Self::Line];

    /// The name, in lower case.
    pub fn name(self) -> &'static str {
        ["plane", "sphere", "cylinder", "cone", "torus", "circle", "line"][self as usize]
    }

    /// Number of parameters.
    pub fn parameters(self) -> usize {
        [3, 4, 5, 6, 7, 6, 4][self as usize]
    }

    /// Components of a point's distance: two of a curve.
    pub(super) fn components(self) -> usize {
        if Self::CURVES.contains(&self) { 2 } else { 1 }
    }

    /// Which parameter its size is, the radius of most; of a plane or line a shift.
    pub(crate) fn size(self) -> usize {
        [0, 3, 4, 4, 6, 5, 0][self as usize]
    }

    /// Whether a parameter moves the axis or the normal to another direction.
    pub(super) fn is_tilt(self, parameter: usize) -> bool {
        match self {
            Self::Sphere => false,
            Self::Plane => (1..3).contains(&parameter),
            _ => (2..4).contains(&parameter),
        }
    }

    /// Whether its radius alone says how large it is, so that it may be given.
    ///
    /// ```
    /// use surfsig::SurfaceKind;
    /// assert!(SurfaceKind::Circle.has_free_radius() && !SurfaceKind::Torus.has_free_radius());
    /// ```
    pub fn has_free_radius(self) -> bool {
        [Self::Sphere, Self::Cylinder, Self::Circle].contains(&self)
    }
}
