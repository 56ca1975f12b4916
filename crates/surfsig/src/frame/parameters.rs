//! Table II: which paraboloids the vocabulary is made of.

use crate::Error;
use crate::curvature::{GRID, MeanCurvatureFormula, Paraboloid, grid_coordinate};
use rayon::prelude::*;

/// A parameter's largest absolute value and its number of levels, end points included.
///
/// ```
/// let slopes = surfsig::Levels { max: 1.0, count: 5 };
/// assert_eq!(slopes.values(), [-1.0, -0.5, 0.0, 0.5, 1.0]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Levels {
    /// The range is from -max to max.
    pub max: f64,
    /// How many values the parameter takes.
    pub count: usize,
}

impl Levels {
    /// The values, exactly symmetric about 0.
    pub fn values(&self) -> Vec<f64> {
        let steps = self.count as f64 - 1.0;
        let value =
            |i: usize| if self.count == 1 { 0.0 } else { self.max * (2.0 * i as f64 - steps) / steps };
        (0..self.count).map(value).collect()
    }
}

/// Most shapes that are searched for a frame: 40 times those of table II.
const MAX_SHAPES: usize = 10_000_000;

/// What a frame is made from; the same parameters always give the same frame.
///
/// All lengths are in patch units, divided by the patch's side D: the frame then serves every size
/// of patch. Table II's ranges at D = 40 mm are 4 for a, b and e, 1 for c and d, 0.5 for f. The
/// ranges are symmetric, and a with b, c with d share theirs, as in table II: the frame's symmetry,
/// which its decomposition uses, rests on that.
///
/// ```
/// use surfsig::{FrameParameters, MeanCurvatureFormula};
/// let printed = FrameParameters::reproduction();
/// assert_eq!(printed.formula, MeanCurvatureFormula::AsPrinted);
/// assert_eq!(printed.quadratic.max / 0.040, 100.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameParameters {
    /// a and b.
    pub quadratic: Levels,
    /// c and d.
    pub slope: Levels,
    /// e.
    pub mixed: Levels,
    /// f.
    pub offset: Levels,
    /// Eq. (4) with the power 3/2, or as printed.
    pub formula: MeanCurvatureFormula,
}

impl Default for FrameParameters {
    /// Table II's ranges, the power 3/2, and nine levels for f.
    fn default() -> Self {
        Self {
            quadratic: Levels { max: 4.0, count: 21 },
            slope: Levels { max: 1.0, count: 5 },
            mixed: Levels { max: 4.0, count: 21 },
            offset: Levels { max: 0.5, count: 9 },
            formula: MeanCurvatureFormula::Corrected,
        }
    }
}

impl FrameParameters {
    /// The frame of the paper's reproduction: eq. (4) as printed and three levels for f, with which
    /// the smallest eigenvalue of F F^T comes closest to the printed 2.5e-4.
    pub fn reproduction() -> Self {
        Self {
            offset: Levels { max: 0.5, count: 3 },
            formula: MeanCurvatureFormula::AsPrinted,
            ..Self::default()
        }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        let ranges = [
            ("quadratic", self.quadratic),
            ("slope", self.slope),
            ("mixed", self.mixed),
            ("offset", self.offset),
        ];
        for (name, Levels { max, count }) in ranges {
            if !(0.0..=1e3).contains(&max) {
                return Err(Error::InvalidFrame(format!(
                    "the range of {name} must be from 0 to 1000, not {max:e}"
                )));
            }
            if !(1..=1001).contains(&count) {
                return Err(Error::InvalidFrame(format!(
                    "the levels of {name} must be 1 to 1001, not {count}"
                )));
            }
        }
        // Beyond, the search takes minutes, and the atoms more than memory holds.
        let shapes = self.quadratic.count.pow(2) * self.slope.count.pow(2) * self.mixed.count;
        if shapes > MAX_SHAPES {
            return Err(Error::InvalidFrame(format!(
                "these levels make {shapes} shapes; at most {MAX_SHAPES} are searched"
            )));
        }
        Ok(())
    }

    /// A name for these parameters that files can carry: 16 hexadecimal digits.
    ///
    /// ```
    /// use surfsig::FrameParameters;
    /// assert_ne!(FrameParameters::default().hash(), FrameParameters::reproduction().hash());
    /// ```
    pub fn hash(&self) -> String {
        // FNV-1a: fixed for ever, on every machine, unlike the standard library's hasher.
        let text = format!("surfsig frame 1, grid {GRID}, {self:?}");
        let hash = text.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        format!("{hash:016x}")
    }

    /// The shapes that stay inside the sphere, each with its admissible offsets f.
    ///
    /// f moves a paraboloid and does not bend it: atoms that differ in f alone have the same
    /// curvature, so a shape is tested once and the f that it admits are an interval.
    pub(super) fn shapes(&self) -> Vec<(Paraboloid, Vec<f64>)> {
        let [quadratic, slope, mixed, offset] =
            [self.quadratic, self.slope, self.mixed, self.offset].map(|levels| levels.values());
        let places = sphere_heights();
        // Parallel over a alone, so that the atoms keep their order.
        let shapes_of = |&a: &f64| {
            let mut shapes = Vec::new();
            for &b in &quadratic {
                for &c in &slope {
                    for &d in &slope {
                        for &e in &mixed {
                            let shape = Paraboloid { a, b, c, d, e, f: 0.0 };
                            let inside = offsets_inside(&shape, &places, &offset);
                            if !inside.is_empty() {
                                shapes.push((shape, inside));
                            }
                        }
                    }
                }
            }
            shapes
        };
        quadratic.par_iter().flat_map_iter(shapes_of).collect()
    }
}

/// The offsets with which a shape stays inside the sphere.
fn offsets_inside(shape: &Paraboloid, places: &[(f64, f64, f64)], offsets: &[f64]) -> Vec<f64> {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for &(x, y, limit) in places {
        let height = shape.height(x, y);
        low = low.max(-limit - height);
        high = high.min(limit - height);
        if low > high {
            return Vec::new();
        }
    }
    offsets.iter().copied().filter(|f| (low..=high).contains(f)).collect()
}

/// For each place of the grid, the height at which the sphere of diameter sqrt(3) D about the patch's
/// centre is met; the outermost places, which exclude most shapes, first.
fn sphere_heights() -> Vec<(f64, f64, f64)> {
    // Many atoms lie exactly on the sphere: without the tolerance, rounding would decide their number.
    let square = 0.75 * (1.0 + 1e-9);
    let mut places: Vec<(f64, f64, f64)> = (0..GRID)
        .flat_map(|column| (0..GRID).map(move |row| (grid_coordinate(column), grid_coordinate(row))))
        .map(|(x, y)| (x, y, (square - x * x - y * y).sqrt()))
        .collect();
    places.sort_by(|p, q| p.2.total_cmp(&q.2));
    places
}
