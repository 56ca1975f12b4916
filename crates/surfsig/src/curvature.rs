//! Curvature of a paraboloid: at its centre, for fits; over the paper's grid, for signatures.

use crate::simd::lanes::{Lanes, Mask};
use crate::tensor::{Axes, Vector, add_scaled, cross, inverted, normalised};

/// Samples along a side of the patch: 40 mm in steps of 4 mm.
pub const GRID: usize = 11;

/// Length of alpha: K on the grid, then H.
pub const ALPHA: usize = 2 * GRID * GRID;

/// Which power of 1 + fx^2 + fy^2 divides the mean curvature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MeanCurvatureFormula {
    /// 3/2: the mean curvature of differential geometry, for which table I holds on a tilted patch too.
    #[default]
    Corrected,
    /// 2: eq. (4) as the paper prints it, for its reproduction.
    AsPrinted,
}

/// z = a x^2 + b y^2 + c x + d y + e x y + f, eq. (5).
///
/// ```
/// use surfsig::{MeanCurvatureFormula, Paraboloid};
/// // A sphere of radius 0.5 at its apex: table I.
/// let cap = Paraboloid { a: 1.0, b: 1.0, ..Paraboloid::default() };
/// assert_eq!(cap.gaussian_curvature(0.0, 0.0), 4.0);
/// assert_eq!(cap.mean_curvature(0.0, 0.0, MeanCurvatureFormula::Corrected), 2.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Paraboloid {
    /// Half the second derivative along x.
    pub a: f64,
    /// Half the second derivative along y.
    pub b: f64,
    /// Slope along x at the centre.
    pub c: f64,
    /// Slope along y at the centre.
    pub d: f64,
    /// Mixed second derivative.
    pub e: f64,
    /// Height at the centre.
    pub f: f64,
}

impl Paraboloid {
    /// The surface in its own axes, x along k1, in patch units for a patch of the given side.
    ///
    /// ```
    /// let p = surfsig::Paraboloid::of_principal_curvatures(25.0, -50.0, 0.040);
    /// assert_eq!((p.a, p.b, p.e), (0.5, -1.0, 0.0));
    /// ```
    pub fn of_principal_curvatures(k1: f32, k2: f32, side: f64) -> Self {
        Self { a: 0.5 * f64::from(k1) * side, b: 0.5 * f64::from(k2) * side, ..Self::default() }
    }

    /// The surface a, b, c, d, e, f in patch units for a patch of the given side.
    ///
    /// ```
    /// let p = surfsig::Paraboloid::of_coefficients([100.0, 0.0, 0.5, 0.0, 25.0, 0.02], 0.040);
    /// assert_eq!((p.a, p.c, p.e), (4.0, 0.5, 1.0));
    /// ```
    pub fn of_coefficients(coefficients: [f32; 6], side: f64) -> Self {
        let [a, b, c, d, e, f] = coefficients.map(f64::from);
        Self { a: a * side, b: b * side, c, d, e: e * side, f: f / side }
    }

    /// The height over (x, y): eq. (5).
    ///
    /// ```
    /// let p = surfsig::Paraboloid { a: 1.0, e: 2.0, f: 0.5, ..Default::default() };
    /// assert_eq!(p.height(1.0, 3.0), 7.5);
    /// ```
    pub fn height(&self, x: f64, y: f64) -> f64 {
        self.a * x * x + self.b * y * y + self.c * x + self.d * y + self.e * x * y + self.f
    }

    /// fx and fy: eqs. (6) and (7).
    ///
    /// ```
    /// let p = surfsig::Paraboloid { a: 1.0, d: 0.25, e: 2.0, ..Default::default() };
    /// assert_eq!(p.slopes(0.5, 0.0), [1.0, 1.25]);
    /// ```
    pub fn slopes(&self, x: f64, y: f64) -> [f64; 2] {
        [
            2.0 * self.a * x + self.c + self.e * y, // Equation (6)
            2.0 * self.b * y + self.d + self.e * x, // Equation (7)
        ]
    }

    /// fxx, fxy, fyy: eqs. (8), (10) and (9), which the paper prints as a second fxx.
    fn second_derivatives(&self) -> [f64; 3] {
        [2.0 * self.a, self.e, 2.0 * self.b]
    }

    /// K over (x, y): eq. (3).
    ///
    /// ```
    /// // A saddle.
    /// let p = surfsig::Paraboloid { a: 1.0, b: -1.0, ..Default::default() };
    /// assert_eq!(p.gaussian_curvature(0.0, 0.0), -4.0);
    /// ```
    pub fn gaussian_curvature(&self, x: f64, y: f64) -> f64 {
        let [fx, fy] = self.slopes(x, y);
        let [fxx, fxy, fyy] = self.second_derivatives();
        (fxx * fyy - fxy * fxy) / (1.0 + fx * fx + fy * fy).powi(2) // Equation (3)
    }

