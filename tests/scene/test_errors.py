"""The error in the scene: colours of the arm, and the board that is clicked."""

from __future__ import annotations

import numpy as np
import pytest
import viser

from flexgui.core.challenge.challenge_rig import bare_model
from flexgui.scene import paint
from flexgui.scene.arm_scene import FAINT, ArmScene
from flexgui.scene.error_board import AWAY, EMPTY, ErrorBoard, cells, error_paint, shade
from flexgui.views import colours


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
    assert shown.ghost.beams[0].opacity == FAINT, "the ghost would hide the colours"
    assert error_paint({"theta1": 3.0}, 2, 10.0).beams == (None, None), "without a camera"
    usual = error_paint({}, 2, 1.0)
    shown.paint(usual.beams, usual.hubs)
    assert tuple(shown.model.hubs[0].color) == paint.STEEL
    assert tuple(shown.model.beams[0].color) == paint.MODEL
    assert shown.ghost.beams[0].opacity > FAINT


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
