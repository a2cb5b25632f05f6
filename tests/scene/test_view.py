"""Where the viewer's eye stands: the arm in sight from every side."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.scene.paint import AIM, DIRECTIONS, SIDE, TOP, View, lowered, view_of

ASPECTS = (0.46, 0.7, 1.3, 2.0)
REACHES = (0.08, 0.3, 1.0, 1.08, 2.4, 40.0)


def on_picture(view: View, place: np.ndarray) -> tuple[float, float]:
    """To the right and up, in halves of the picture's height from its middle."""
    ahead = view.look_at - view.position
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, view.up)
    right = right / np.linalg.norm(right)
    to = place - view.position
    half = np.tan(0.5 * view.fov) * (to @ ahead)
    return to @ right / half, to @ np.cross(right, ahead) / half


def in_sight(view: View, aspect: float, place: np.ndarray) -> bool:
    right, up = on_picture(view, place)
    return bool((place - view.position) @ (view.look_at - view.position) > 0.0) and (
        abs(up) <= 1.0 and abs(right) <= aspect
    )


@pytest.mark.parametrize("side", DIRECTIONS)
@pytest.mark.parametrize("aspect", ASPECTS)
@pytest.mark.parametrize("reach", REACHES)
def test_base_and_aim_are_in_sight_from_everywhere(side: str, aspect: float, reach: float) -> None:
    view = view_of(reach, aspect, side)
    for place in (np.zeros(3), np.array(AIM) * reach):
        assert in_sight(view, aspect, place)


@pytest.mark.parametrize("side", DIRECTIONS)
@pytest.mark.parametrize("aspect", ASPECTS)
def test_a_motion_far_from_the_usual_place_is_in_sight(side: str, aspect: float) -> None:
    places = np.array([[0.0, 0.0, 0.0], [-1.0, -0.2, 0.0], [-0.3, -0.9, 0.0]])
    view = view_of(1.0, aspect, side, places)
    assert all(in_sight(view, aspect, place) for place in places)
    usual = view_of(1.0, aspect, side)
    assert not all(in_sight(usual, aspect, place) for place in places[1:]) or side == SIDE


@pytest.mark.parametrize("side", DIRECTIONS)
@pytest.mark.parametrize("share", [0.0, 0.2, 0.5])
def test_the_aim_stands_in_the_middle_of_what_a_panel_leaves(side: str, share: float) -> None:
    view = view_of(1.0, 1.0, side)
    down = lowered(view, share)
    moved = view._replace(position=view.position + down, look_at=view.look_at + down)
    _, height = on_picture(moved, view.look_at)
    assert height == pytest.approx(share, abs=1e-9)  # from -1 below to +1 above


def test_top_looks_down_and_side_along_the_plane() -> None:
    for side, least, most in ((TOP, 0.99, 1.0), (SIDE, 0.0, 0.1)):
        view = view_of(1.0, 1.0, side)
        ahead = view.look_at - view.position
        assert least <= abs(ahead[2]) / np.linalg.norm(ahead) <= most


def test_neither_a_model_that_diverges_nor_the_usual_motion_moves_the_eye() -> None:
    away = np.array([[np.nan, 0.0, 0.0], [1e9, 0.0, 0.0], [0.0, np.inf, 0.0]])
    near = np.array([[0.0, 0.0, 0.0], [0.6, 0.4, 0.0]])
    for places in (away, near):
        found = view_of(1.0, 1.0, places=places)
        assert np.array_equal(found.position, view_of(1.0, 1.0).position)
