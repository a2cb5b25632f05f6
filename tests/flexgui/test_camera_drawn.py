"""A camera is drawn only where the recording holds what one saw."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from flexgui.page.scene_panel import has_camera

FILE, SIMULATED = SimpleNamespace(simulate=None), SimpleNamespace(simulate=object())


def session(columns: tuple[str, ...] | None, *specs: Any) -> Any:
    recording = None if columns is None else SimpleNamespace(has=lambda *n: set(n) <= set(columns))
    scenario = SimpleNamespace(recordings=specs)
    playback, document = SimpleNamespace(recording=recording), SimpleNamespace(scenario=scenario)
    return cast(Any, SimpleNamespace(playback=playback, document=document))


@pytest.mark.parametrize(
    ("columns", "drawn"), [(("theta1", "z1", "z2"), True), (("theta1", "z1"), False), ((), False)]
)
def test_what_the_recording_holds_decides(columns: tuple[str, ...], drawn: bool) -> None:
    assert has_camera(session(columns, FILE)) == drawn


def test_a_file_that_was_not_read_yet_shows_no_camera() -> None:
    assert not has_camera(session(None, SIMULATED, FILE))
    assert has_camera(session(None, SIMULATED))
    assert has_camera(session(None))
