//! How well halves of an overlap agree about a transform: what blocks of one alignment cannot see.
//!
//! A range bias, a bent calibration, mixed pixels or traffic act alike over large parts of a scan, so that sums over
//! blocks of neighbours are not independent. But near and far points, those on the left and on the right, those seen
//! steeply and those at grazing incidence each give a transform of their own, and these then differ by more than the
//! blocks say.

use nalgebra::{Matrix3, Matrix6, SymmetricEigen, Vector3, Vector6};

/// Of the largest eigenvalue of the normal matrix, below which a direction is not determined.
const UNDETERMINED: f64 = 1e-9;
/// Share of what is known about a direction that either half must have, to be compared.
const LEAST_SHARE: f64 = 0.1;
/// Slabs along each axis of the overlap that alternately belong to one half and to the other.
const SLABS: usize = 8;
/// What the square of a difference between halves adds to a variance: half of it is the square of what either half is
/// off by, and so far off may the whole be, if both are off alike.
const PART: f64 = 0.5;

/// Several divisions of points into halves: of each division, for each point, whether it is in the first half.
///
/// Points are about the sensor, or about their middle where nobody knows it; normals have unit length.
pub(crate) fn halves(points: &[[f64; 3]], normals: &[[f64; 3]]) -> Vec<Vec<bool>> {
    let range: Vec<f64> = points.iter().map(|point| Vector3::from(*point).norm()).collect();
    let incidence = points.iter().zip(normals).zip(&range).map(|((point, normal), range)| {
        Vector3::from(*point).dot(&Vector3::from(*normal)).abs() / range.max(f64::MIN_POSITIVE)
    });
    let incidence: Vec<f64> = incidence.collect();
    let mut found = vec![slabs(&range, 2), slabs(&incidence, 2)];
    let axes = principal_axes(points);
    for axis in axes.column_iter() {
        let along: Vec<f64> = points.iter().map(|point| axis.dot(&Vector3::from(*point))).collect();
        found.extend([slabs(&along, 2), slabs(&along, SLABS)]);
    }
    found
}

/// Whether each value is in a slab of even number, of so many with equally many values.
fn slabs(values: &[f64], count: usize) -> Vec<bool> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut is_even = vec![false; values.len()];
    for (rank, number) in order.into_iter().enumerate() {
        is_even[number] = (rank * count / values.len()).is_multiple_of(2);
    }
    is_even
}

fn principal_axes(points: &[[f64; 3]]) -> Matrix3<f64> {
    let count = points.len().max(1) as f64;
    let middle = points.iter().map(|point| Vector3::from(*point)).sum::<Vector3<f64>>() / count;
    let off = |point: &[f64; 3]| Vector3::from(*point) - middle;
    points
        .iter()
        .map(|point| off(point) * off(point).transpose())
        .sum::<Matrix3<f64>>()
        .symmetric_eigen()
        .eigenvectors
}

/// What halves say in excess of blocks: a covariance to be added to that of a least-squares solution.
///
/// `design` says how each residual changes with the six unknowns; residuals are those of the solution; `block` has the
/// number of the block of each, within which errors are alike.
pub(crate) fn systematic_covariance(
    design: &[[f64; 6]],
    residuals: &[f64],
    halves: &[Vec<bool>],
    block: &[u32],
) -> Matrix6<f64> {
    let rows: Vec<Vector6<f64>> = design.iter().map(|row| Vector6::from(*row)).collect();
    let information = |is_used: &dyn Fn(usize) -> bool| {
        let used = (0..rows.len()).filter(|&i| is_used(i));
        used.map(|i| rows[i] * rows[i].transpose()).sum::<Matrix6<f64>>()
    };
    // W with W^T H W = 1, in the directions that are determined.
    let eigen = information(&|_| true).symmetric_eigen();
    let least = UNDETERMINED * eigen.eigenvalues.amax();
    let mut whitening = Matrix6::zeros();
    for k in (0..6).filter(|&k| eigen.eigenvalues[k] > least) {
        whitening.set_column(k, &(eigen.eigenvectors.column(k) / eigen.eigenvalues[k].sqrt()));
    }
    let mut excess = Matrix6::zeros();
    for half in halves {
        let of_half = whitening.transpose() * information(&|i| half[i]) * whitening;
        let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(of_half);
        for (share, direction) in eigenvalues.iter().zip(eigenvectors.column_iter()) {
            if *share < LEAST_SHARE || *share > 1.0 - LEAST_SHARE {
                continue;
            }
            let change = whitening * direction;
            let mut sums = [BlockSums::default(), BlockSums::default()];
            for (i, row) in rows.iter().enumerate() {
                let part = change.dot(row) * residuals[i];
                sums[usize::from(half[i])].add(block[i], part);
            }
            let of_both = [1.0 - share, *share];
            let difference = sums[1].sum / of_both[1] - sums[0].sum / of_both[0];
            let variance: f64 = (0..2).map(|k| sums[k].square() / of_both[k].powi(2)).sum();
            excess += direction * direction.transpose() * (difference * difference - variance);
        }
    }
    // No direction becomes surer by it.
    let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(excess);
    let part = PART / halves.len().max(1) as f64;
    let grown = Matrix6::from_diagonal(&eigenvalues.map(|value| part * value.max(0.0)));
    let change = whitening * eigenvectors;
    change * grown * change.transpose()
}

