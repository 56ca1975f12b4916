//! The surfaces of a scan, for Python.

use crate::all_cores::on_all_cores;
use crate::extract::Points;
use crate::primitive::kind_of;
use crate::rows;
use crate::watched::watched;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfsig::{FoundSurface, Monitor, PiecePair, SurfaceOptions, SurfacePiece, SurfaceSums};

/// Find surfaces; see `surfsig.surfaces`. The labels, a dictionary for each surface, which points these were fitted to, and
/// up to which distance all is rounding.
#[pyfunction]
#[pyo3(signature = (points, *, origin, kinds, min_points=None, noise=None, threads=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords of the Python function")]
#[expect(clippy::type_complexity, reason = "a tuple in Python")]
pub fn find_surfaces<'py>(
    py: Python<'py>,
    points: Points<'py>,
    origin: [f64; 3],
    kinds: Vec<String>,
    min_points: Option<usize>,
    noise: Option<f64>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Bound<'py, PyArray1<i32>>, Vec<Bound<'py, PyDict>>, Bound<'py, PyArray1<bool>>, f64)> {
    let cloud = points.cloud(origin)?;
    let kinds = kinds.iter().map(|name| kind_of(name)).collect::<PyResult<_>>()?;
    let options = SurfaceOptions { fewest: min_points, noise, kinds, threads };
    let work = |monitor: &Monitor| surfsig::find_surfaces(&cloud, &options, monitor);
    let found = watched(py, Some(cloud.len()), progress.as_ref(), work)?;
    let surfaces = found.surfaces.iter().map(|surface| entry(py, surface)).collect::<PyResult<_>>()?;
    Ok((found.labels.into_pyarray(py), surfaces, found.measured.into_pyarray(py), found.rounding))
}

/// A surface as a dictionary.
fn entry<'py>(py: Python<'py>, surface: &FoundSurface) -> PyResult<Bound<'py, PyDict>> {
    let entry = PyDict::new(py);
    entry.set_item("kind", surface.kind.name())?;
    entry.set_item("point", surface.point.to_pyarray(py))?;
    entry.set_item("axis", surface.axis.to_pyarray(py))?;
    entry.set_item("radius", surface.radius)?;
    entry.set_item("major_radius", surface.major_radius)?;
    entry.set_item("half_angle", surface.half_angle)?;
    entry.set_item("deviation", surface.deviation)?;
    entry.set_item("count", surface.count)?;
    entry.set_item("radius_std", surface.radius_std)?;
    entry.set_item("major_radius_std", surface.major_radius_std)?;
    entry.set_item("half_angle_std", surface.half_angle_std)?;
    let parameters = surface.covariance.len().isqrt();
    entry.set_item("covariance", surface.covariance.to_pyarray(py).reshape([parameters, parameters])?)?;
    entry.set_item("across", surface.across.map(|direction| direction.to_pyarray(py)).to_vec())?;
    entry.set_item("freedom", surface.freedom)?;
    entry.set_item("tolerance", surface.tolerance)?;
    entry.set_item("is_exact", surface.is_exact)?;
    Ok(entry)
}

/// What a dictionary of a surface must have to be compared and measured; vectors are lists.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct SurfaceValues {
    kind: String,
    point: [f64; 3],
    axis: [f64; 3],
    radius: f64,
    major_radius: f64,
    half_angle: f64,
    count: usize,
    tolerance: f64,
    is_exact: bool,
}

impl SurfaceValues {
    fn surface(&self) -> PyResult<FoundSurface> {
        Ok(FoundSurface {
            kind: kind_of(&self.kind)?,
            point: self.point,
            axis: self.axis,
            radius: self.radius,
            major_radius: self.major_radius,
            half_angle: self.half_angle,
            deviation: f64::NAN,
            count: self.count,
            radius_std: f64::NAN,
            major_radius_std: f64::NAN,
            half_angle_std: f64::NAN,
            covariance: Vec::new(),
            across: [[f64::NAN; 3]; 2],
            freedom: f64::NAN,
            tolerance: self.tolerance,
            is_exact: self.is_exact,
        })
    }
}

