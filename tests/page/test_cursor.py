"""The time-line's cursor moves in the figures without a figure being sent again."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.library.shipped import demo_scenario
from flexgui.session import playback
from flexgui.session.session import Session
from tests.page.helpers import press, sees
from tests.session.helpers import until

pytestmark = pytest.mark.long

AT = """() => [...document.querySelectorAll('.js-plotly-plot')].flatMap(node => {
  const k = (node.layout.shapes ?? []).findIndex(shape => shape.name === 'cursor');
  const line = node.querySelector(`.shapelayer path[data-index="${k}"]`);
  if (!line || !node.offsetParent) return [];
  const box = line.getBoundingClientRect(), own = node.getBoundingClientRect();
  const axis = node._fullLayout.xaxis;
  const middle = 0.5 * (box.left + box.right) - own.left - axis._offset;
  return [[axis.p2l(middle), node.layout.meta.cursor]];
})"""
"""Time in s at which each figure's line stands, and the key of the figure."""
SEEN = 0.02
"""s, a pixel or two of a figure over two or three seconds."""


def test_the_line_moves_and_the_figure_stays(page: Any, session: Session) -> None:
    press(page, "Data")
    until(lambda: session.playback.motion is not None and page.evaluate(AT))
    before = page.evaluate(AT)
    for time in (0.5, 1.25):
        session.playback.move(time=time)
        until(lambda time=time: np.isclose(page.evaluate(AT)[0][0], time, atol=SEEN))  # type: ignore[misc]
    assert [key for _, key in page.evaluate(AT)] == [key for _, key in before]
    page.set_viewport_size({"width": 1200, "height": 800})
    until(lambda: np.isclose(page.evaluate(AT)[0][0], 1.25, atol=SEEN))


def test_a_recording_that_is_not_read_yet_is_told_and_read_at_the_next_stage(
    page: Any, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def late(*_: Any) -> None:
        raise InputError("The worker was stopped.")

    press(page, "Diagnose")
    with monkeypatch.context() as patched:
        patched.setattr(playback.recorded, "read_one", late)
        assert session.open(demo_scenario())
        sees(page, "The worker was stopped.")
        sees(page, "The recording is not read yet")
    press(page, "Data")
    sees(page, "model as stated")
