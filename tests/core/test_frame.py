"""The frame against section II written out in NumPy: atoms, fields, singular values, signatures."""

from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest
from surface_points import Array

from surfsig import Frame, InvalidInputError, Status

SIDE = 0.040
GRID = np.linspace(-0.5, 0.5, 11)
SPHERE = 0.75 * (1 + 1e-9)
"""Square of half the sphere's diameter, sqrt(3), patch units."""


def fields(atoms: Array, as_printed: bool) -> Array:
    """Return alpha of each paraboloid, (242, n): eqs. (3), (4), (6)-(10), column by column, K first."""
    a, b, c, d, e, _ = np.atleast_2d(atoms).T[:, :, None, None]
    x, y = GRID[:, None], GRID[None, :]
    fx = 2 * a * x + c + e * y
    fy = 2 * b * y + d + e * x
    fxx, fyy, fxy = 2 * a, 2 * b, e
    metric = 1 + fx**2 + fy**2
    k = (fxx * fyy - fxy**2) / metric**2
    power = 2 if as_printed else 1.5
    h = ((1 + fx**2) * fyy - 2 * fx * fy * fxy + (1 + fy**2) * fxx) / (2 * metric**power)
    # One grid column holds all y of one x.
    n = len(k)
    return np.concatenate([k.reshape(n, 121), h.reshape(n, 121)], axis=1).T


def heights(atoms: Array) -> Array:
    """Return z over the grid without f, (n, 11, 11): eq. (5)."""
    a, b, c, d, e = atoms.T[:5, :, None, None]
    x, y = GRID[:, None], GRID[None, :]
    z: Array = a * x**2 + b * y**2 + c * x + d * y + e * x * y
    return z


@dataclass
class Case:
    """A frame with its matrix F, by NumPy."""

    frame: Frame
    matrix: Array
    left: Array
    values: Array
    inverse: Array


def case(frame: Frame) -> Case:
    matrix = fields(frame.atoms, frame.as_printed)
    # F = R^T Q^T: R is small, and has F's singular values and left vectors.
    q, r = np.linalg.qr(matrix.T)
    left, values, _ = np.linalg.svd(r.T)
    return Case(frame, matrix, left, values, q @ np.linalg.pinv(r.T, rcond=1e-12))


@pytest.fixture(scope="module")
def default() -> Case:
    return case(Frame.default())


@pytest.fixture(scope="module")
def printed() -> Case:
    return case(Frame.reproduction())


@pytest.fixture(scope="module", params=["default", "printed"])
def each(request: pytest.FixtureRequest) -> Case:
    found: Case = request.getfixturevalue(request.param)
    return found


BOTH = ["default", "printed"]
precise = pytest.mark.parametrize("each", BOTH, indirect=True)


def signature(case: Case, surface: Array) -> Array:
    """Return w = U S^-1 U^T alpha."""
    alpha = fields(surface, case.frame.as_printed)[:, 0]
    w: Array = case.left @ (case.left.T @ alpha / case.values)
    return w


def surfaces(count: int) -> Array:
    rng = np.random.default_rng(61)
    return rng.uniform(-1, 1, (count, 6)) * [1, 1, 0.5, 0.5, 1, 0.3]


def test_numbers_of_atoms_and_smallest_eigenvalues_of_the_design(default: Case, printed: Case) -> None:
    assert len(printed.frame) == 3109
    assert printed.frame.smallest_eigenvalue(SIDE) == pytest.approx(2.37e-4, abs=0.005e-4)
    assert len(default.frame) == 9159
    assert default.frame.smallest_eigenvalue(SIDE) == pytest.approx(2.55e-4, abs=0.005e-4)
    assert printed.frame.as_printed
    assert not default.frame.as_printed


def test_eigenvalues_in_metres_are_those_of_the_matrix_in_metres(each: Case) -> None:
    units = np.repeat([1 / SIDE**2, 1 / SIDE], 121)[:, None]
    smallest = np.linalg.svd(np.linalg.qr((units * each.matrix).T, mode="r"), compute_uv=False)[-1]
    assert each.frame.smallest_eigenvalue(SIDE) == pytest.approx(smallest**2, rel=1e-5)
    assert each.frame.smallest_eigenvalue(1.0) == pytest.approx(each.values[-1] ** 2, rel=1e-7)


@precise
def test_singular_values(each: Case) -> None:
    np.testing.assert_allclose(each.frame.singular_values, each.values, rtol=1e-10)
    assert (each.frame.singular_values**2).sum() == pytest.approx((each.matrix**2).sum(), rel=1e-12)


def test_condition_in_patch_units(printed: Case, default: Case) -> None:
    for each, condition in ((printed, 1.7e6), (default, 2.9e6)):
        assert each.values[0] / each.values[-1] == pytest.approx(condition, rel=0.03)
        values = each.frame.singular_values
        assert values[0] / values[-1] == pytest.approx(each.values[0] / each.values[-1], rel=1e-6)


