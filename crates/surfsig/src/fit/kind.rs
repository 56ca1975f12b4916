//! Which surface is fitted.

/// The surface that is fitted to the points of a neighbourhood.
///
/// ```
/// use surfsig::{extract, ExtractOptions, FitKind, FitUsed, PointCloud, Radius};
/// // A whole sphere of radius 1, and a ball that reaches past half of it.
/// let golden = std::f64::consts::PI * (3.0 - 5_f64.sqrt());
/// let points: Vec<[f64; 3]> = (0..900)
///     .map(|i| (1.0 - (2.0 * f64::from(i) + 1.0) / 900.0, golden * f64::from(i)))
///     .map(|(z, turn)| [(1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z])
///     .collect();
/// let options = ExtractOptions { fit: FitKind::Auto, viewpoint: Some([0.0, 0.0, 9.0]), ..Default::default() };
/// let found = extract(&PointCloud::new_f64(&points), Radius::new(1.2)?, &options)?;
/// assert_eq!(found.fit_used[0], FitUsed::Quadric);
/// assert!((found.k1[0] - 1.0).abs() < 1e-5 && (found.k2[0] - 1.0).abs() < 1e-5);
/// # Ok::<(), surfsig::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FitKind {
    /// The paper's paraboloid, eq. (5): the smallest spread, and a bias where the ball is not small against
    /// the radius of curvature.
    #[default]
    Paraboloid,
    /// A general quadric with Taubin's normalisation: exact on spheres, cylinders, cones and ellipsoids of any
    /// size, where they rise out of the noise; the paraboloid elsewhere.
    Quadric,
    /// For each point what errs less: the quadric only where the paraboloid's bias is larger than its error.
    Auto,
}

/// The surface whose curvature a point has.
///
/// ```
/// assert_eq!(surfsig::FitUsed::Quadric as u8, 2);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum FitUsed {
    /// There is no curvature.
    None = 0,
    /// The paraboloid's.
    Paraboloid = 1,
    /// The implicit quadric's.
    Quadric = 2,
}