    /// H over (x, y): eq. (4), positive where the surface bends towards +z.
    ///
    /// ```
    /// use surfsig::{MeanCurvatureFormula, Paraboloid};
    /// let tilted = Paraboloid { a: 1.0, b: 1.0, c: 1.0, ..Paraboloid::default() };
    /// let h = tilted.mean_curvature(0.0, 0.0, MeanCurvatureFormula::Corrected);
    /// assert!((h - (2.0 * 2.0 + 2.0) / (2.0 * 2.0_f64.powf(1.5))).abs() < 1e-15);
    /// assert!(h > tilted.mean_curvature(0.0, 0.0, MeanCurvatureFormula::AsPrinted));
    /// ```
    pub fn mean_curvature(&self, x: f64, y: f64, formula: MeanCurvatureFormula) -> f64 {
        let [fx, fy] = self.slopes(x, y);
        let [fxx, fxy, fyy] = self.second_derivatives();
        let metric = 1.0 + fx * fx + fy * fy;
        let power = match formula {
            MeanCurvatureFormula::Corrected => metric * metric.sqrt(),
            MeanCurvatureFormula::AsPrinted => metric * metric,
        };
        // Equation (4)
        ((1.0 + fx * fx) * fyy - 2.0 * fx * fy * fxy + (1.0 + fy * fy) * fxx) / (2.0 * power)
    }

    /// alpha: K and then H on the grid of side 1 about the centre, each read column by column.
    ///
    /// Lengths are in patch units, that is, divided by the patch's side.
    ///
    /// ```
    /// use surfsig::{ALPHA, MeanCurvatureFormula, Paraboloid};
    /// let alpha = Paraboloid::default().curvature_fields(MeanCurvatureFormula::Corrected);
    /// assert_eq!(alpha, [0.0; ALPHA]);
    /// ```
    pub fn curvature_fields(&self, formula: MeanCurvatureFormula) -> [f64; ALPHA] {
        let mut alpha = [0.0; ALPHA];
        for column in 0..GRID {
            for row in 0..GRID {
                let (x, y) = (grid_coordinate(column), grid_coordinate(row));
                alpha[column * GRID + row] = self.gaussian_curvature(x, y);
                alpha[GRID * GRID + column * GRID + row] = self.mean_curvature(x, y, formula);
            }
        }
        alpha
    }
}

/// Where a column or row of the grid stands, in patch units: from -1/2 to 1/2.
pub(crate) fn grid_coordinate(step: usize) -> f64 {
    step as f64 / (GRID - 1) as f64 - 0.5
}

/// What the surface is at the centre of each patch of a batch.
pub(crate) struct Principal {
    /// Larger principal curvature by value; a bump seen from the sensor is positive.
    pub k1: Lanes,
    pub k2: Lanes,
    /// Unit, towards the sensor.
    pub normal: Vector,
    /// Unit, tangent, along k1.
    pub direction: Vector,
}

impl Principal {
    /// Eigen-decomposition of the shape operator s11, s12, s22 in an orthonormal basis of the tangent plane.
    #[inline(always)]
    pub fn of_shape_operator([s11, s12, s22]: [Lanes; 3], t1: &Vector, t2: &Vector, normal: Vector) -> Self {
        let half = Lanes::splat(0.5);
        let mean = half * (s11 + s22);
        let difference = half * (s11 - s22);
        let spread = difference.mul_add(difference, s12 * s12).sqrt();
        // Half the angle of (difference, s12), by the formula that does not cancel.
        let tiny = Lanes::splat(1e-300);
        let long = ((spread + difference.abs() + tiny) / (spread + spread + tiny)).sqrt().min(Lanes::ONE);
        let short = s12 / ((spread + spread) * long + tiny);
        let along_first = Lanes::ZERO.le(difference);
        let downward = s12.lt(Lanes::ZERO);
        let cosine = along_first.select(long, short.abs());
        let sine = along_first.select(short, downward.select(-long, long));
        let direction = add_scaled(&[cosine * t1[0], cosine * t1[1], cosine * t1[2]], sine, t2);
        Self { k1: mean + spread, k2: mean - spread, normal, direction }
    }
}

/// Principal curvatures of a, b, c, d, e, f over the given axes, at the centre.
///
/// The shape operator in an orthonormal basis of the tangent plane, rather than H and K: at
/// umbilics, H^2 - K is a difference of nearly equal numbers.
#[inline(always)]
pub(crate) fn principal_curvatures(
    coefficients: &[Lanes; 6],
    axes: &Axes,
    away_from_sensor: Mask,
) -> Principal {
    let [a, b, p, q, e, _] = *coefficients;
    let (fuu, fuv, fvv) = (a + a, e, b + b); // Equations (8), (10), (9)
    // Metric of the graph and its determinant.
    let (metric_uu, metric_uv, metric_vv) = (p.mul_add(p, Lanes::ONE), p * q, q.mul_add(q, Lanes::ONE));
    let determinant = p.mul_add(p, metric_vv);
    let root = determinant.sqrt();
    // Tangents of the graph over u and v; t1 along the first, t2 at right angles to it.
    let tangent_u = add_scaled(&axes.u, p, &axes.w);
    let upward = normalised(&add_scaled(&add_scaled(&axes.w, -p, &axes.u), -q, &axes.v));
    let t1 = normalised(&tangent_u);
    let t2 = cross(&upward, &t1);
    // Second fundamental form along t1 and t2. The height falls away from the normal on a bump.
    let sign = away_from_sensor.select(Lanes::ONE, -Lanes::ONE);
    let s11 = sign * fuu / (metric_uu * root);
    let s12 = sign * (metric_uu * fuv - metric_uv * fuu) / (metric_uu * determinant);
    let s22 = sign
        * (metric_uu * metric_uu * fvv - (metric_uu + metric_uu) * metric_uv * fuv
            + metric_uv * metric_uv * fuu)
        / (metric_uu * determinant * root);
    Principal::of_shape_operator([s11, s12, s22], &t1, &t2, inverted(&upward, away_from_sensor))
}
