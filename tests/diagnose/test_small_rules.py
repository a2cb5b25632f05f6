"""Rules of a line or two, each of which once hid something."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexgui.core import linear_or_nonlinear
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.noise.repeated_motions import Group, Stretch, repeated_groups, unrepeated_rms
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.sensors import sensor
from tests.noise import floors


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


@pytest.mark.parametrize("decimate", [1, 2, 5, 7])
@pytest.mark.parametrize("period", [200, 202, 205, 210, 211])
def test_an_error_that_repeats_exactly_is_no_noise_whatever_is_decimated(
    period: int, decimate: int
) -> None:
    """Cycles that were not whole compared samples were compared at different instants."""
    recording = floors.clean(1e-3, 2.0, "prbs", 1)
    e = prepare(floors.BARE, recording, [sensor("z")], Processing(decimate=decimate))
    draws = np.random.default_rng(period).standard_normal((2, 3 * period))
    smooth = ZeroPhaseLowPass(cutoff_hz=20.0).apply(draws[0], 1e-3)[period : 2 * period]
    references = np.resize(smooth, (len(recording.time), 1)) * np.ones(2)
    e = replace(e, task=replace(e.task, references=references))
    error = np.resize(draws[1, :period], (len(recording.time), 1))[::decimate] * np.ones(2)
    groups = repeated_groups([e])
    assert groups or period % decimate
    assert all(rms < 1e-12 for rms in unrepeated_rms(groups, [e], [error]).values())


def test_a_channel_without_a_number_decides_the_level(monkeypatch: Any) -> None:
    """The next channel's ratio took its place."""
    recording = floors.clean(1e-3, 1.0, "prbs", 1)
    known = defaultdict(lambda: SimpleNamespace(value=1.0), z1=SimpleNamespace(value=np.nan))
    monkeypatch.setattr(linear_or_nonlinear, "channel_floors", lambda *_: known)
    found = linear_or_nonlinear.choose_level(
        floors.BARE, [sensor("z")], Processing(), [recording], {}, 1e-3
    )
    assert found.level == "nonlinear" and found.channel == "z1"
