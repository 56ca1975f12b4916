//! Extraction, watched from Python.

use crate::watched::watched;
use crate::{rows, to_python};
use numpy::{IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfsig::{
    Column, ExtractOptions, Extraction, FitAxes, FitKind, Monitor, NearestDistances, Neighborhood, Offsets,
    PartSize, PointCloud, Queries, Radius, Resolution, WholeCloud,
};

/// An (n, 3) array of either precision, contiguous.
#[derive(FromPyObject)]
pub enum Points<'py> {
    F32(PyReadonlyArray2<'py, f32>),
    F64(PyReadonlyArray2<'py, f64>),
}

impl Points<'_> {
    pub fn cloud(&self, origin: [f64; 3]) -> PyResult<PointCloud<'_>> {
        let offsets = match self {
            Self::F32(array) => Offsets::F32(rows::<f32, 3>(array)?),
            Self::F64(array) => Offsets::F64(rows::<f64, 3>(array)?),
        };
        Ok(PointCloud { offsets, origin })
    }
}

/// Places at which curvature is asked for.
#[derive(FromPyObject)]
pub enum At<'py> {
    Indices(PyReadonlyArray1<'py, u32>),
    Positions(PyReadonlyArray2<'py, f64>),
}

/// What the caller gave as the radius.
#[derive(FromPyObject)]
pub enum Size {
    One(f64),
    Several(Vec<f64>),
    /// "auto".
    Word(String),
}

/// What a part takes from the whole cloud: whether all its coordinates are float32 and the steps of its lattice; the
/// distances to the nearest points at a few places and the largest coordinate; and the box in which the part is
/// complete.
#[derive(FromPyObject)]
pub struct Whole(bool, [f64; 3], Vec<f64>, f64, [[f64; 3]; 2]);

impl Whole {
    fn cloud(self, origin: [f64; 3]) -> WholeCloud {
        let Self(single_precision, lattice, distances, largest, complete) = self;
        let resolution = Resolution::known(single_precision, lattice, origin);
        WholeCloud { resolution, nearest: NearestDistances { distances, largest }, complete }
    }
}

/// What is to be done, from what the caller gave of radius and number.
enum Job {
    Neighborhood(Neighborhood),
    Radii(Vec<Radius>),
    AutoRadius,
}

impl Job {
    fn of(radius: Option<Size>, neighbors: Option<usize>) -> PyResult<Self> {
        let checked = |radius| Radius::new(radius).map_err(to_python);
        Ok(match (radius, neighbors) {
            (Some(Size::One(radius)), Some(most)) => {
                Self::Neighborhood(Neighborhood::Hybrid { radius: checked(radius)?, most })
            }
            (Some(Size::One(radius)), None) => Self::Neighborhood(Neighborhood::Ball(checked(radius)?)),
            (None, Some(k)) => Self::Neighborhood(Neighborhood::Nearest(k)),
            (Some(Size::Several(radii)), None) => {
                Self::Radii(radii.into_iter().map(checked).collect::<PyResult<_>>()?)
            }
            (Some(Size::Word(word)), None) if word == "auto" => Self::AutoRadius,
            _ => return Err(PyValueError::new_err("give a radius, radii, 'auto', or neighbors")),
        })
    }

    /// How often a monitor counts each query.
    fn counts(&self) -> usize {
        if let Self::Radii(radii) = self { radii.len() } else { 1 }
    }

    /// As a part of a whole cloud does it.
    fn of_part(&self) -> PyResult<PartSize> {
        match self {
            Self::Neighborhood(neighborhood) => Ok(PartSize::Of(*neighborhood)),
            Self::AutoRadius => Ok(PartSize::Auto),
            Self::Radii(_) => Err(PyValueError::new_err("a part of a cloud has one radius")),
        }
    }

    fn run(
        &self,
        cloud: &PointCloud<'_>,
        queries: &Queries<'_>,
        options: &ExtractOptions<'_>,
        monitor: &Monitor,
    ) -> Result<Vec<Extraction>, surfsig::Error> {
        match self {
            Self::Neighborhood(neighborhood) => {
                Ok(vec![surfsig::extract_monitored(cloud, *neighborhood, queries, options, monitor)?])
            }
            Self::Radii(radii) => surfsig::extract_radii(cloud, radii, queries, options, monitor),
            Self::AutoRadius => Ok(vec![surfsig::extract_auto_radius(cloud, queries, options, monitor)?]),
        }
    }
}

/// Extract curvature, once for each radius; see `surfsig.extract` for what the arguments and the arrays mean. Of a part
/// of a cloud, `beyond` has the numbers of the places that looked beyond it.
#[pyfunction]
#[pyo3(signature = (points, *, origin, radius, axes, fit, neighbors=None, at=None, viewpoint=None, directions=None, robust=false, threads=None, progress=None, whole=None))]
#[expect(clippy::too_many_arguments, reason = "keywords of the Python function")]
pub fn extract<'py>(
    py: Python<'py>,
    points: Points<'py>,
    origin: [f64; 3],
    radius: Option<Size>,
    axes: &str,
    fit: &str,
    neighbors: Option<usize>,
    at: Option<At<'py>>,
    viewpoint: Option<[f64; 3]>,
    directions: Option<PyReadonlyArray2<'py, f32>>,
    robust: bool,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
    whole: Option<Whole>,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let cloud = points.cloud(origin)?;
    let queries = match &at {
        None => Queries::All,
        Some(At::Indices(indices)) => Queries::Indices(indices.as_slice()?),
        Some(At::Positions(positions)) => Queries::Positions(PointCloud::new_f64(rows::<f64, 3>(positions)?)),
    };
    let axes = match axes {
        "surface" => FitAxes::Surface,
        "sensor" => FitAxes::Sensor,
        other => return Err(PyValueError::new_err(format!("unknown axes '{other}'"))),
    };
    let fit = match fit {
        "paraboloid" => FitKind::Paraboloid,
        "quadric" => FitKind::Quadric,
        "auto" => FitKind::Auto,
        other => return Err(PyValueError::new_err(format!("unknown fit '{other}'"))),
    };
    let job = Job::of(radius, neighbors)?;
    let directions = directions.as_ref().map(rows::<f32, 3>).transpose()?;
    let options = ExtractOptions { axes, fit, viewpoint, directions, robust, threads, instruction_set: None };
    let total = queries.len(&cloud) * job.counts();
    if let Some(whole) = whole {
        let (size, whole) = (job.of_part()?, whole.cloud(origin));
        let work =
            |monitor: &Monitor| surfsig::extract_part(&cloud, size, &queries, &options, &whole, monitor);
        let (extraction, beyond) = watched(py, Some(total), progress.as_ref(), work)?;
        let arrays = to_arrays(py, extraction)?;
        arrays.set_item("beyond", PyArray1::from_iter(py, beyond.into_iter().map(|query| query as u32)))?;
        return Ok(vec![arrays]);
    }
    let work = |monitor: &Monitor| job.run(&cloud, &queries, &options, monitor);
    let extractions = watched(py, Some(total), progress.as_ref(), work)?;
    extractions.into_iter().map(|extraction| to_arrays(py, extraction)).collect()
}

