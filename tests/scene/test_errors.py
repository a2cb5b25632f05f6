"""The error in the scene: colours of the arm, and the board that is clicked."""

from __future__ import annotations

import numpy as np
import pytest
import viser

from flexgui.core.challenge.challenge_rig import bare_model
from flexgui.page.layout import Window, aspect, covered
from flexgui.page.scene_panel import ASPECT
from flexgui.scene import paint
from flexgui.scene.arm_scene import ArmScene
from flexgui.scene.error_board import AWAY, EMPTY, ErrorBoard, cells, error_paint, shade
from flexgui.scene.paint import DEPTH, lowered
from flexgui.views import colours
from tests.scene.test_view import in_sight, on_picture


@pytest.fixture(scope="module")
def stage():
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    model = bare_model()
    yield ArmScene(server, model.arm, model.numbers().p), server
    server.stop()


def test_hubs_show_the_encoders_and_beams_the_camera(stage) -> None:
    shown, _ = stage
    now = error_paint({"theta1": 30.0, "theta2": 1.0, "camera": 0.7}, 2, 30.0)
    assert now.hubs == (shade(1.0), shade(0.0)) and now.beams == (shade(0.0), shade(0.0))
    shown.paint(now.beams, now.hubs)
    assert [tuple(h.color) for h in shown.model.hubs] == list(now.hubs)
    assert tuple(shown.model.tip.color) == now.beams[-1]
    assert error_paint({"theta1": 3.0}, 2, 10.0).beams == (None, None), "without a camera"
    usual = error_paint({}, 2, 1.0)
    shown.paint(usual.beams, usual.hubs)
    assert tuple(shown.model.hubs[0].color) == paint.STEEL
    assert tuple(shown.model.beams[0].color) == paint.MODEL


def test_a_drive_shows_its_missing_torque_where_nothing_else_is_measured() -> None:
    bare = error_paint({"u1": 30.0, "i2": 1.0}, 2, 30.0)
    assert bare.hubs == bare.beams == (shade(1.0), shade(0.0))
    seen = error_paint({"u1": 30.0, "theta1": 1.0, "deflection1": 1.0}, 1, 30.0)
    assert seen.hubs == seen.beams == (shade(0.0),)


def test_the_measured_arm_leaves_the_colours_of_the_model_free(stage) -> None:
    """Its body is lower and wider: from above both are seen."""
    shown, _ = stage
    for own, other in zip(shown.model.beams, shown.ghost.beams, strict=True):
        used = np.asarray(other.vertices)[: len(own.vertices)]
        assert used[:, 2].max() < own.vertices[:, 2].max()
        assert np.ptp(used[:, 1]) > 2.0 * np.ptp(own.vertices[:, 1])


@pytest.mark.parametrize("front", [0.0, -0.12])
@pytest.mark.parametrize("window", [Window(1600.0, 900.0), Window(1280.0, 720.0)])
def test_from_home_the_board_stands_between_the_arm_and_the_time_line(
    stage, front: float, window: Window
) -> None:
    """So it covers neither the arm nor the camera, which is above the arm."""
    shown, server = stage
    q = np.zeros((3, shown.body.arm.coordinates))
    q[:, 0] = np.linspace(0.0, np.arcsin(front), 3)
    shown.show(q[-1])
    shown.show_paths(q)
    board = ErrorBoard(shown, server, np.ones((12, 9)), [str(k) for k in range(12)], None)
    reach, view = shown.body.reach, shown.view(min(aspect(window), ASPECT))
    down = lowered(view, covered(window))
    view = view._replace(position=view.position + down, look_at=view.look_at + down)
    foot = np.array([0.0, -0.06 * reach, -DEPTH * reach])
    lowest = min(on_picture(view, place)[1] for place in (foot, *np.concatenate(shown.pose.beams)))
    for u in (0.0, 1.0):
        assert on_picture(view, board._point(u, 0.0))[1] < lowest
        assert in_sight(view, aspect(window), board._point(u, 1.0))
        assert on_picture(view, board._point(u, 1.0))[1] > 2.0 * covered(window) - 1.0
    shown.detach("error board")
    shown.show_paths(None)


def test_a_ray_through_a_cell_finds_it(stage) -> None:
    shown, server = stage
    ratio = np.linspace(1.0, 50.0, 21).reshape(3, 7)
    board = ErrorBoard(shown, server, ratio, ("a", "b", "c"), None)
    eye = np.array([0.6, -2.4, 2.5])
    for row, column in np.ndindex(ratio.shape):
        place = board._point((column + 0.5) / 7, (row + 0.5) / 3)
        assert board.cell(eye, place - eye) == (row, column)
    assert board.cell(eye, board._point(1.2, 0.5) - eye) is None
    assert board.cell(eye, np.cross(AWAY, [0.0, 0.0, 1.0])) is None, "along the board"
    board.mark(1, 0.99)
    shown.detach("error board")


def test_cells_have_the_colours_of_their_errors() -> None:
    picture = cells(np.array([[1.0, np.nan], [100.0, 10.0]]))
    size = picture.shape[0] // 2
    assert tuple(picture[1, 1]) == (*colours.rgb(colours.RISING[0][1]), 255), "as in the maps"
    assert tuple(picture[1, size + 1]) == EMPTY
    assert tuple(picture[size + 1, 1]) == (*shade(1.0), 255)
    assert picture[size - 1, 1, 3] == 0, "a gap between the rows"
