"""The floor under the arm: few lines, which fade away from where it works."""

from __future__ import annotations

import numpy as np
import pytest
import viser

from flexgui.scene.arm_scene import ArmScene
from flexgui.scene.paint import (
    AIM,
    DEPTH,
    FINEST,
    RADIUS,
    ROOT,
    add_floor,
    floor_lines,
    light_of,
    spacing,
)
from tests.scene.test_scene import fresh, server, stage_of

__all__ = ["fresh", "server"]

PIECES_AT_MOST = 400
"""Each costs some 15 us of every picture without a graphics card."""

SINGLE = 1e-5
"""Of the reach: places are single precision."""

REACHES = (0.08, 0.3, 1.0, 1.08, 2.4, 40.0)


@pytest.mark.parametrize("reach", REACHES)
def test_lines_stand_at_round_numbers_within_a_circle(reach: float) -> None:
    points, strength, strong = floor_lines(reach)
    size = spacing(reach)
    assert len(points) <= PIECES_AT_MOST
    assert FINEST * reach / 2.5 < size <= FINEST * reach
    same = np.isclose(points[:, 0, :2], points[:, 1, :2], atol=SINGLE * reach)
    assert np.all(same.sum(axis=1) == 1)
    place = points[:, 0, :2][same] / size
    assert np.allclose(place, np.round(place), atol=1e-4)
    away = np.linalg.norm(points[..., :2] - np.array(AIM[:2]) * reach, axis=2)
    assert np.allclose(points[..., 2], -DEPTH * reach)
    assert np.all(away <= (RADIUS + SINGLE) * reach)
    assert np.allclose(strength, 1.0 - away / (RADIUS * reach), atol=1e-4)
    assert 0 < strong.sum() < len(strong)


@pytest.mark.parametrize("dark", [False, True])
def test_lines_end_in_the_ground(fresh: viser.ViserServer, dark: bool) -> None:
    found = add_floor(fresh.scene, "/floor", 1.0, not dark, fine=False)
    found.set_dark(dark)
    assert isinstance(found.node, viser.LineSegmentsHandle)
    colours = np.asarray(found.node.colors, dtype=int)
    at_the_edge = floor_lines(1.0)[1] < 1e-4
    assert at_the_edge.any()
    edge = np.unique(colours[at_the_edge])
    assert len(edge) == 1
    others = colours[~at_the_edge]
    assert np.all(others >= edge) if dark else np.all(others <= edge)
    assert others.min() < others.max()


def test_points_are_seen_in_the_colour_that_was_asked_for() -> None:
    """The filmic curve itself, as three.js computes it for grey, is the oracle."""
    for wanted in (20, 60, 128, 200, 225):
        v = light_of((wanted, wanted, wanted))[0] / 0.6
        seen = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081)
        srgb = 12.92 * seen if seen <= 0.0031308 else 1.055 * seen ** (1.0 / 2.4) - 0.055
        assert np.isclose(255.0 * srgb, wanted, atol=1e-3)
    assert np.array_equal(light_of((255, 255, 255)), np.ones(3))


def test_only_fine_light_computes_every_pixel_of_the_floor(fresh: viser.ViserServer) -> None:
    plain, q = stage_of(fresh)
    assert isinstance(plain.floor.node, viser.LineSegmentsHandle)
    fresh.scene.reset()
    fine = ArmScene(fresh, plain.body.arm, plain.body.p, q, fine=True)
    assert isinstance(fine.floor.node, viser.GridHandle)
    assert f"{ROOT}_floor" in fresh.scene._handle_from_node_name