/// Moves the columns into NumPy arrays, by the names of Python's `Extraction`.
fn to_arrays(py: Python<'_>, extraction: Extraction) -> PyResult<Bound<'_, PyDict>> {
    fn matrix<const N: usize>(py: Python<'_>, rows: Vec<[f32; N]>) -> PyResult<Bound<'_, PyAny>> {
        let count = rows.len();
        Ok(PyArray1::from_vec(py, rows.into_flattened()).reshape([count, N])?.into_any())
    }
    let arrays = PyDict::new(py);
    for (name, column) in extraction.into_columns() {
        let array = match column {
            Column::Scalars(numbers) => numbers.into_pyarray(py).into_any(),
            Column::Vectors(rows) => matrix(py, rows)?,
            Column::Coefficients(rows) => matrix(py, rows)?,
            Column::Counts(counts) => counts.into_pyarray(py).into_any(),
            Column::Statuses(all) => PyArray1::from_iter(py, all.iter().map(|&one| one as u8)).into_any(),
            Column::FitsUsed(all) => PyArray1::from_iter(py, all.iter().map(|&one| one as u8)).into_any(),
        };
        arrays.set_item(if name == "radii" { "radius" } else { name }, array)?;
    }
    Ok(arrays)
}

/// Numbers of the points that stand for their voxels; see `surfsig.extract`.
#[pyfunction]
#[pyo3(signature = (points, *, origin, voxel))]
pub fn voxel_representatives<'py>(
    py: Python<'py>,
    points: Points<'py>,
    origin: [f64; 3],
    voxel: f64,
) -> PyResult<Bound<'py, PyArray1<u32>>> {
    let cloud = points.cloud(origin)?;
    let voxel = Radius::new(voxel).map_err(to_python)?;
    let found = py.detach(|| surfsig::voxel_representatives(&cloud, voxel)).map_err(to_python)?;
    Ok(found.into_pyarray(py))
}

/// The largest step between float32 numbers where coordinates are such, and that of a lattice where they are
/// multiples of one; see `surfsig.resolution`.
#[pyfunction]
#[pyo3(signature = (points, *, origin))]
pub fn coordinate_steps(points: Points<'_>, origin: [f64; 3]) -> PyResult<(f64, f64)> {
    let cloud = points.cloud(origin)?;
    let resolution = Resolution::of(&cloud);
    // Where coordinates are finer than float32, no point has such a step.
    let points = if resolution.single_precision { cloud.len() } else { 0 };
    let positions = (0..points).filter_map(|i| cloud.position(i));
    let number_step = positions.map(|p| resolution.number_step(p)).fold(0.0, f64::max);
    Ok((number_step, resolution.lattice.into_iter().fold(0.0, f64::max)))
}

/// Whether all coordinates are float32 numbers, and the steps of the lattice of which they are multiples.
#[pyfunction]
#[pyo3(signature = (points, *, origin))]
pub fn coordinate_resolution(points: Points<'_>, origin: [f64; 3]) -> PyResult<(bool, [f64; 3])> {
    let resolution = Resolution::of(&points.cloud(origin)?);
    Ok((resolution.single_precision, resolution.lattice))
}

/// Numbers of the finite points at which it is looked how far neighbours are, of so many.
#[pyfunction]
pub fn sampled_numbers(count: usize) -> Vec<usize> {
    surfsig::sampled_numbers(count)
}

/// A few different ones of the places at those points.
#[pyfunction]
pub fn different_places(candidates: PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; 3]>> {
    Ok(surfsig::different_places(rows::<f64, 3>(&candidates)?.iter().copied()))
}

/// Distance from a place to the k-th nearest of some points.
#[pyfunction]
pub fn distance_to_nearest(points: PyReadonlyArray2<'_, f64>, place: [f64; 3], k: usize) -> PyResult<f64> {
    Ok(surfsig::distance_to_nearest(rows::<f64, 3>(&points)?, place, k))
}
