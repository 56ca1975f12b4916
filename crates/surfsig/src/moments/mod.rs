//! The 35 sums of x^i y^j z^k with i + j + k <= 4: the room that all others open onto.
//!
//! Every least-squares quadric fit, in any frame, can be read off these numbers, and the numbers of
//! two sets of points add.

mod scalar;

pub use scalar::Scalar;

/// Number of monomials of three variables up to order 4.
pub const MOMENTS: usize = 35;

/// Exponents (i, j, k) of the sums, by order, and within an order as 1, x, y, z are multiplied out.
///
/// ```
/// assert_eq!(surfsig::EXPONENTS[4], [2, 0, 0]);
/// assert!(surfsig::EXPONENTS.iter().all(|e| e.iter().sum::<u8>() <= 4));
/// ```
pub const EXPONENTS: [[u8; 3]; MOMENTS] = {
    let mut table = [[0; 3]; MOMENTS];
    let (mut slot, mut order) = (0, 0);
    while order <= 4 {
        let mut i = order as i8;
        while i >= 0 {
            let mut j = order as i8 - i;
            while j >= 0 {
                table[slot] = [i as u8, j as u8, (order as i8 - i - j) as u8];
                slot += 1;
                j -= 1;
            }
            i -= 1;
        }
        order += 1;
    }
    table
};

/// Where the sum of x^i y^j z^k stands.
///
/// ```
/// assert_eq!(surfsig::slot(0, 0, 0), 0);
/// assert_eq!(surfsig::EXPONENTS[surfsig::slot(1, 2, 1)], [1, 2, 1]);
/// ```
pub const fn slot(i: usize, j: usize, k: usize) -> usize {
    let order = i + j + k;
    assert!(order <= 4, "moments stop at order 4");
    // Monomials of lower order, then those with a larger exponent of x, then of y.
    let rest = order - i;
    order * (order + 1) * (order + 2) / 6 + rest * (rest + 1) / 2 + (rest - j)
}

/// The 35 sums of a set of points, about the origin of their coordinates.
///
/// ```
/// use surfsig::Moments;
/// let a = Moments::<f64>::of_points(&[[1.0, 2.0, 3.0]]);
/// let b = Moments::<f64>::of_points(&[[-1.0, 0.0, 1.0]]);
/// let both = a + b;
/// assert_eq!(both.count(), 2.0);
/// assert_eq!(both.get(0, 1, 2), 2.0 * 9.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments<S> {
    /// The sums, in the order of [`EXPONENTS`].
    pub sums: [S; MOMENTS],
}

impl<S: Scalar> Default for Moments<S> {
    fn default() -> Self {
        Self { sums: [S::default(); MOMENTS] }
    }
}

impl<S: Scalar> Moments<S> {
    /// The sums over some points, one after the other: plain and slow, the reference of the kernels.
    pub fn of_points(points: &[[f64; 3]]) -> Self {
        let mut sums = [0.0; MOMENTS];
        for p in points {
            for (sum, e) in sums.iter_mut().zip(EXPONENTS) {
                *sum += (0..3).map(|axis| p[axis].powi(e[axis].into())).product::<f64>();
            }
        }
        Self { sums: sums.map(S::from_f64) }
    }

    /// The sum of x^i y^j z^k.
    ///
    /// # Panics
    /// If i + j + k > 4.
    pub fn get(&self, i: usize, j: usize, k: usize) -> S {
        self.sums[slot(i, j, k)]
    }

    /// Number of points.
    pub fn count(&self) -> S {
        self.sums[0]
    }

