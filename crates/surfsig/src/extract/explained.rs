//! How well the surface of a larger ball explains what a smaller one around the same query shows.

use super::Extraction;
use crate::fit::FitUsed;

/// Standard errors by which curvatures may differ without saying anything.
const SAME: f64 = 3.0;

/// Of a difference's variance, the share that remains where theory says that two balls say exactly the same.
const LEAST_VARIANCE: f64 = 0.1;

/// A bias in the square, in squares of its difference from that of the next smaller ball: where it grows as the
/// square of the radius, and a radius is the square root of two of the last, the difference is half of it.
const BIAS: f64 = 4.0;

/// Noise is not everywhere the same: its variance may be so much larger where a ball grows to.
const ROUGHER: f64 = 1.5;

/// Deviations of a mean square that chance may make: of 16 points a fiftieth to five times what is expected.
const CHANCE: f64 = 4.5;

/// Distances, in radii, that rounding alone makes.
const ROUNDING: f64 = 1e-6;

/// What a ball shows.
pub(super) struct Shown {
    normal: [f64; 3],
    direction: [f64; 3],
    /// k1 and k2, their variances, and that of their mean.
    curvatures: [f64; 2],
    variances: [f64; 2],
    pub variance_of_mean: f64,
    /// Of the points' distances from the surface: the sum of squares, and its degrees of freedom.
    squares: f64,
    freedom: f64,
}

impl Shown {
    pub fn of(ball: &Extraction, place: usize) -> Self {
        let count = f64::from(ball.count[place]);
        let quadric = ball.fit_used.get(place) == Some(&FitUsed::Quadric);
        let square = |value: f32| f64::from(value) * f64::from(value);
        Self {
            normal: ball.normals[place].map(f64::from),
            direction: ball.directions[place].map(f64::from),
            curvatures: [ball.k1[place], ball.k2[place]].map(f64::from),
            variances: [square(ball.k1_std[place]), square(ball.k2_std[place])],
            variance_of_mean: square(ball.mean_curvature_std[place]),
            squares: count * (square(ball.residual[place]) + (ROUNDING * ball.radius).powi(2)),
            freedom: count - if quadric { 9.0 } else { 6.0 },
        }
    }

    fn noise_square(&self) -> f64 {
        self.squares / self.freedom
    }

    /// The mean square that points farther out may have.
    pub fn noise_square_at_most(&self) -> f64 {
        ROUGHER * self.noise_square() / relative_mean_square(self.freedom, -CHANCE)
    }

    /// Whether the points that have come since a smaller ball are as near to the surface as `at_most` allows.
    pub fn is_as_smooth(&self, smaller: &Self, at_most: f64) -> bool {
        let (squares, freedom) = (self.squares - smaller.squares, self.freedom - smaller.freedom);
        freedom <= 0.0 || squares / freedom <= at_most * relative_mean_square(freedom, CHANCE)
    }

    /// An estimate of the squared bias: by how much curvature differs from the next smaller ball's beyond what
    /// chance explains, the larger of the mean's and those along the principal directions.
    ///
    /// The smaller ball's points are some of this one's: the difference of two such least-squares estimates has
    /// the difference of their variances (Hausman).
    pub fn bias_square(&self, smaller: &Self) -> f64 {
        // Seen from the other side, curvatures change their sign.
        let side = if dot(&self.normal, &smaller.normal) < 0.0 { -1.0 } else { 1.0 };
        let [k1, k2] = smaller.curvatures.map(|k| side * k);
        let cosine_square = dot(&self.direction, &smaller.direction).powi(2).min(1.0);
        let sine_square = 1.0 - cosine_square;
        // Both have the larger ball's noise, which is known better.
        let noise = self.noise_square() / smaller.noise_square();
        let smaller_variance = 0.5 * (smaller.variances[0] + smaller.variances[1]);
        let excess = |mine: f64, my_variance: f64, theirs: f64, their_variance: f64| {
            let their_variance = noise * their_variance;
            let of_difference = (their_variance - my_variance).max(LEAST_VARIANCE * their_variance);
            (mine - theirs).powi(2) - SAME * SAME * of_difference
        };
        let [my_k1, my_k2] = self.curvatures;
        let along_k1 = cosine_square * k1 + sine_square * k2;
        let along_k2 = sine_square * k1 + cosine_square * k2;
        let mean =
            excess(0.5 * (my_k1 + my_k2), self.variance_of_mean, 0.5 * (k1 + k2), smaller.variance_of_mean);
        let first = excess(my_k1, self.variances[0], along_k1, smaller_variance);
        let second = excess(my_k2, self.variances[1], along_k2, smaller_variance);
        BIAS * mean.max(first).max(second).max(0.0)
    }
}

/// A mean square of normal numbers, in units of what is expected, that chance passes by so many deviations
/// (Wilson and Hilferty's approximation of chi-square).
fn relative_mean_square(freedom: f64, deviations: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    (1.0 - spread + deviations * spread.sqrt()).max(0.1).powi(3)
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|axis| a[axis] * b[axis]).sum()
}
