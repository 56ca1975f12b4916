//! The frame, for Python.

use crate::all_cores::on_all_cores;
use crate::to_python;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use surfsig::{FrameParameters, Levels, MeanCurvatureFormula, Paraboloid, SIGNATURE, Status};

/// A vocabulary of curvature fields (section II of the paper), and its inverse.
///
/// All lengths are in patch units, that is, divided by the patch's side D (twice the radius of
/// an extraction); one frame serves every size of patch.
///
/// Parameters
/// ----------
/// quadratic, slope, mixed, offset : tuple of (float, int), optional
///     Largest absolute value and number of levels, end points included, of a and b, of c and d, of
///     e, and of f in eq. (5); by default table II's ranges with 21, 5, 21 and 9 levels.
/// as_printed : bool
///     Eq. (4) with the power 2, as the paper prints it, in place of 3/2.
///
/// Raises
/// ------
/// InvalidInputError
///     If a range has no meaning, or if the atoms fail the check of section II.A: an eigenvalue of
///     F F^T is zero.
#[pyclass(frozen, module = "surfsig")]
pub struct Frame {
    frame: Held,
}

/// The default frame is made once for the process; others belong to their Python object.
enum Held {
    Shared(&'static surfsig::Frame),
    Own(Box<surfsig::Frame>),
}

impl Frame {
    fn get(&self) -> &surfsig::Frame {
        match &self.frame {
            Held::Shared(frame) => frame,
            Held::Own(frame) => frame,
        }
    }

    fn own(py: Python<'_>, parameters: FrameParameters) -> PyResult<Self> {
        let frame = on_all_cores(py, || surfsig::Frame::new(parameters))?.map_err(to_python)?;
        Ok(Self { frame: Held::Own(Box::new(frame)) })
    }
}

/// Signatures as rows, and a status for each.
type Rows<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<u8>>);

/// NumPy allocates the rows: it asks the system for large pages, which saves half the time.
fn rows<'py>(
    py: Python<'py>,
    len: usize,
    fill: impl FnOnce(&mut [[f32; SIGNATURE]], &mut [Status]) + Send,
) -> PyResult<Rows<'py>> {
    let array = PyArray2::<f32>::zeros(py, [len, SIGNATURE], false);
    let mut statuses = vec![Status::Ok; len];
    {
        let mut filled = array.readwrite();
        let (rows, _) = filled.as_slice_mut()?.as_chunks_mut::<SIGNATURE>();
        on_all_cores(py, || fill(rows, &mut statuses))?;
    }
    let numbers: Vec<u8> = statuses.into_iter().map(|status| status as u8).collect();
    Ok((array, numbers.into_pyarray(py)))
}

fn check_side(side: f64) -> PyResult<()> {
    if side.is_finite() && side > 0.0 {
        return Ok(());
    }
    Err(crate::invalid_input(&format!("side must be a finite number above 0, not {side:e}")))
}

fn paraboloid(surface: [f64; 6]) -> Paraboloid {
    let [a, b, c, d, e, f] = surface;
    Paraboloid { a, b, c, d, e, f }
}

#[pymethods]
impl Frame {
    #[new]
    #[pyo3(signature = (*, quadratic=None, slope=None, mixed=None, offset=None, as_printed=false))]
    fn new(
        py: Python<'_>,
        quadratic: Option<(f64, i64)>,
        slope: Option<(f64, i64)>,
        mixed: Option<(f64, i64)>,
        offset: Option<(f64, i64)>,
        as_printed: bool,
    ) -> PyResult<Self> {
        let default = FrameParameters::default();
        let chosen = |given: Option<(f64, i64)>, default: Levels| {
            // What is below 0 is refused like 0.
            given.map_or(default, |(max, count)| Levels { max, count: count.max(0) as usize })
        };
        let parameters = FrameParameters {
            quadratic: chosen(quadratic, default.quadratic),
            slope: chosen(slope, default.slope),
            mixed: chosen(mixed, default.mixed),
            offset: chosen(offset, default.offset),
            formula: if as_printed { MeanCurvatureFormula::AsPrinted } else { default.formula },
        };
        Self::own(py, parameters)
    }

    /// The frame of the default parameters: table II, the power 3/2, 9,159 atoms. Made once.
    ///
    /// Returns
    /// -------
    /// Frame
    #[staticmethod]
    fn default(py: Python<'_>) -> PyResult<Self> {
        Ok(Self { frame: Held::Shared(on_all_cores(py, surfsig::Frame::shared)?) })
    }

    /// The frame of the paper's reproduction: table II, eq. (4) as printed, 3,109 atoms, smallest
    /// eigenvalue of F F^T 2.37e-4 in metres (the paper: about 2.5e-4).
    ///
    /// Returns
    /// -------
    /// Frame
    #[staticmethod]
    fn reproduction(py: Python<'_>) -> PyResult<Self> {
        Self::own(py, FrameParameters::reproduction())
    }

    fn __len__(&self) -> usize {
        self.get().len()
    }

    fn __repr__(&self) -> String {
        format!("Frame({} atoms, hash={})", self.get().len(), self.get().parameters().hash())
    }

    /// A name for the frame's parameters that files can carry: 16 hexadecimal digits.
    #[getter]
    fn hash(&self) -> String {
        self.get().parameters().hash()
    }

    /// Whether eq. (4) is used as printed, with the power 2 in place of 3/2.
    #[getter]
    fn as_printed(&self) -> bool {
        self.get().parameters().formula == MeanCurvatureFormula::AsPrinted
    }

