//! How unlike a place is to all others: what is distinctive is found again.

use super::FIELD_SIGNATURE;
use crate::simd::InstructionSet;
use crate::simd::products::{COLUMNS, Panel, ROWS, products};
use crate::{Error, Monitor, Radius, with_threads};
use rayon::prelude::*;

/// Places most like one that count.
const LIKE: usize = 5;

/// Vectors that go along all others at a time, so that these are fetched once for them.
const TOGETHER: usize = 8 * ROWS;

/// The largest products of one vector, in ascending order; -1, of opposite vectors, where there are fewer.
type Largest = [f32; LIKE];

/// The mean distance between the signature of each place and the five most like it, of which all within a radius of
/// the place do not count; 2 stands for those that are missing.
///
/// # Errors
/// [`Error::Threads`]; [`Error::Cancelled`] where the monitor asks to stop.
///
/// # Panics
/// If there is not one place for each vector.
///
/// ```
/// use surfsig::{field_distinctiveness, Monitor, Radius, FIELD_SIGNATURE};
/// let along = |axis: usize| std::array::from_fn(|k| f32::from(k == axis));
/// // Six places alike and one that is like none, far from each other.
/// let vectors: Vec<[f32; FIELD_SIGNATURE]> = (0..7).map(|i| along(i / 6)).collect();
/// let places: Vec<[f64; 3]> = (0..7).map(|i| [f64::from(i), 0.0, 0.0]).collect();
/// let found = field_distinctiveness(&vectors, &places, Radius::new(0.5)?, None, &Monitor::default())?;
/// assert_eq!(found[0], 0.0);
/// assert!((found[6] - 2_f32.sqrt()).abs() < 1e-6);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn field_distinctiveness(
    vectors: &[[f32; FIELD_SIGNATURE]],
    places: &[[f64; 3]],
    radius: Radius,
    threads: Option<usize>,
    monitor: &Monitor,
) -> Result<Vec<f32>, Error> {
    let all: Vec<usize> = (0..vectors.len()).collect();
    with_threads(threads, || distinctiveness(vectors, places, &all, radius, monitor))?
}

/// The same, on the threads that are there, where only some places are compared with each: they have numbers.
pub(super) fn distinctiveness(
    vectors: &[[f32; FIELD_SIGNATURE]],
    places: &[[f64; 3]],
    among: &[usize],
    radius: Radius,
    monitor: &Monitor,
) -> Result<Vec<f32>, Error> {
    assert_eq!(vectors.len(), places.len(), "one place for each vector");
    let set = InstructionSet::detect();
    let apart = |a: usize, b: usize| {
        (0..3).map(|axis| (places[a][axis] - places[b][axis]).powi(2)).sum::<f64>() >= radius.get().powi(2)
    };
    let counted = LIKE.min(among.len());
    let unlike = |largest: &Largest| {
        let distances =
            largest[LIKE - counted..].iter().map(|&product| (2.0 - 2.0 * product).max(0.0).sqrt());
        distances.sum::<f32>() / counted as f32
    };
    let compared: Vec<[f32; FIELD_SIGNATURE]> = among.iter().map(|&other| vectors[other]).collect();
    let panels: Vec<Panel<FIELD_SIGNATURE>> = compared.par_chunks(COLUMNS).map(Panel::of).collect();
    let found: Vec<Vec<f32>> = (0..vectors.len())
        .into_par_iter()
        .step_by(TOGETHER)
        .map(|start| {
            monitor.check()?;
            let mut largest = [[-1.0; LIKE]; TOGETHER];
            for (panel, others) in panels.iter().zip((0..).step_by(COLUMNS)) {
                for first in (start..vectors.len().min(start + TOGETHER)).step_by(ROWS) {
                    // Beyond the last vector stands the last once more, and is not looked at.
                    let rows = std::array::from_fn(|r| &vectors[(first + r).min(vectors.len() - 1)]);
                    for (r, products) in products(set, &rows, panel).iter().enumerate() {
                        let place = first + r;
                        if place < vectors.len() {
                            keep_largest(&mut largest[place - start], products, |c| {
                                among.get(others + c).is_some_and(|&other| apart(place, other))
                            });
                        }
                    }
                }
            }
            let count = TOGETHER.min(vectors.len() - start);
            Ok(largest[..count].iter().map(unlike).collect())
        })
        .collect::<Result<_, Error>>()?;
    Ok(found.concat())
}

/// Takes in those products that count.
fn keep_largest(largest: &mut Largest, products: &[f32; COLUMNS], counts: impl Fn(usize) -> bool) {
    if !products.iter().fold(false, |any, &product| any | (product > largest[0])) {
        return;
    }
    for (column, &product) in products.iter().enumerate() {
        if product > largest[0] && counts(column) {
            let place = largest.partition_point(|&other| other < product);
            largest.copy_within(1..place, 0);
            largest[place - 1] = product;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_five_most_alike_beyond_the_radius_count() {
        let number = |i: usize, k: usize| ((i * i + 1) as f32 * (k + 1) as f32 * 0.0137).sin();
        let vectors: Vec<[f32; FIELD_SIGNATURE]> = (0..150)
            .map(|i| {
                let raw: [f32; FIELD_SIGNATURE] = std::array::from_fn(|k| number(i, k));
                let length = raw.iter().map(|v| v * v).sum::<f32>().sqrt();
                raw.map(|v| v / length)
            })
            .collect();
        let places: Vec<[f64; 3]> = (0..150).map(|i| [0, 1, 2].map(|a| f64::from(number(i, a)))).collect();
        for (count, step) in [(1, 1), (4, 1), (150, 1), (150, 7)] {
            let (vectors, places) = (&vectors[..count], &places[..count]);
            let radius = Radius::new(0.5).unwrap();
            let among: Vec<usize> = (0..count).step_by(step).collect();
            let found = match step {
                1 => field_distinctiveness(vectors, places, radius, Some(2), &Monitor::default()),
                _ => distinctiveness(vectors, places, &among, radius, &Monitor::default()),
            };
            let found = found.unwrap();
            for i in 0..count {
                let mut distances: Vec<f64> = among
                    .iter()
                    .map(|&j| {
                        let apart =
                            (0..3).map(|a| (places[i][a] - places[j][a]).powi(2)).sum::<f64>() >= 0.25;
                        let product = vectors[i].iter().zip(&vectors[j]).map(|(a, b)| a * b).sum::<f32>();
                        if apart { (2.0 - 2.0 * f64::from(product)).max(0.0).sqrt() } else { 2.0 }
                    })
                    .collect();
                distances.sort_by(f64::total_cmp);
                let nearest = &distances[..LIKE.min(count)];
                let expected = nearest.iter().sum::<f64>() / nearest.len() as f64;
                assert!((f64::from(found[i]) - expected).abs() < 1e-4, "{count} {i}");
            }
        }
    }
}
