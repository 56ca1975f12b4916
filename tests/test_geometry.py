"""Rigid transforms: their laws, against slow references, and what is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from scipy.linalg import expm

import surfsig
from surfsig import InvalidInputError
from surfsig.geometry import (
    about,
    adjoint,
    axes_across,
    exp_twist,
    fit_transform,
    from_rotation_vector,
    from_translation,
    inverse,
    log_pose,
    orthonormal,
    pose_array,
    rotate,
    rotation_angle,
    skew,
    transform_points,
)

Array = NDArray[np.float64]

UNIT = arrays(np.float64, 3, elements=st.floats(-1, 1)).filter(lambda v: float(np.linalg.norm(v)) > 1e-3)
ANGLES = (
    st.floats(0, np.pi) | st.floats(-12, 0).map(lambda power: 10.0**power) | st.floats(np.pi - 1e-6, np.pi)
)


@st.composite
def twists(draw: st.DrawFn) -> Array:
    """Draw twists whose rotations are from 1e-12 to pi."""
    axis = draw(UNIT)
    vector = axis * (draw(ANGLES) / np.linalg.norm(axis))
    return np.concatenate([vector, draw(arrays(np.float64, 3, elements=st.floats(-5, 5)))])


def generator(twist: Array) -> Array:
    """Give the matrix (4, 4) whose exponential is a twist's pose."""
    result = np.zeros((4, 4))
    result[:3, :3], result[:3, 3] = skew(twist[:3]), twist[3:]
    return result


@given(twists())
def test_the_exponential_is_that_of_the_matrix(twist: Array) -> None:
    np.testing.assert_allclose(exp_twist(twist), expm(generator(twist)), atol=1e-12)


@given(twists())
def test_the_exponential_of_the_logarithm_is_the_pose(twist: Array) -> None:
    pose = exp_twist(twist)
    np.testing.assert_allclose(exp_twist(log_pose(pose)), pose, atol=1e-13)
    assert rotation_angle(pose) == pytest.approx(min(float(np.linalg.norm(twist[:3])), np.pi), abs=1e-7)


@pytest.mark.parametrize("angle", [1e-12, 1e-9, 1e-6, 1e-3])
def test_small_twists_keep_their_digits(angle: float) -> None:
    twist = angle * np.array([0.6, 0.0, -0.8, 0.1, 0.2, 0.3])
    np.testing.assert_allclose(log_pose(exp_twist(twist)), twist, rtol=1e-13, atol=1e-15 * angle)


@given(twists())
def test_a_pose_and_its_inverse_are_the_identity(twist: Array) -> None:
    pose = exp_twist(twist)
    np.testing.assert_allclose(pose @ inverse(pose), np.eye(4), atol=1e-14)
    np.testing.assert_allclose(inverse(pose) @ pose, np.eye(4), atol=1e-14)


def test_many_poses_are_inverted_at_once() -> None:
    poses = np.stack([exp_twist(twist) for twist in np.random.default_rng(1).normal(size=(6, 6))])
    backs = inverse(poses.reshape(2, 3, 4, 4)).reshape(6, 4, 4)
    for pose, back in zip(poses, backs, strict=True):
        np.testing.assert_array_equal(back, inverse(pose))
        np.testing.assert_allclose(back, np.linalg.inv(pose), atol=1e-14)


@given(twists(), twists())
def test_the_adjoint_takes_twists_into_the_axes_of_the_target(first: Array, second: Array) -> None:
    pose = exp_twist(first)
    carried = pose @ exp_twist(second) @ inverse(pose)
    np.testing.assert_allclose(exp_twist(adjoint(pose) @ second), carried, atol=1e-11)


@given(twists(), twists())
def test_applying_a_product_applies_both(first: Array, second: Array) -> None:
    a, b = exp_twist(first), exp_twist(second)
    points = np.random.default_rng(2).normal(size=(20, 3))
    np.testing.assert_allclose(
        transform_points(a @ b, points), transform_points(a, transform_points(b, points)), atol=1e-13
    )
    np.testing.assert_allclose(rotate(a @ b, points), rotate(a, rotate(b, points)), atol=1e-14)
    moved = transform_points(a, points)
    np.testing.assert_allclose(
        np.linalg.norm(np.diff(moved, axis=0), axis=1), np.linalg.norm(np.diff(points, axis=0), axis=1)
    )
    np.testing.assert_allclose(transform_points(a, points[0]), moved[0], atol=1e-14)