/// Sums of parts of a gradient over blocks.
#[derive(Default)]
struct BlockSums {
    sum: f64,
    of_blocks: Vec<f64>,
}

impl BlockSums {
    fn add(&mut self, block: u32, part: f64) {
        let block = block as usize;
        if block >= self.of_blocks.len() {
            self.of_blocks.resize(block + 1, 0.0);
        }
        self.of_blocks[block] += part;
        self.sum += part;
    }

    fn square(&self) -> f64 {
        self.of_blocks.iter().map(|sum| sum * sum).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;

    fn normal(draw: usize, stream: u64) -> f64 {
        (0..12).map(|k| uniform(12 * draw + k, stream)).sum::<f64>() - 6.0
    }

    /// The six faces of a box about its middle, each point with its normal.
    fn faces(count: usize) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
        (0..count)
            .map(|i| {
                let mut point = [0, 1, 2].map(|k| 4.0 * uniform(i, 40 + k) - 2.0);
                let mut normal = [0.0; 3];
                normal[i % 3] = if i % 2 == 0 { 1.0 } else { -1.0 };
                point[i % 3] = 2.0 * normal[i % 3];
                (point, normal)
            })
            .unzip()
    }

    fn design(points: &[[f64; 3]], normals: &[[f64; 3]]) -> Vec<[f64; 6]> {
        let row = |(point, normal): (&[f64; 3], &[f64; 3])| -> [f64; 6] {
            let (p, n) = (Vector3::from(*point), Vector3::from(*normal));
            let torque = p.cross(&n);
            [torque.x, torque.y, torque.z, n.x, n.y, n.z]
        };
        points.iter().zip(normals).map(row).collect()
    }

    /// Residuals that are left after the least-squares solution.
    fn solved(design: &[[f64; 6]], residuals: &[f64]) -> Vec<f64> {
        let rows: Vec<Vector6<f64>> = design.iter().map(|row| Vector6::from(*row)).collect();
        let information: Matrix6<f64> = rows.iter().map(|row| row * row.transpose()).sum();
        let gradient: Vector6<f64> = rows.iter().zip(residuals).map(|(row, r)| row * *r).sum();
        let solution = information.try_inverse().unwrap() * gradient;
        rows.iter().zip(residuals).map(|(row, r)| r - row.dot(&solution)).collect()
    }

    #[test]
    fn what_is_independent_adds_little_and_what_is_bent_adds_its_square() {
        let (points, normals) = faces(3000);
        let design = design(&points, &normals);
        let each: Vec<u32> = (0..3000).collect();
        let divided = halves(&points, &normals);
        assert!(divided.iter().all(|half| half.iter().filter(|&&first| first).count() == 1500));
        // 1000 points a direction: 0.01 / sqrt(1000).
        let independent = 1e-4 / 1000.0;
        let noise = |stream: u64| -> Vec<f64> { (0..3000).map(|i| 0.01 * normal(i, stream)).collect() };
        let streams = 3..23;
        let added = |stream: u64| {
            let residuals = solved(&design, &noise(stream));
            let found = systematic_covariance(&design, &residuals, &divided, &each);
            (3..6).map(|k| found[(k, k)]).sum::<f64>() / 3.0
        };
        let mean = streams.clone().map(added).sum::<f64>() / streams.count() as f64;
        assert!(mean < 0.6 * independent, "{mean}");
        // The far half of each face is 5 mm too far along +x.
        let bent: Vec<f64> = noise(3)
            .iter()
            .zip(&points)
            .zip(&normals)
            .map(|((noise, p), n)| noise + if p[1] > 0.0 { 0.005 * n[0] } else { 0.0 })
            .collect();
        let found = systematic_covariance(&design, &solved(&design, &bent), &divided, &each);
        let deviation = found[(3, 3)].sqrt();
        // The whole is off by 2.5 mm. One division of eight sees it, and each counts for an eighth.
        assert!((0.0005..0.004).contains(&deviation), "{deviation}");
        assert!(found[(5, 5)] < 0.1 * found[(3, 3)], "{found}");
    }

    #[test]
    fn of_nothing_nothing_is_said() {
        assert_eq!(systematic_covariance(&[], &[], &halves(&[], &[]), &[]), Matrix6::zeros());
        let flat = systematic_covariance(
            &[[0.0; 6]; 4],
            &[0.0; 4],
            &halves(&[[1.0; 3]; 4], &[[0.0; 3]; 4]),
            &[0; 4],
        );
        assert_eq!(flat, Matrix6::zeros());
    }
}