/// Join pieces of parts next to each other: of each its dictionary, some of its points (m, 3), and the rounding of its
/// part. Pairs are two numbers and whether the pieces overlap. The number of each piece's surface, and the surfaces.
#[pyfunction]
#[expect(clippy::type_complexity, reason = "a tuple in Python")]
pub fn join_surface_pieces<'py>(
    py: Python<'py>,
    pieces: Vec<(SurfaceValues, PyReadonlyArray2<'py, f64>, f64)>,
    pairs: Vec<(u32, u32, bool)>,
) -> PyResult<(Bound<'py, PyArray1<u32>>, Vec<Bound<'py, PyDict>>)> {
    let piece = |(values, points, rounding): &(SurfaceValues, PyReadonlyArray2<'py, f64>, f64)| {
        let (surface, points) = (values.surface()?, rows::<f64, 3>(points)?.to_vec());
        Ok(SurfacePiece { surface, points, rounding: *rounding })
    };
    let pieces = pieces.iter().map(piece).collect::<PyResult<Vec<_>>>()?;
    let pair = |(first, second, overlap)| PiecePair { first, second, overlap };
    let pairs: Vec<PiecePair> = pairs.into_iter().map(pair).collect();
    let joined = on_all_cores(py, || surfsig::join_surface_pieces(&pieces, &pairs))?;
    let surface = |primitive: &surfsig::Primitive| {
        let values = PyDict::new(py);
        values.set_item("kind", primitive.kind().name())?;
        values.set_item("point", primitive.point().to_vec())?;
        values.set_item("axis", primitive.axis().to_vec())?;
        values.set_item("radius", primitive.radius())?;
        values.set_item("major_radius", primitive.major_radius())?;
        values.set_item("half_angle", primitive.half_angle())?;
        Ok(values)
    };
    let surfaces = joined.primitives.iter().map(surface).collect::<PyResult<_>>()?;
    Ok((joined.surfaces.into_pyarray(py), surfaces))
}

/// Sums over points of a surface: their number, sum of squares, number at the limit, crossing, and a row for each block.
type Sums<'py> = (usize, f64, usize, f64, Bound<'py, PyArray2<f64>>);

/// Sum over points (m, 3) of a surface, up to a distance that is its tolerance.
#[pyfunction]
pub fn surface_sums<'py>(
    py: Python<'py>,
    surface: SurfaceValues,
    points: PyReadonlyArray2<'py, f64>,
) -> PyResult<Sums<'py>> {
    let (near, points) = (surface.surface()?.primitive(), rows::<f64, 3>(&points)?);
    let sums = py.detach(|| SurfaceSums::new(&near, points, surface.tolerance));
    tuple_of(py, &sums)
}

fn tuple_of<'py>(py: Python<'py>, sums: &SurfaceSums) -> PyResult<Sums<'py>> {
    let width = sums.blocks.first().map_or(0, Vec::len);
    let blocks = sums.blocks.concat().to_pyarray(py).reshape([sums.blocks.len(), width])?;
    Ok((sums.count, sums.squares, sums.at_limit, sums.crossing, blocks))
}

/// Sums of several sets of points, as they are given to Rust.
type GivenSums<'py> = Vec<(usize, f64, usize, f64, PyReadonlyArray2<'py, f64>)>;

fn added(sums: &GivenSums<'_>) -> SurfaceSums {
    let mut all = SurfaceSums { count: 0, squares: 0.0, at_limit: 0, crossing: 1.0, blocks: Vec::new() };
    for (count, squares, at_limit, crossing, blocks) in sums {
        let blocks = blocks.as_array().rows().into_iter().map(|row| row.to_vec()).collect();
        let (count, squares, at_limit, crossing) = (*count, *squares, *at_limit, *crossing);
        all.add(&SurfaceSums { count, squares, at_limit, crossing, blocks });
    }
    all
}

/// Add the sums of several sets of points of a surface.
#[pyfunction]
pub fn added_sums<'py>(py: Python<'py>, sums: GivenSums<'py>) -> PyResult<Sums<'py>> {
    tuple_of(py, &added(&sums))
}

/// Fit a surface by the sums of several sets of its points; `None` where they do not determine it.
#[pyfunction]
pub fn surface_of_sums<'py>(
    py: Python<'py>,
    surface: SurfaceValues,
    sums: GivenSums<'py>,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    let near = surface.surface()?.primitive();
    added(&sums).fitted(&near).map(|found| entry(py, &found)).transpose()
}