def test_atoms_are_the_paraboloids_of_table_ii_inside_the_sphere(printed: Case) -> None:
    quadratic, slope = np.linspace(-4, 4, 21), np.linspace(-1, 1, 5)
    room = np.sqrt(SPHERE - GRID[:, None] ** 2 - GRID[None, :] ** 2)
    expected = set()
    for c, d in product(slope, slope):
        a, b, e = (grid.ravel() for grid in np.meshgrid(quadratic, quadratic, quadratic))
        shapes = np.column_stack([a, b, np.full_like(a, c), np.full_like(a, d), e])
        z = heights(shapes)
        low, high = (-room - z).max(axis=(1, 2)), (room - z).min(axis=(1, 2))
        for f in (-0.5, 0.0, 0.5):
            expected |= {(*row, f) for row in map(tuple, np.round(shapes[(low <= f) & (f <= high)], 9) + 0.0)}
    assert {tuple(row) for row in np.round(printed.frame.atoms, 9) + 0.0} == expected
    assert len(expected) == 3109


def test_every_atom_of_the_default_frame_stays_inside_the_sphere(default: Case) -> None:
    atoms = default.frame.atoms
    x, y = GRID[:, None], GRID[None, :]
    z = heights(atoms) + atoms[:, 5, None, None]
    assert (x**2 + y**2 + z**2).max() <= SPHERE + 1e-9
    np.testing.assert_allclose(np.unique(np.round(atoms[:, 5], 9)), np.linspace(-0.5, 0.5, 9))
    assert len(np.unique(np.round(atoms, 9), axis=0)) == 9159
    # With a surface the frame holds its mirror images, and the one seen from the other side.
    kept = {tuple(row) for row in np.round(atoms, 9) + 0.0}
    for mirror in ([1, 1, -1, 1, -1, 1], [-1, -1, -1, -1, -1, -1]):
        assert {tuple(row) for row in np.round(atoms * mirror, 9) + 0.0} == kept


def test_curvature_fields_are_eqs_3_to_10(each: Case) -> None:
    for surface in [*surfaces(20), *each.frame.atoms[::997]]:
        expected = fields(surface, each.frame.as_printed)[:, 0]
        found = each.frame.curvature_fields(surface.tolist())
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13)


def test_a_tilted_sphere_has_table_i_with_the_power_three_halves_only(default: Case, printed: Case) -> None:
    centre = 121 + 60
    tilted = [1.0, 1.0, 0.5, 0.0, 0.0, 0.0]
    metric = 1.25
    expected = (metric * 2 + 2) / (2 * metric**1.5)
    assert default.frame.curvature_fields(tilted)[centre] == pytest.approx(expected, rel=1e-14)
    assert printed.frame.curvature_fields(tilted)[centre] == pytest.approx(expected / metric**0.5, rel=1e-14)


@precise
def test_signatures_are_u_s_inverse_u_t_alpha(each: Case) -> None:
    chosen = surfaces(12).astype(np.float32)
    rows, status = each.frame.signatures_of_surfaces(chosen, side=1.0)
    assert rows.dtype == np.float32
    assert (status == Status.OK).all()
    for row, surface in zip(rows, chosen, strict=True):
        expected = signature(each, surface.astype(np.float64))
        assert np.linalg.norm(row - expected) < 1e-6 * np.linalg.norm(expected)


@precise
def test_coefficients_are_pinv_f_alpha_and_have_the_same_zeta(each: Case) -> None:
    chosen = surfaces(6)
    c = np.array([each.inverse @ fields(surface, each.frame.as_printed)[:, 0] for surface in chosen])
    ours = np.array([each.frame.coefficients(surface.tolist()) for surface in chosen])
    assert ours.shape == (6, len(each.frame))
    np.testing.assert_allclose(ours, c, atol=1e-7 * abs(c).max())
    w = each.frame.signatures_of_surfaces(chosen.astype(np.float32), side=1.0)[0].astype(np.float64)

    def zeta(v: Array) -> Array:
        unit = v / np.linalg.norm(v, axis=1)[:, None]
        table: Array = np.abs(unit @ unit.T)
        return table

    np.testing.assert_allclose(zeta(w), zeta(c), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), np.linalg.norm(c, axis=1), rtol=1e-5)
    # Eq. (2): F c = alpha.
    alpha = fields(chosen[0], each.frame.as_printed)[:, 0]
    np.testing.assert_allclose(each.matrix @ ours[0], alpha, atol=1e-7)


