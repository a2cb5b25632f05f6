"""Rules of a line or two, each of which once hid something."""

from __future__ import annotations

from collections import defaultdict
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexgui.core.diagnose import linear_or_nonlinear
from flexgui.core.diagnose.repeated_motions import Group, Stretch, unrepeated_rms
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.sensors import sensor
from tests.diagnose import floors


@pytest.mark.parametrize("kind, moved", [("ydot", np.sqrt(2.0)), ("y", 0.0), ("z", 0.0)])
def test_only_places_drift_from_cycle_to_cycle(kind: str, moved: float) -> None:
    """The means of a speed's cycles are its noise; the rule went by the first letter."""
    recording = floors.clean(1e-3, 1.0, "prbs", 1)
    e = prepare(floors.BARE, recording, [sensor(kind)], Processing())
    half = len(e.measured) // 2
    block = np.ones_like(e.measured)
    block[half:] = -1.0
    found = unrepeated_rms([Group((Stretch(0, 0), Stretch(0, half)), half)], [e], [block])
    assert list(found.values()) == pytest.approx([moved, moved])


def test_a_channel_without_a_number_decides_the_level(monkeypatch: Any) -> None:
    """The next channel's ratio took its place."""
    recording = floors.clean(1e-3, 1.0, "prbs", 1)
    known = defaultdict(lambda: SimpleNamespace(value=1.0), z1=SimpleNamespace(value=np.nan))
    monkeypatch.setattr(linear_or_nonlinear, "channel_floors", lambda *_: known)
    found = linear_or_nonlinear.choose_level(
        floors.BARE, [sensor("z")], Processing(), [recording], {}, 1e-3
    )
    assert found.level == "nonlinear" and found.channel == "z1"