    /// The moments of the points A p + t.
    ///
    /// ```
    /// use surfsig::Moments;
    /// let mirror = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    /// let m = Moments::<f64>::of_points(&[[1.0, 2.0, 3.0]]).transformed(&mirror, [0.0, 0.5, 0.0]);
    /// assert_eq!(m.get(1, 1, 0), -2.5);
    /// ```
    pub fn transformed(&self, linear: &[[f64; 3]; 3], translation: [f64; 3]) -> Self {
        // A new monomial is a polynomial of the old coordinates: one affine form times a monomial of
        // one order less, which stands earlier in the table.
        let mut polynomials = [[0.0; MOMENTS]; MOMENTS];
        polynomials[0][0] = 1.0;
        for target in 1..MOMENTS {
            let mut exponents = EXPONENTS[target].map(usize::from);
            let axis = exponents.iter().position(|&e| e > 0).expect("only slot 0 has no factor");
            exponents[axis] -= 1;
            let lower = polynomials[slot(exponents[0], exponents[1], exponents[2])];
            let form = &linear[axis];
            for (term, coefficient) in lower.into_iter().enumerate().filter(|(_, c)| *c != 0.0) {
                polynomials[target][term] += coefficient * translation[axis];
                for (factor, weight) in form.iter().enumerate() {
                    let mut raised = EXPONENTS[term].map(usize::from);
                    raised[factor] += 1;
                    polynomials[target][slot(raised[0], raised[1], raised[2])] += coefficient * weight;
                }
            }
        }
        let sums = self.sums.map(S::to_f64);
        Self { sums: polynomials.map(|p| S::from_f64(p.iter().zip(sums).map(|(c, m)| c * m).sum())) }
    }

    /// The moments of the points p + t.
    ///
    /// ```
    /// use surfsig::Moments;
    /// let m = Moments::<f64>::of_points(&[[1.0, 2.0, 3.0]]).shifted([1.0, 0.0, 0.0]);
    /// assert_eq!(m.get(3, 0, 0), 8.0);
    /// ```
    pub fn shifted(&self, translation: [f64; 3]) -> Self {
        let mut sums = self.sums.map(S::to_f64);
        for (axis, t) in translation.into_iter().enumerate() {
            for (raised, lower) in SHIFT_STEPS[axis] {
                sums[raised] += t * sums[lower];
            }
        }
        Self { sums: sums.map(S::from_f64) }
    }

    /// The moments of the points R p; the rows of R are the new axes.
    ///
    /// ```
    /// use surfsig::Moments;
    /// let quarter_turn = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    /// let m = Moments::<f64>::of_points(&[[1.0, 2.0, 3.0]]).rotated(&quarter_turn);
    /// assert_eq!((m.get(1, 0, 0), m.get(0, 1, 0)), (-2.0, 1.0));
    /// ```
    pub fn rotated(&self, rotation: &[[f64; 3]; 3]) -> Self {
        self.transformed(rotation, [0.0; 3])
    }

    /// The moments of the points s p.
    ///
    /// ```
    /// use surfsig::Moments;
    /// let m = Moments::<f64>::of_points(&[[1.0, 2.0, 3.0]]).scaled(2.0);
    /// assert_eq!(m.get(1, 1, 1), 8.0 * 6.0);
    /// ```
    pub fn scaled(&self, factor: f64) -> Self {
        let square = factor * factor;
        let powers = [1.0, factor, square, square * factor, square * square];
        let mut scaled = *self;
        for (sum, [i, j, k]) in scaled.sums.iter_mut().zip(EXPONENTS) {
            *sum = S::from_f64(sum.to_f64() * powers[usize::from(i + j + k)]);
        }
        scaled
    }
}

/// A shift along one axis as Pascal's triangle makes it: to each sum in turn, t times the one with a factor
/// less is added, first for all exponents down to 1, then down to 2, and so on.
const SHIFT_STEPS: [[(usize, usize); MOMENTS]; 3] = {
    let mut steps = [[(0, 0); MOMENTS]; 3];
    let mut axis = 0;
    while axis < 3 {
        let (mut step, mut last) = (0, 1);
        while last <= 4 {
            let mut exponent = 4;
            while exponent >= last {
                let mut raised = 0;
                while raised < MOMENTS {
                    let e = EXPONENTS[raised];
                    if e[axis] == exponent {
                        let mut lower = [e[0] as usize, e[1] as usize, e[2] as usize];
                        lower[axis] -= 1;
                        steps[axis][step] = (raised, slot(lower[0], lower[1], lower[2]));
                        step += 1;
                    }
                    raised += 1;
                }
                exponent -= 1;
            }
            last += 1;
        }
        assert!(step == MOMENTS);
        axis += 1;
    }
    steps
};

impl<S: Scalar> std::ops::AddAssign for Moments<S> {
    fn add_assign(&mut self, other: Self) {
        for (sum, more) in self.sums.iter_mut().zip(other.sums) {
            *sum += more;
        }
    }
}

impl<S: Scalar> std::ops::Add for Moments<S> {
    type Output = Self;
    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}
