"""The flat atom's length: that of the noise which fits report, and what zeta makes of planes with it."""

import numpy as np
import pytest
from surface_points import Shape, cylinder, paraboloid, plane

from surfsig import Extraction, Frame, InvalidInputError, extract, flat_atom_length, similarity_matrix
from surfsig._surfsig import FLAT_ATOM_NOISES

RADIUS = 0.02


def many(shape: Shape, noise: float, seed: int, patches: int = 100) -> Extraction:
    """Extract at the middle of many patches with noise, far from each other."""
    rng = np.random.default_rng(seed)
    middles = np.column_stack([np.arange(patches), np.zeros((patches, 2))])
    points = [shape.points(rng, RADIUS) + [0, 0, 1] * rng.normal(0, noise, (1500, 1)) for _ in middles]
    cloud = np.concatenate([part + middle for part, middle in zip(points, middles, strict=True)])
    return extract(cloud, RADIUS, at=middles)


def of_noise(mean_curvature: float | np.floating) -> float:
    """Return the length of a signature of pure noise, times the noises of a flat atom."""
    k = np.array([mean_curvature], np.float32)
    return FLAT_ATOM_NOISES * float(np.linalg.norm(Frame.default().signatures_of_curvatures(k, k, side=1)[0]))


@pytest.fixture(scope="module")
def planes() -> Extraction:
    return many(plane(), 1e-4, 1)


def test_the_length_follows_the_standard_errors(planes: Extraction) -> None:
    std = np.median(planes.mean_curvature_std)
    # Which are those of a disc full of points: 6.9 s / (r^2 sqrt N).
    assert std == pytest.approx(6.9e-4 / (RADIUS**2 * np.sqrt(planes.count.mean())), rel=0.03)
    assert flat_atom_length(planes) == pytest.approx(of_noise(2 * RADIUS * std), rel=1e-5)
    assert flat_atom_length(many(plane(), 1e-5, 1)) == pytest.approx(flat_atom_length(planes) / 10, rel=0.03)


def test_auto_takes_all_places_whatever_is_asked_for(planes: Extraction) -> None:
    length = np.float32(flat_atom_length(planes))
    assert planes.signatures([3], flat_atom="auto")[0, 242] == length
    for _, rows, _ in planes.iter_signatures(flat_atom="auto", block=7):
        assert (rows[:, 242] == length).all()
    frame = Frame.reproduction()
    rows = planes.signatures([3], flat_atom="auto", frame=frame)
    assert rows[0, 242] == np.float32(flat_atom_length(planes, frame=frame)) != length


def test_the_noisiest_of_several_gives_the_length(planes: Extraction) -> None:
    rough = many(plane(), 3e-4, 2)
    assert flat_atom_length(planes, rough) == flat_atom_length(rough, planes) == flat_atom_length(rough)


@pytest.mark.parametrize("noise", [1e-5, 1e-4, 3e-4])
def test_planes_are_alike_and_no_large_cylinder_is(noise: float) -> None:
    flat, bent = many(plane(), noise, 1), many(cylinder(0.038), noise, 2)
    length = flat_atom_length(flat, bent)
    a, b = flat.signatures(flat_atom=length), bent.signatures(flat_atom=length)
    pairs = similarity_matrix(a, a)[np.triu_indices(len(a), 1)]
    assert (pairs >= 0.9).mean() >= 0.98
    assert similarity_matrix(a, b).max() < 0.5
    # Without it they are as good as alike.
    assert similarity_matrix(flat.signatures(), bent.signatures()).mean() > 0.55


def test_places_known_to_be_flat_tell_noise_that_neighbours_share() -> None:
    """A plane with waves as long as the ball: hardly a residual, and so a small standard error."""
    rng = np.random.default_rng(5)
    xy = rng.uniform(-0.3, 0.3, (60_000, 2))
    waves = 1e-4 * np.cos(xy @ rng.normal(0, 60, (2, 40)) + rng.uniform(0, 2 * np.pi, 40)).sum(axis=1)
    waves += rng.normal(0, 1e-5, len(xy))
    found = extract(
        np.column_stack([xy, waves]), RADIUS, at=np.flatnonzero((abs(xy) < 0.25).all(axis=1))[:300]
    )
    spread = 1.4826 * np.median(abs(found.mean_curvature))
    assert spread > 5 * np.median(found.mean_curvature_std)
    length = flat_atom_length(found, flat=True)
    assert length == pytest.approx(of_noise(2 * RADIUS * spread), rel=1e-5)
    alike = []
    for flat_atom in (flat_atom_length(found), length):
        w = found.signatures(flat_atom=flat_atom)
        alike.append((similarity_matrix(w, w) >= 0.9).mean())
    assert alike[0] < 0.7
    assert alike[1] > 0.95


def test_in_the_sensors_axes_residual_and_count_serve() -> None:
    rng = np.random.default_rng(6)
    xy = rng.uniform(-0.1, 0.1, (20_000, 2))
    points = np.column_stack([xy, 1 + rng.normal(0, 1e-4, len(xy))])
    at = np.flatnonzero((abs(xy) < 0.07).all(axis=1))[:300]
    own, sensor = (extract(points, RADIUS, at=at, axes=axes) for axes in ("surface", "sensor"))
    assert np.isnan(sensor.mean_curvature_std).all()
    assert flat_atom_length(sensor) == pytest.approx(flat_atom_length(own), rel=0.03)


def test_each_place_counts_with_its_own_radius() -> None:
    rng = np.random.default_rng(10)
    xy = rng.uniform(-0.1, 0.1, (20_000, 2))
    found = extract(np.column_stack([xy, rng.normal(0, 1e-4, len(xy))]), neighbors=400)
    expected = np.median(2 * found.radius * found.mean_curvature_std)
    assert flat_atom_length(found) == pytest.approx(of_noise(expected), rel=1e-5)


def test_rounding_is_noise_too() -> None:
    found = extract(plane().points(np.random.default_rng(7), RADIUS), RADIUS, at=np.zeros((1, 3)))
    assert flat_atom_length(found) == pytest.approx(of_noise(np.finfo(np.float32).eps), rel=0.1)


def test_without_noise_that_is_known_there_is_no_length() -> None:
    few = extract(plane().points(np.random.default_rng(8), RADIUS, count=5), RADIUS)
    with pytest.raises(InvalidInputError, match="no place has more than six points"):
        flat_atom_length(few)
    with pytest.raises(InvalidInputError, match="one extraction or more"):
        flat_atom_length()
    with pytest.raises(InvalidInputError, match="beyond the vocabulary: take a larger radius"):
        flat_atom_length(many(paraboloid(300, 300), 1e-5, 9, patches=5), flat=True)
