"""What an encoder's noise makes of a torque along a recorded motion, and what it does not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexgui.core.results import ChannelComparison, Outcome
from flexgui.core.scenario.read import read_scenario
from flexgui.core.workbench import run_scenario
from tests.helpers import rms
from tests.programs.sample.torque_rigs import TorqueRig, written

FAST_LINK = TorqueRig((3.0,), (0.6,), rate=2000.0, bits=16, seconds=2.0, recordings=1)
FAST_PAIR = TorqueRig((4.0, 2.5), (0.5, 0.4), rate=2000.0, bits=13, counts=0.3, seconds=2.0)
SLOW_PAIR = TorqueRig(
    (4.0, 2.5), (0.5, 0.4), rate=200.0, bits=18, seconds=4.0, coulomb=(1.99, 0.12)
)

LIKE_WITHIN = 3.0
"""Times the rms within, of a twentieth of the samples at either end; it was some hundred times."""

MEAN = 0.3
"""Of the rms: a mean of noise with some tens of independent samples; it was twice the rms."""


def fitted(rig: TorqueRig, folder: Path, most: int = 0) -> Outcome:
    path = written(rig, 7, folder)
    text = path.read_text("utf-8").replace("max_effects = 4", f"max_effects = {most}")
    path.write_text(text, "utf-8")
    return run_scenario(read_scenario(path), folder=folder)


def left(one: ChannelComparison) -> np.ndarray:
    """(n,) of what counts."""
    return np.asarray(one.residual[one.counted])


def test_the_ends_of_a_torque_do_not_rule_its_error(tmp_path: Path) -> None:
    x = left(fitted(FAST_LINK, tmp_path).comparisons[0].channels[0])
    few = len(x) // 20
    within = rms(x[few:-few])
    assert rms(x[:few]) < LIKE_WITHIN * within and rms(x[-few:]) < LIKE_WITHIN * within


def test_the_square_of_a_noisy_speed_is_no_torque(tmp_path: Path) -> None:
    channels = [c for r in fitted(FAST_PAIR, tmp_path).comparisons for c in r.channels]
    for x in map(left, channels):
        assert abs(x.mean()) < MEAN * rms(x)


def test_a_loop_that_feeds_its_encoders_back_hides_none_of_their_noise(tmp_path: Path) -> None:
    """The torque foretells what the encoders read; their noise was taken for a fourth of what it
    is, and what is left beside the friction for something that is not listed."""
    found = fitted(SLOW_PAIR, tmp_path, most=2).diagnosis
    assert found is not None and found.final_verdict == "nothing_missing"
    assert [s.added for s in found.steps] == [None, "coulomb_friction"]


def test_a_torque_that_its_own_loop_makes_rough_is_not_noisy(tmp_path: Path) -> None:
    """The viscous friction is 2 % of a torque that the feedback of a coarse encoder shakes by three
    times as much from sample to sample."""
    rig = TorqueRig((3.0,), (0.6,), rate=2000.0, bits=14, counts=0.3, seconds=3.0, viscous=(0.08,))
    found = fitted(rig, tmp_path, most=2).diagnosis
    assert found is not None
    assert [s.added for s in found.steps] == [None, "viscous_friction"]
    values = {e.name: e.value for e in found.parameters}
    assert values["fv1"] == pytest.approx(0.08, rel=0.05)
