"""Parameters that the recordings cannot show are no unknowns, and stay neutral."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.diagnose.fit_problem import FitProblem, parametrised
from flexgui.core.diagnose.output_changes import trials
from flexgui.core.effects import effect
from flexgui.core.effects.sizes import typical
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import simulate_recording
from tests.helpers import PAPER, looped

BARE = looped(PAPER)


def data(*outputs: str) -> FitProblem:
    recording = simulate_recording(BARE, SimulateSpec(theta2=1.2, seconds=0.1), "r")
    e = prepare(BARE, recording, [sensor(kind) for kind in outputs], Processing())
    return FitProblem(BARE, (e,), (), (np.ones(len(e.channels)),), {}, {}, typical(PAPER), 1)


@pytest.mark.parametrize(("kind", "letter"), [("sensor_delay", "t"), ("sensor_gain", "g")])
@pytest.mark.parametrize(("outputs", "own"), [(("z", "encoder"), "e"), (("deflection",), "g")])
def test_only_compared_channels_are_unknown_and_tried(kind, letter, outputs, own):
    seen = data(*outputs)
    tried = parametrised(seen, [effect(kind)], {})
    names = [f"{letter}{own}1", f"{letter}{own}2"]
    assert list(tried.unknowns.labels) == names
    others = {n: v for n, v in tried.model.effect_values.items() if n not in names}
    every = effect(kind).parameters(PAPER, BARE.drive, typical(PAPER))
    assert len(others) == len(every) - len(names) and not any(others.values())
    base = parametrised(seen, [], {})
    assert [t.parameter for t in trials(base, effect(kind), seen)] == names
