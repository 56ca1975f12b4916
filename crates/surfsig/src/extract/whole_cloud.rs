//! A part of a cloud, with the values of the whole cloud.

use super::auto_radius::{check_auto, run_auto};
use super::neighborhood::NearestDistances;
use super::{ExtractOptions, Extraction, Neighborhood, Queries, check, extract_within, run_nearest};
use crate::threads::with_threads;
use crate::{Error, Monitor, PointCloud, Resolution};

/// By how much a neighbourhood may reach beyond its radius, in radii: the slack of a ball's test (5e-6), and the
/// rounding of offsets (5e-7), with room to spare.
const SLACK: f64 = 1e-4;

/// What an extraction takes from a whole cloud besides each query's neighbours.
///
/// With it, a part of the cloud gives the whole cloud's values, bit by bit, where the part's points come in the order
/// of the whole cloud's.
#[derive(Debug, Clone, PartialEq)]
pub struct WholeCloud {
    /// The steps of its coordinates.
    pub resolution: Resolution,
    /// How far its neighbours are; only looked at where neighbourhoods are no balls of one radius.
    pub nearest: NearestDistances,
    /// The lowest and the highest corner of the box in which the part has all points of the whole cloud.
    pub complete: [[f64; 3]; 2],
}

impl WholeCloud {
    /// Whether the part has all points within a distance of a place.
    fn has_all(&self, place: [f64; 3], distance: f64) -> bool {
        let distance = distance * (1.0 + SLACK);
        (0..3).all(|axis| {
            // Beyond an infinite corner is nothing, however far is looked.
            let [low, high] = [self.complete[0][axis], self.complete[1][axis]];
            (low == f64::NEG_INFINITY || place[axis] - distance >= low)
                && (high == f64::INFINITY || place[axis] + distance <= high)
        })
    }
}

/// How large the neighbourhoods of a part of a cloud are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PartSize {
    /// As in [`extract`](super::extract()).
    Of(Neighborhood),
    /// As in [`extract_auto_radius`](super::extract_auto_radius()).
    Auto,
}

