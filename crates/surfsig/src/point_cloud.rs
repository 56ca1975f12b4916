//! Points as the caller has them: no copy, no loss of precision.

use crate::Error;

/// Coordinates in either precision, borrowed.
///
/// ```
/// let offsets = surfsig::Offsets::F32(&[[1.0, 2.0, 3.0]]);
/// assert_eq!(offsets.len(), 1);
/// ```
#[derive(Debug, Clone, Copy)]
pub enum Offsets<'a> {
    /// What most files and sensors give; half the memory.
    F32(&'a [[f32; 3]]),
    /// Where float32 would lose a millimetre.
    F64(&'a [[f64; 3]]),
}

impl Offsets<'_> {
    /// Number of points.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(points) => points.len(),
            Self::F64(points) => points.len(),
        }
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A point cloud: a float64 origin and offsets from it. Points with a coordinate that is not finite
/// are kept in their places and belong to no neighbourhood.
///
/// ```
/// use surfsig::PointCloud;
/// let cloud = PointCloud::new(&[[0.25_f32, 0.0, 1.0], [f32::NAN, 0.0, 0.0]]).with_origin([500_000.0, 4_500_000.0, 100.0]);
/// assert_eq!(cloud.position(0), Some([500_000.25, 4_500_000.0, 101.0]));
/// assert_eq!(cloud.position(1), None);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct PointCloud<'a> {
    /// Offsets of the points from the origin.
    pub offsets: Offsets<'a>,
    /// Added to each offset.
    pub origin: [f64; 3],
}

impl<'a> PointCloud<'a> {
    /// A cloud of float32 coordinates, with its origin at 0.
    pub fn new(points: &'a [[f32; 3]]) -> Self {
        Self { offsets: Offsets::F32(points), origin: [0.0; 3] }
    }

    /// A cloud of float64 coordinates, with its origin at 0.
    ///
    /// ```
    /// let cloud = surfsig::PointCloud::new_f64(&[[1.0, 2.0, 3.0]]);
    /// assert_eq!(cloud.position(0), Some([1.0, 2.0, 3.0]));
    /// ```
    pub fn new_f64(points: &'a [[f64; 3]]) -> Self {
        Self { offsets: Offsets::F64(points), origin: [0.0; 3] }
    }

    /// The same offsets from another origin.
    ///
    /// ```
    /// let cloud = surfsig::PointCloud::new(&[[1.0, 2.0, 3.0]]).with_origin([10.0, 0.0, 0.0]);
    /// assert_eq!(cloud.position(0), Some([11.0, 2.0, 3.0]));
    /// ```
    pub fn with_origin(self, origin: [f64; 3]) -> Self {
        Self { origin, ..self }
    }

    /// Number of points, those that are not finite included.
    ///
    /// ```
    /// assert_eq!(surfsig::PointCloud::new(&[[f32::NAN; 3]]).len(), 1);
    /// ```
    pub fn len(&self) -> usize {
        self.offsets.len()
    }

    /// Whether there is no point.
    ///
    /// ```
    /// assert!(surfsig::PointCloud::new(&[]).is_empty());
    /// ```
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The coordinates of a point, or `None` where one of them is not finite.
    ///
    /// # Panics
    /// If `index` is outside the cloud.
    ///
    /// ```
    /// let cloud = surfsig::PointCloud::new(&[[0.0, 0.0, f32::INFINITY]]);
    /// assert_eq!(cloud.position(0), None);
    /// ```
    #[inline]
    pub fn position(&self, index: usize) -> Option<[f64; 3]> {
        let offset = match self.offsets {
            Offsets::F32(points) => points[index].map(f64::from),
            Offsets::F64(points) => points[index],
        };
        let position = [0, 1, 2].map(|axis| self.origin[axis] + offset[axis]);
        position.iter().all(|c| c.is_finite()).then_some(position)
    }
}

/// The radius of the ball around a query: finite and above 0.
///
/// ```
/// use surfsig::Radius;
/// assert_eq!(Radius::new(0.02).unwrap().get(), 0.02);
/// assert!(Radius::new(f64::NAN).is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radius(f64);

impl Radius {
    /// Checks a length, in the cloud's own unit.
    ///
    /// # Errors
    /// [`Error::InvalidRadius`] where it is 0, negative or not finite, or outside 1e-18 to 1e18, beyond
    /// which its square leaves float32.
    pub fn new(radius: f64) -> Result<Self, Error> {
        let usable = (1e-18..=1e18).contains(&radius);
        if usable { Ok(Self(radius)) } else { Err(Error::InvalidRadius(radius)) }
    }

    /// The length.
    ///
    /// ```
    /// assert_eq!(surfsig::Radius::new(3.0).unwrap().get(), 3.0);
    /// ```
    pub fn get(self) -> f64 {
        self.0
    }
}
