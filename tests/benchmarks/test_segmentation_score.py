"""The scores of the segmentation benchmark, on clouds of a few points."""

from pathlib import Path

import numpy as np
import pytest
from segmentation_score import Found, SurfaceScore, TableScore, match, score_surfaces, score_table
from segmentation_truth import Model, Segment, TableScene, read_model, read_models, read_tables, with_noise

import surfsig


def model(count: int, *segments: tuple[str, float | None, list[int]]) -> Model:
    """A model whose points all lie at 0: the scores look at indices alone."""
    cloud = surfsig.PointCloud(np.zeros((count, 3)))
    return Model(
        "tiny", cloud, tuple(Segment(kind, radius, np.array(points)) for kind, radius, points in segments)
    )


def found(labels: list[int], kinds: list[str], radii: list[float | None]) -> Found:
    return Found(np.array(labels), kinds, radii)


def test_equal_surfaces_reach_every_score() -> None:
    known = model(6, ("plane", None, [0, 1, 2]), ("sphere", 2.0, [3, 4, 5]))
    score = score_surfaces(known, found([1, 1, 1, 0, 0, 0], ["sphere", "plane"], [2.1, None]))
    assert (score.f1, score.typed_f1, score.kind_share) == (1, 1, 1)
    assert score.with_radius == 1
    assert score.radius_error == pytest.approx(0.05)


def test_an_overlap_of_a_half_matches_and_less_does_not() -> None:
    known = model(9, ("plane", None, [0, 1, 2, 3]), ("plane", None, [4, 5, 6, 7, 8]))
    # The first: 2 of 4 points. The second: 2 of 5.
    assert (
        score_surfaces(known, found([0, 0, -1, -1, 1, 1, -1, -1, -1], ["plane"] * 2, [None] * 2)).matched == 1
    )


def test_a_found_surface_matches_one_known_surface_only() -> None:
    known = model(4, ("plane", None, [0, 1]), ("plane", None, [2, 3]))
    score = score_surfaces(known, found([0, 0, 0, 0], ["plane"], [None]))
    assert (score.known, score.found, score.matched) == (2, 1, 1)
    assert score.f1 == pytest.approx(2 / 3)


def test_points_of_an_edge_may_go_to_either_surface() -> None:
    """Points 3 to 8 belong to both: given to one, the other one's 3 points still overlap wholly."""
    segments = model(12, ("plane", None, [*range(9)]), ("plane", None, [*range(3, 12)])).segments
    assert [index for _, index in match(segments, np.array([0] * 3 + [1] * 9))] == [0, 1]
    assert [index for _, index in match(segments, np.array([0] * 9 + [1] * 3))] == [0, 1]


def test_points_of_no_known_surface_make_the_overlap_smaller() -> None:
    segments = model(8, ("plane", None, [0, 1, 2])).segments
    assert len(match(segments, np.array([0] * 6 + [-1] * 2))) == 1
    assert len(match(segments, np.array([0] * 7 + [-1]))) == 0


def test_a_wrong_kind_counts_in_f1_alone_and_its_radius_nowhere() -> None:
    known = model(4, ("cylinder", 1.0, [0, 1]), ("plane", None, [2, 3]))
    score = score_surfaces(known, found([0, 0, 1, 1], ["sphere", "plane"], [1.0, None]))
    assert (score.f1, score.typed_f1, score.kind_share) == (1, 0.5, 0.5)
    assert score.radius_error is None


def test_a_surface_without_points_is_not_found() -> None:
    known = model(2, ("plane", None, [0, 1]))
    assert score_surfaces(known, found([1, 1], ["cone", "plane"], [None, None])).found == 1


def test_nothing_found_scores_zero() -> None:
    score = score_surfaces(model(2, ("plane", None, [0, 1])), found([-1, -1], [], []))
    assert (score.f1, score.kind_share, score.matched) == (0, 0, 0)