def test_the_table_agrees_with_the_product(default: Case) -> None:
    rng = np.random.default_rng(62)
    k1, k2 = rng.uniform(-4, 4, (2, 400)).astype(np.float32)
    by_table, status = default.frame.signatures_of_curvatures(k1, k2, side=1.0)
    columns = np.column_stack([k1 / 2, k2 / 2, *4 * [np.zeros_like(k1)]]).astype(np.float32)
    by_product, status_of_product = default.frame.signatures_of_surfaces(columns, side=1.0)
    np.testing.assert_array_equal(status, status_of_product)
    error = np.linalg.norm(by_table.astype(np.float64) - by_product, axis=1)
    assert (error <= 2e-6 + 2e-5 * np.linalg.norm(by_product, axis=1)).all()


def test_the_vocabulary_ends_where_the_signature_is_longer_than_1(default: Case) -> None:
    k = np.array([100, 115, 119, 132, 200], np.float32)
    rows, status = default.frame.signatures_of_curvatures(k, k, side=SIDE)
    lengths = [np.linalg.norm(signature(default, np.array([a, a, 0, 0, 0, 0]))) for a in k * SIDE / 2]
    assert lengths[1] < 1 < lengths[2]
    np.testing.assert_allclose(np.linalg.norm(rows[:2], axis=1), lengths[:2], rtol=2e-3)
    assert status.tolist() == [Status.OK, Status.OK, *3 * [Status.OUTSIDE_VOCABULARY]]
    assert np.isnan(rows[2:]).all()


def test_where_there_is_no_surface_there_is_no_signature_and_no_new_status(default: Case) -> None:
    nan = np.array([np.nan, 10.0], np.float32)
    rows, status = default.frame.signatures_of_curvatures(nan, nan, side=SIDE)
    assert np.isnan(rows[0]).all()
    assert not np.isnan(rows[1]).any()
    assert status.tolist() == [0, 0]


def test_section_ii_a_is_checked_and_says_why() -> None:
    with pytest.raises(InvalidInputError, match=r"no frame: 13 atoms .* rank 2 of 242 .* more levels"):
        Frame(quadratic=(4.0, 3), slope=(1.0, 1), mixed=(0.0, 1))
    with pytest.raises(InvalidInputError, match="0 atoms"):
        Frame(offset=(9.0, 2))


@pytest.mark.parametrize(
    "options",
    [
        {"quadratic": (np.nan, 3)},
        {"slope": (-1.0, 3)},
        {"mixed": (4.0, 0)},
        {"offset": (np.inf, 3)},
        {"offset": (1.0, 1002)},
    ],
    ids=repr,
)
def test_parameters_without_a_meaning(options: dict[str, tuple[float, int]]) -> None:
    with pytest.raises(InvalidInputError, match=f"frame: the (range|levels) of {next(iter(options))}"):
        Frame(**options)  # type: ignore[arg-type]


def test_more_shapes_than_can_be_searched() -> None:
    with pytest.raises(InvalidInputError, match="these levels make"):
        Frame(quadratic=(4.0, 101), mixed=(4.0, 101), slope=(1.0, 101))


def test_a_negative_number_of_levels() -> None:
    with pytest.raises(InvalidInputError, match="levels"):
        Frame(quadratic=(4.0, -1))


def test_the_hash_names_the_parameters() -> None:
    """Files carry it: it must be the same in every build and every process."""
    assert Frame.default().hash == Frame().hash == "8faf8e9b21863577"
    assert Frame.reproduction().hash == Frame(offset=(0.5, 3), as_printed=True).hash == "8873c12d31d8a40c"
    others = [
        Frame(offset=(0.5, 3)),
        Frame(as_printed=True),
        Frame(slope=(0.9, 5)),
        Frame(mixed=(4.0, 19)),
        Frame(quadratic=(3.9, 21)),
    ]
    assert len({frame.hash for frame in [Frame(), Frame.reproduction(), *others]}) == 7
    assert repr(Frame.reproduction()) == "Frame(3109 atoms, hash=8873c12d31d8a40c)"


def test_surfaces_in_fortran_order_are_not_scrambled() -> None:
    chosen = np.asfortranarray(surfaces(8).astype(np.float32))
    with pytest.raises(InvalidInputError, match=r"C-contiguous array of shape \(n, 6\)"):
        Frame.default().signatures_of_surfaces(chosen, side=1.0)


def test_surfaces_of_four_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match=r"\(n, 6\)"):
        Frame.default().signatures_of_surfaces(np.zeros((3, 4), np.float32), side=1.0)


@pytest.mark.parametrize("side", [0.0, -1.0, np.nan])
def test_a_side_without_a_meaning(side: float) -> None:
    k = np.ones(2, np.float32)
    with pytest.raises(InvalidInputError, match="side"):
        Frame.default().signatures_of_curvatures(k, k, side=side)
    with pytest.raises(InvalidInputError, match="side"):
        Frame.default().smallest_eigenvalue(side)
