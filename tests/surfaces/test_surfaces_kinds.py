"""Kinds that are nearly alike among noise are told apart once the surface has grown."""

import numpy as np
import pytest

import surfsig


@pytest.mark.parametrize(("height", "count"), [(0.35, 1500), (0.45, 2500)])
def test_a_low_ring_of_a_pipe_is_no_sphere(height: float, count: int) -> None:
    """A sphere is within three deviations of most of it, and the floor takes the lowest of its points."""
    noise = 0.01
    right = 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        angle, distance = rng.uniform(0, 2 * np.pi, count), 1 + noise * rng.normal(size=count)
        ring = np.column_stack(
            [distance * np.cos(angle), distance * np.sin(angle), rng.uniform(0, height, count)]
        )
        flat = round(count / (2 * np.pi * height))
        floor = np.column_stack([rng.uniform(-1.5, 1.5, (flat, 2)), noise * rng.normal(size=flat)])
        found = surfsig.find_surfaces(np.concatenate([ring, floor[np.hypot(floor[:, 0], floor[:, 1]) > 1]]))
        labels = found.labels[:count]
        surface = found[int(np.bincount(labels[labels >= 0]).argmax())]
        right += surface.kind == "cylinder" and abs(surface.radius - 1) < 0.01
    assert right >= 3