def test_scores_of_clouds_add_up() -> None:
    one = SurfaceScore(4, 2, 2, 1, 10, 5, 1, (0.1,))
    other = SurfaceScore(2, 4, 1, 1, 30, 25, 2, (0.3, 0.5))
    total = SurfaceScore.total([one, other])
    assert total.f1 == pytest.approx(2 * 3 / 12)
    assert total.kind_share == pytest.approx(30 / 40)
    assert total.radius_error == pytest.approx(0.3)
    assert TableScore.total([TableScore(1, 2, 3, 4, 5, 6)] * 2) == TableScore(2, 4, 6, 8, 10, 12)


def test_surfaces_that_mix_objects_are_told_from_those_that_do_not() -> None:
    """Surface 0 has 9 of 10 points on object 2; surface 1 half on 2, half on the table; surface 2 none."""
    objects = np.array([2] * 9 + [1] + [2, 1] + [0, 0] + [1])
    labels = [0] * 10 + [1, 1] + [2, 2] + [-1]
    scene = TableScene("tiny", surfsig.PointCloud(np.zeros((15, 3))), objects)
    score = score_table(scene, found(labels, ["plane"] * 3, [None] * 3))
    assert score == TableScore(
        labelled=13, unmixed=10, on_table=10, on_table_unmixed=9, objects=2, segments=2
    )


def test_a_model_of_fit4cad_is_read(tmp_path: Path) -> None:
    (tmp_path / "PC7.txt").write_text("Points:=[\n[0, 0, 0], \n[3.0, 4.0, 0.0], \n[-1e-3, 2, 0]];\n")
    (tmp_path / "PC7_primitives.txt").write_text(
        "Primitive1:=[1 2];\n\nPrimitive2:=[2 3];\n\nPrimitive3:=[3];\n"
    )
    (tmp_path / "PC7_parametric.txt").write_text(
        "Primitive1:=[Cylinder, [-3 4 0 -4 -3 0 0 0 1 7 7 7]];\n\n"
        "Primitive2:=[Plane, [1 0 -0 0 1 0 0 0 9]];\n\n"
        "Primitive3:=[Torus, [Torus, [-27 0 0 0 27 0 -2 0 0 0 2 0 0 0 -2 0 0 10]];\n"
    )
    read = read_model(tmp_path / "PC7.txt")
    assert read.cloud.offsets.tolist() == [[0, 0, 0], [3, 4, 0], [-0.001, 2, 0]]
    assert [(each.kind, each.radius, each.points.tolist()) for each in read.segments] == [
        ("cylinder", 5.0, [0, 1]), ("plane", None, [1, 2]), ("torus", None, [2]),
    ]  # fmt: skip
    (tmp_path / "PC7_primitives.txt").write_text("Primitive1:=[1 4];\n")
    with pytest.raises(ValueError, match=r"PC7.txt: 1 surfaces have points, 3 have a shape"):
        read_model(tmp_path / "PC7.txt")


def test_noise_is_a_share_of_the_diagonal_and_repeats() -> None:
    points = np.random.default_rng(2).uniform(size=(20_000, 3)) * [3, 4, 12]
    plain = Model("box", surfsig.PointCloud(points), ())
    moved = [with_noise(plain, 0.001, seed=5).cloud.offsets - points for _ in range(2)]
    assert np.array_equal(moved[0], moved[1])
    np.testing.assert_allclose(moved[0].std(axis=0), 0.013, rtol=0.03)
    assert with_noise(plain, 0.0, seed=5) is plain


def test_the_real_truth_is_whole(shared_data: Path) -> None:
    models = {each.name: each for each in read_models(shared_data)}
    assert len(models) == 11
    assert [each.radius for each in models["PC101"].segments][:3] == [8.84622, 16.832, 16.832]
    for each in models.values():
        members = np.concatenate([segment.points for segment in each.segments])
        assert np.array_equal(np.unique(members), np.arange(len(each.cloud.offsets)))
    objects = {each.name: np.unique(each.objects).tolist() for each in read_tables(shared_data)}
    assert objects["learn36"] == [0, 1, 2, 3, 4]
