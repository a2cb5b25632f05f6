"""The table under the arm and the shadow on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import viser

from flexgui.core.arm.slots import arm_vector
from flexgui.scene.arm_scene import ArmScene
from flexgui.scene.floor import (
    DARK,
    FINEST,
    LAYERS,
    LIGHT,
    PIXELS,
    RADIUS,
    shadow_faces,
    soft_strips,
    spacing,
    table_picture,
)
from flexgui.scene.paint import DEPTH, drawn_late
from tests.helpers import ARMS

REACHES = (0.08, 0.3, 1.0, 1.08, 2.4, 40.0)


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    started = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield started
    started.stop()


@pytest.mark.parametrize("reach", REACHES)
def test_lines_stand_at_round_numbers(reach: float) -> None:
    size = spacing(reach)
    assert FINEST * reach / 2.5 < size <= FINEST * reach
    picture = table_picture(reach, dark=False)
    row = picture[PIXELS // 2 + round(0.5 * size / (2.0 * RADIUS * reach) * PIXELS)]
    darker = np.flatnonzero(row[:, 1] < LIGHT[0][1] - 8)
    within = darker[np.abs(darker - PIXELS / 2) < 0.45 * PIXELS]
    places = ((within + 0.5) / PIXELS - 0.5) * 2.0 * RADIUS * reach / size
    assert len(np.unique(np.round(places))) >= 9
    assert np.abs(places - np.round(places)).max() < 0.05


@pytest.mark.parametrize(("dark", "colours"), [(False, LIGHT), (True, DARK)])
def test_the_table_is_round_and_clear_around(dark: bool, colours: tuple) -> None:
    picture = table_picture(1.0, dark)
    assert picture[0, 0, 3] == 0 and picture[PIXELS // 2, PIXELS // 2, 3] == 255
    found, counts = np.unique(picture[picture[..., 3] == 255][:, :3], axis=0, return_counts=True)
    assert tuple(found[np.argmax(counts)]) == colours[0]


def test_the_shadow_is_soft_round_and_on_the_table() -> None:
    line = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    strips = soft_strips([line], [0.1], 0.05, -0.3, 0.001)
    layers = strips.reshape(LAYERS, -1, 3)
    widths = np.ptp(layers[:, :, 1], axis=1)
    assert widths[0] == pytest.approx(0.3) and widths[-1] == pytest.approx(0.2)
    assert np.all(np.diff(widths) < 0.0) and np.all(np.diff(layers[:, 0, 2]) > 0.0)
    assert strips[:, 0].min() == pytest.approx(-0.15) and strips[:, 2].min() > -0.3
    faces = shadow_faces([strips.shape[0] // LAYERS // 2])
    assert set(faces.ravel()) == set(range(len(strips)))


def test_the_shadow_follows_the_arm(server: viser.ViserServer) -> None:
    arm = ARMS["2-2"]
    scene = ArmScene(server, arm, arm_vector(arm))
    before, q = np.array(scene.floor.shadow.vertices), np.zeros(arm.coordinates)
    q[0] = 1.0
    scene.show(q)
    after = np.array(scene.floor.shadow.vertices)
    assert after.shape == before.shape and np.abs(after - before).max() > 0.1 * scene.body.reach
    level = -DEPTH * scene.body.reach
    assert np.all(np.abs(after[:-2, 2] - level) < 0.02 * scene.body.reach)


def test_what_is_translucent_is_sorted_above_the_table() -> None:
    """By the middle of the box around all vertices."""
    late = drawn_late(np.array([[0.9, 0.8, -0.3]], dtype=np.float32), 1.0)
    middle = 0.5 * (late.min(axis=0) + late.max(axis=0))
    assert np.allclose(middle[:2], 0.0) and middle[2] > 1.0