def test_a_rotation_about_a_centre_leaves_the_centre() -> None:
    center, vector, translation = (
        np.array([4.0, -5.0, 6.0]),
        np.array([0.4, 0.5, -0.6]),
        np.array([0.1, 0.2, 0.3]),
    )
    pose = about(center, vector, translation)
    np.testing.assert_allclose(transform_points(pose, center), center + translation, atol=1e-14)
    around = from_translation(center) @ from_rotation_vector(vector, translation) @ from_translation(-center)
    np.testing.assert_allclose(pose, around, atol=1e-14)


def test_many_rotation_vectors_give_many_poses() -> None:
    vectors, translations = np.random.default_rng(3).normal(size=(2, 5, 3))
    poses = from_rotation_vector(vectors, translations)
    for pose, vector, translation in zip(poses, vectors, translations, strict=True):
        np.testing.assert_array_equal(pose, from_rotation_vector(vector, translation))
        np.testing.assert_allclose(pose[:3, :3], expm(skew(vector)), atol=1e-14)


@given(UNIT)
def test_axes_across_a_direction_are_unit_square_and_right_handed(raw: Array) -> None:
    direction = raw / np.linalg.norm(raw)
    u, v = axes_across(direction)
    axes = np.stack([u, v, direction])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(axes) > 0
    many = axes_across(np.stack([direction, -direction]))
    np.testing.assert_array_equal(many[0][0], u)
    np.testing.assert_array_equal(many[1][0], v)


def test_axes_across_are_those_of_the_core() -> None:
    height = np.random.default_rng(4).normal(0.0, 0.05, (400, 1))
    points = np.hstack([np.random.default_rng(5).uniform(-1, 1, (400, 2)), height])
    found = surfsig.extract_field_signatures(
        points @ from_rotation_vector(np.ones(3), np.zeros(3))[:3, :3].T, 0.8
    )
    known = np.isfinite(found.axes).all(axis=1)
    assert known.sum() > 10
    tangents, _ = axes_across(found.axes[known].astype(np.float64))
    np.testing.assert_allclose(tangents, found.tangents[known], atol=1e-6)


@settings(max_examples=30)
@given(twists())
def test_a_pose_is_fitted_to_pairs_of_points(twist: Array) -> None:
    source = np.random.default_rng(6).normal(size=(10, 3))
    np.testing.assert_allclose(
        fit_transform(source, transform_points(exp_twist(twist), source)), exp_twist(twist), atol=1e-12
    )


@given(twists())
def test_an_exact_pose_keeps_its_bits_and_a_printed_one_becomes_a_rotation(twist: Array) -> None:
    pose = exp_twist(twist)
    np.testing.assert_array_equal(pose_array(pose.tolist(), "init"), pose)
    printed = pose_array(pose.round(5), "init")
    np.testing.assert_allclose(printed, pose, atol=3e-5)
    np.testing.assert_allclose(printed[:3, :3] @ printed[:3, :3].T, np.eye(3), atol=1e-14)


def test_a_product_of_many_becomes_a_rotation_again() -> None:
    pose = np.linalg.matrix_power(1.0000001 * exp_twist(np.arange(6.0)), 3)
    rotation = orthonormal(pose)[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-15)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ("here", "it is no array of numbers"),
        (np.eye(3), r"its shape is \(3, 3\)"),
        (np.diag([1.0, np.nan, 1.0, 1.0]), "it is not finite"),
        (2 * np.eye(4), "its last row is not 0, 0, 0, 1"),
        (np.diag([1.0, 1.001, 1.0, 1.0]), "it scales or shears"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "it mirrors"),
    ],
)
def test_what_is_no_pose_is_refused_by_name(wrong: object, words: str) -> None:
    with pytest.raises(InvalidInputError, match=f"init must be a pose .*: {words}"):
        pose_array(wrong, "init")  # type: ignore[arg-type]