    /// The atoms' a, b, c, d, e, f of eq. (5) in patch units: (n, 6) float64.
    #[getter]
    fn atoms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let atoms: Vec<f64> = self.get().atoms().flat_map(|p| [p.a, p.b, p.c, p.d, p.e, p.f]).collect();
        PyArray1::from_vec(py, atoms).reshape([self.get().len(), 6])
    }

    /// Singular values of F in patch units, descending: (242,) float64.
    #[getter]
    fn singular_values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.get().singular_values().collect::<Vec<_>>().into_pyarray(py)
    }

    /// Smallest eigenvalue of F F^T: how well the frame tells curvature fields apart.
    ///
    /// Parameters
    /// ----------
    /// side : float
    ///     Of the patch, with curvature per unit of its own length; 1.0 gives it in patch units.
    ///
    /// Returns
    /// -------
    /// float
    ///
    /// Raises
    /// ------
    /// InvalidInputError
    ///     If the side is not a finite number above 0.
    fn smallest_eigenvalue(&self, side: f64) -> PyResult<f64> {
        check_side(side)?;
        Ok(self.get().smallest_eigenvalue(side))
    }

    /// alpha, the curvature fields of a surface.
    ///
    /// Parameters
    /// ----------
    /// surface : sequence of float
    ///     a, b, c, d, e, f of eq. (5) in patch units.
    ///
    /// Returns
    /// -------
    /// (242,) float64
    ///     K on the 11 x 11 grid column by column, then H.
    fn curvature_fields<'py>(&self, py: Python<'py>, surface: [f64; 6]) -> Bound<'py, PyArray1<f64>> {
        let formula = self.get().parameters().formula;
        paraboloid(surface).curvature_fields(formula).to_vec().into_pyarray(py)
    }

    /// c = pinv(F) alpha, eq. (2). Its lengths and dot products are those of the 242 numbers of a
    /// signature.
    ///
    /// Parameters
    /// ----------
    /// surface : sequence of float
    ///     a, b, c, d, e, f of eq. (5) in patch units.
    ///
    /// Returns
    /// -------
    /// (n,) float64
    ///     One number per atom, in the order of `atoms`.
    fn coefficients<'py>(&self, py: Python<'py>, surface: [f64; 6]) -> Bound<'py, PyArray1<f64>> {
        py.detach(|| self.get().coefficients(&paraboloid(surface))).into_pyarray(py)
    }

    /// Signatures of surfaces in their own axes.
    ///
    /// Parameters
    /// ----------
    /// k1, k2 : (m,) float32
    ///     Principal curvatures, per unit.
    /// side : float
    ///     Of the patch, in the same unit: twice the radius of an extraction.
    ///
    /// Returns
    /// -------
    /// (m, 242) float32, (m,) uint8
    ///     Signatures, NaN where there is none, and `Status` numbers.
    ///
    /// Raises
    /// ------
    /// InvalidInputError
    ///     If the side is not a finite number above 0, or the curvatures differ in length.
    #[pyo3(signature = (k1, k2, *, side))]
    fn signatures_of_curvatures<'py>(
        &self,
        py: Python<'py>,
        k1: PyReadonlyArray1<'py, f32>,
        k2: PyReadonlyArray1<'py, f32>,
        side: f64,
    ) -> PyResult<Rows<'py>> {
        check_side(side)?;
        let (k1, k2) = (k1.as_slice()?, k2.as_slice()?);
        if k1.len() != k2.len() {
            return Err(crate::invalid_input("k1 and k2 must have the same length"));
        }
        let curvatures: Vec<[f32; 2]> = k1.iter().zip(k2).map(|(k1, k2)| [*k1, *k2]).collect();
        rows(py, curvatures.len(), |rows, statuses| {
            self.get().signatures_of_curvatures(side, &curvatures, rows, statuses);
        })
    }

    /// The flat atom's length for signatures of this noise.
    ///
    /// Parameters
    /// ----------
    /// noise : float
    ///     Standard error of the mean curvature where the patch's side is 1.
    ///
    /// Returns
    /// -------
    /// float or None
    ///     None where the noise is beyond the vocabulary's end.
    fn flat_atom_length(&self, noise: f64) -> Option<f64> {
        self.get().flat_atom_length(noise)
    }

    /// Signatures of surfaces in the sensor's axes.
    ///
    /// Parameters
    /// ----------
    /// surfaces : (m, 6) float32
    ///     a, b, c, d, e, f of eq. (5) in the cloud's unit, as `Extraction.coefficients`.
    /// side : float
    ///     As in `signatures_of_curvatures`.
    ///
    /// Returns
    /// -------
    /// (m, 242) float32, (m,) uint8
    ///     Signatures, NaN where there is none, and `Status` numbers.
    ///
    /// Raises
    /// ------
    /// InvalidInputError
    ///     If the side is not a finite number above 0, or the surfaces are not (m, 6).
    #[pyo3(signature = (surfaces, *, side))]
    fn signatures_of_surfaces<'py>(
        &self,
        py: Python<'py>,
        surfaces: PyReadonlyArray2<'py, f32>,
        side: f64,
    ) -> PyResult<Rows<'py>> {
        let surfaces = crate::rows::<f32, 6>(&surfaces)?;
        check_side(side)?;
        rows(py, surfaces.len(), |rows, statuses| {
            self.get().signatures_of_surfaces(side, surfaces, rows, statuses);
        })
    }
}
