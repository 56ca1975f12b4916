//! How sure a surface's parameters are.

use super::growth::extent;
use super::primitive::{MOST_PARAMETERS, Primitive, Vector};
use nalgebra::DMatrix;
use rustc_hash::FxHashMap;

/// Blocks along a surface's extent: what errs alike within one must not count as independent.
const BLOCKS: f64 = 6.0;

/// Fewest blocks that tell whether neighbours err alike.
const FEWEST_BLOCKS: usize = 6;

/// Covariance of a surface's parameters, in the order of [`super::primitive::Chart`].
pub(super) struct Uncertainty {
    pub covariance: DMatrix<f64>,
    /// Degrees of freedom behind it, for Student's t.
    pub freedom: f64,
}

/// That of least squares on independent points, times how much more the sums over blocks of neighbours vary than such
/// points' would (never less than once). `None` where the points do not determine the parameters.
pub(super) fn uncertainty(primitive: &Primitive, points: &[Vector]) -> Option<Uncertainty> {
    let parameters = primitive.kind.parameters();
    if points.len() <= parameters {
        return None;
    }
    let chart = primitive.chart();
    let size = extent(points) / BLOCKS;
    let mut normal = DMatrix::<f64>::zeros(parameters, parameters);
    let mut sum = 0.0;
    let mut blocks: FxHashMap<[i64; 3], [f64; MOST_PARAMETERS]> = FxHashMap::default();
    for point in points {
        let (distance, by) = chart.distance_and_derivatives(point);
        sum += distance * distance;
        let key = [point.x, point.y, point.z].map(|c| (c / size).floor() as i64);
        let gradient = blocks.entry(key).or_default();
        for i in 0..parameters {
            gradient[i] += by[i] * distance;
            for j in 0..parameters {
                normal[(i, j)] += by[i] * by[j];
            }
        }
    }
    let inverse = normal.cholesky()?.inverse();
    let freedom = (points.len() - parameters) as f64;
    let independent = sum / freedom * &inverse;
    if blocks.len() < FEWEST_BLOCKS {
        return Some(Uncertainty { covariance: independent, freedom });
    }
    let mut keys: Vec<[i64; 3]> = blocks.keys().copied().collect();
    // In an order of their own, so that sums are the same each time.
    keys.sort_unstable();
    let mut middle = DMatrix::<f64>::zeros(parameters, parameters);
    for key in keys {
        let gradient = nalgebra::DVector::from_column_slice(&blocks[&key][..parameters]);
        middle += &gradient * gradient.transpose();
    }
    let count = blocks.len() as f64;
    let by_blocks = count / (count - 1.0) * &inverse * middle * &inverse;
    let ratio =
        (0..parameters).map(|i| by_blocks[(i, i)] / independent[(i, i)]).sum::<f64>() / parameters as f64;
    Some(Uncertainty { covariance: ratio.max(1.0) * independent, freedom: (count - 1.0).min(freedom) })
}

#[cfg(test)]
mod tests {
    use super::super::least_squares::{EXACT, refine};
    use super::super::primitive::SurfaceKind;
    use super::*;

    const SEED: u64 = 11;

    /// Uniform numbers in 0..1, by the 64-bit mix of SplitMix.
    fn uniform(state: &mut u64) -> f64 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    #[test]
    fn a_cylinders_radius_errs_as_much_as_is_said() {
        println!("seed {SEED}");
        let truth = Primitive {
            kind: SurfaceKind::Cylinder,
            point: Vector::zeros(),
            axis: Vector::z(),
            radius: 1.0,
            major_radius: 0.0,
            half_angle: 0.0,
        };
        let mut state = SEED;
        let (mut squares, draws) = (0.0, 300);
        for _ in 0..draws {
            let points: Vec<Vector> = (0..400)
                .map(|_| {
                    let (turn, height) = (2.0 * uniform(&mut state), 2.0 * uniform(&mut state));
                    let noise: f64 = (0..12).map(|_| uniform(&mut state)).sum::<f64>() - 6.0;
                    let radius = 1.0 + 0.01 * noise;
                    Vector::new(radius * turn.cos(), radius * turn.sin(), height)
                })
                .collect();
            let fitted = refine(truth, &points, 3.0, EXACT).unwrap();
            let said = uncertainty(&fitted.primitive, &points).unwrap();
            squares += (fitted.primitive.radius - 1.0).powi(2) / said.covariance[(4, 4)];
        }
        let deviation = (squares / f64::from(draws)).sqrt();
        assert!((0.85..1.1).contains(&deviation), "{deviation}");
    }
}