/// Curvature at places of a part of a cloud, as the whole cloud has it; and the numbers of the queries that looked
/// beyond what the part has of the whole cloud, whose values may differ from the whole cloud's.
///
/// # Errors
/// As [`extract_monitored`](super::extract_monitored()) and [`extract_auto_radius`](super::extract_auto_radius()).
///
/// ```
/// use surfsig::*;
/// let points: Vec<[f32; 3]> = (0..900).map(|i| [(i % 30) as f32, (i / 30) as f32, 0.0]).collect();
/// let cloud = PointCloud::new(&points);
/// let whole = WholeCloud {
///     resolution: Resolution::of(&cloud),
///     nearest: NearestDistances { distances: vec![2.0], largest: 29.0 },
///     complete: [[f64::NEG_INFINITY; 3], [f64::INFINITY, 14.0, f64::INFINITY]],
/// };
/// let part = PointCloud::new(&points[..450]);
/// let size = PartSize::Of(Radius::new(2.5)?.into());
/// let (found, incomplete) =
///     extract_part(&part, size, &Queries::All, &ExtractOptions::default(), &whole, &Monitor::default())?;
/// assert_eq!(found.count[11 * 30 + 15], 21);
/// assert_eq!(incomplete.first(), Some(&(12 * 30)));
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn extract_part(
    part: &PointCloud<'_>,
    size: PartSize,
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
    whole: &WholeCloud,
    monitor: &Monitor,
) -> Result<(Extraction, Vec<usize>), Error> {
    match size {
        PartSize::Of(neighborhood) => {
            neighborhood.check()?;
            check(part, queries, options)?;
        }
        PartSize::Auto => check_auto(part, queries, options)?,
    }
    let (mut found, mut reach) = with_threads(options.threads, || match size {
        PartSize::Auto => run_auto(part, &whole.nearest, queries, options, monitor),
        PartSize::Of(Neighborhood::Nearest(k)) => {
            run_nearest(part, k, whole.nearest.first_radius()?, queries, options, monitor)
        }
        PartSize::Of(neighborhood @ (Neighborhood::Ball(radius) | Neighborhood::Hybrid { radius, .. })) => {
            let found = extract_within(part, neighborhood, queries, options, monitor)?;
            let reach = vec![radius.get(); found.len()];
            Ok((found, reach))
        }
    })??;
    if let PartSize::Of(Neighborhood::Nearest(k)) = size {
        // A part with fewer points than are wanted says nothing of where the others are.
        if (0..part.len()).filter_map(|i| part.position(i)).take(k).count() < k {
            reach.fill(f64::INFINITY);
        }
    }
    found.mark_too_coarse(&whole.resolution, part, queries);
    let places = queries.positions(part).zip(reach).enumerate();
    let beyond = places.filter(|(_, (place, reach))| !place[0].is_nan() && !whole.has_all(*place, *reach));
    Ok((found, beyond.map(|(query, _)| query).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Radius, extract_auto_radius, extract_monitored};

    /// A wavy surface, denser towards one side.
    fn surface() -> Vec<[f64; 3]> {
        let number = |i: usize| ((i as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0);
        (0..6000)
            .map(|i| (8.0 * number(2 * i).powi(2), 4.0 * number(2 * i + 1), number(3 * i + 7)))
            .map(|(x, y, noise)| [x, y, 0.3 * (1.3 * x).sin() * (0.9 * y).cos() + 0.004 * noise])
            .collect()
    }

    fn bits(found: &Extraction, query: usize) -> Vec<u32> {
        let numbers =
            [found.k1[query], found.k2[query], found.residual[query], found.radius_of(query) as f32];
        let more = [found.condition[query], found.k1_std[query], found.planarity[query]];
        let vectors = found.normals[query].into_iter().chain(found.directions[query]);
        numbers.into_iter().chain(more).chain(vectors).map(f32::to_bits).chain([found.count[query]]).collect()
    }

    #[test]
    fn a_part_has_the_bits_of_the_whole_or_says_that_it_looked_beyond() {
        let points = surface();
        let cloud = PointCloud::new_f64(&points);
        let (options, monitor) = (ExtractOptions::default(), Monitor::default());
        let sizes = [
            PartSize::Of(Radius::new(0.3).unwrap().into()),
            PartSize::Of(Neighborhood::Nearest(24)),
            PartSize::Of(Neighborhood::Hybrid { radius: Radius::new(0.3).unwrap(), most: 20 }),
            PartSize::Auto,
        ];
        let numbers: Vec<usize> =
            (0..points.len()).filter(|&i| (2.0..=5.5).contains(&points[i][0])).collect();
        let some: Vec<[f64; 3]> = numbers.iter().map(|&i| points[i]).collect();
        let (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
        for size in sizes {
            let (all, k) = match size {
                PartSize::Auto => {
                    let all = extract_auto_radius(&cloud, &Queries::All, &options, &monitor);
                    (all, crate::FEWEST_AUTO_POINTS as usize)
                }
                PartSize::Of(size) => {
                    (extract_monitored(&cloud, size, &Queries::All, &options, &monitor), 24)
                }
            };
            let all = all.unwrap();
            let whole = WholeCloud {
                resolution: Resolution::of(&cloud),
                nearest: NearestDistances::of(&cloud, k, &monitor).unwrap(),
                complete: [[2.0, low, low], [5.5, high, high]],
            };
            let part = PointCloud::new_f64(&some);
            let (found, beyond) =
                extract_part(&part, size, &Queries::All, &options, &whole, &monitor).unwrap();
            assert!(beyond.len() < some.len() * 9 / 10, "{size:?}: {} of {}", beyond.len(), some.len());
            for query in (0..some.len()).filter(|query| beyond.binary_search(query).is_err()) {
                assert_eq!(bits(&found, query), bits(&all, numbers[query]), "{size:?}, query {query}");
            }
            let differ = (0..some.len()).any(|query| bits(&found, query) != bits(&all, numbers[query]));
            assert!(differ, "{size:?}: what is beyond the part changes nothing");
        }
    }
}
