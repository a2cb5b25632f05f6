"""An effect is offered with those of its parameters that nothing estimates yet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm, Segment
from flexgui.core.diagnose.candidates import applicable
from flexgui.core.drives.torque import Torque
from flexgui.core.effects.sizes import typical
from flexgui.core.estimate.problem import FitData
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.unknowns import Unknown
from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.results import NOTHING, Outcome
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.sensors import sensor
from flexgui.core.workbench import run_scenario
from tests.programs.sample.torque_rigs import TorqueRig, written

MASSES, STATED = (3.0, 2.0), 6.0
"""kg, of both links; what the data sheet says of the second."""
RIG = TorqueRig(MASSES, (0.5, 0.4), rate=200.0, seconds=1.5, recordings=1)
CHANNELS = ("u1", "u2", "theta1", "theta2")
RIGHT = 1e-3
"""Of a mass. The other engine's torques hold for a sample, as the model's; what is left is the
encoders' noise, which moves a mass by 5e-4 (three of the stated standard deviations)."""


def diagnosed(free: str, candidates: str, folder: Path) -> Outcome:
    text = written(RIG, 3, folder).read_text(encoding="utf-8")
    for wrong, stated in ((0.9 * MASSES[0], MASSES[0]), (0.9 * MASSES[1], STATED)):
        assert f"mass = {wrong!r}" in text
        text = text.replace(f"mass = {wrong!r}", f"mass = {stated!r}")
    text = text.replace('["m1", "m2"]', free).replace("max_effects = 4", candidates)
    return run_scenario(parse_scenario(text, "rig"), folder=folder)


@pytest.mark.long
def test_a_wrong_mass_is_named_where_that_of_another_link_is_estimated(tmp_path: Path) -> None:
    """A drive's gain, which scales all masses alike, was proposed."""
    found = diagnosed('["m1"]', "max_effects = 2", tmp_path).diagnosis
    assert found is not None and found.kept == ("link_mass_error",)
    assert found.final_verdict == NOTHING
    assert tuple(found.values[n] for n in ("m1", "m2")) == pytest.approx(MASSES, rel=RIGHT)
    assert "link_mass_error" not in found.not_applicable


@pytest.mark.parametrize("estimated, offered", [((), {"m1", "m2"}), (("m1",), {"m2"})])
def test_only_parameters_that_nothing_estimates_are_offered(
    estimated: tuple[str, ...], offered: set[str]
) -> None:
    arm = Arm(segments=tuple(Segment(length=0.5, mass=m, modes=0) for m in MASSES))
    bare, still = Model(arm, Torque()), np.zeros(20)
    recording = Recording("r", 0.01 * np.arange(20), dict.fromkeys(CHANNELS, still))
    one = prepare(bare, recording, [sensor("encoder")], Processing())
    nuisance = tuple(Unknown(bare.parameters[name]) for name in estimated)
    data = FitData(bare, (one,), nuisance, (np.ones(2),), {}, {}, typical(arm), 1)
    (candidate,) = applicable(data, (), ("link_mass_error",))
    assert applicable(data, (), ("link_mass_error",)) == [candidate]  # one object in all rounds
    sizes = candidate.parameters(arm, bare.drive, data.sizes)
    assert {k.parameter.name for k in sizes} == offered


def test_an_effect_that_is_estimated_as_a_whole_is_not_offered(tmp_path: Path) -> None:
    only = 'candidates = ["link_mass_error"]'
    found = diagnosed('["m1", "m2"]', only, tmp_path).diagnosis
    assert found is not None
    assert found.not_applicable == {"link_mass_error": "m1 and m2 are already estimated."}
    assert found.verdict == NOTHING
