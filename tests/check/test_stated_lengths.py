"""Lengths and stiffness that no arm has are refused; those that the camera contradicts are said."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm, Segment
from flexgui.core.check.case import Case
from flexgui.core.check.checks.stated_lengths import StatedLength
from flexgui.core.check.column_fault import ColumnFault
from flexgui.core.check.measured_recording import MeasuredRecording
from flexgui.core.check.run_checks import check_all
from flexgui.core.check.sized_faults import is_absurd
from flexgui.core.drives.torque import Torque
from flexgui.core.errors import InputError
from flexgui.core.model import Model
from flexgui.core.scenario.read import parse_scenario
from tests.check.faults import FAULTS
from tests.check.rigs import Rig


@pytest.mark.parametrize(
    "segment, sentence",
    [
        ("length = 5000.0, mass = 2.0, modes = 0",
         "length of segment 2 is 5000 m; no segment is longer than 100 m"),
        ("length = 0.4, mass = 2.0, EI = 2e-12", "segment 2: bends at .* State EI in N m²"),
        ("length = 0.4, mass = 2.0, width = 16, young_modulus = 2.1e11", "width in m"),
    ],
)  # fmt: skip
def test_a_segment_that_no_arm_has_is_refused_in_a_sentence(segment: str, sentence: str) -> None:
    first = "{ length = 0.5, mass = 3.0, modes = 0 }"
    text = f'title = "x"\n[arm]\nsegments = [{first}, {{ {segment} }}]\n'
    with pytest.raises(InputError, match=sentence):
        parse_scenario(text, "x.toml")


SEEN = 0.01
"""Of a length: what drawings and cameras are right within."""


TRUE = (0.5, 0.4)
"""m, of the links that the camera looks at."""


def looked_at(*stated: float, unit: float = 1.0) -> MeasuredRecording:
    """An arm that moves through its postures and bends a little, by its kinematics alone; as the
    scenario states its lengths, and with a camera in a unit of m."""
    t = 0.01 * np.arange(600)
    theta1, theta2 = 0.8 * np.sin(2.0 * t), 1.5 + 0.9 * np.sin(3.1 * t)
    way = np.exp(1j * theta1) * (TRUE[0] + TRUE[1] * np.exp(1j * (theta2 + 5e-3 * np.sin(40 * t))))
    channels = {"theta1": theta1, "theta2": theta2, "z1": way.real / unit, "z2": way.imag / unit}
    arm = Arm(segments=tuple(Segment(length=length, mass=2.0, modes=0) for length in stated))
    return MeasuredRecording("r", "estimate", t, channels, model=Model(arm, Torque()))


def lengths(one: MeasuredRecording) -> list[tuple[str, float]]:
    return [(f.channel, f.size) for f in StatedLength().find(Case(one))]


@pytest.mark.parametrize("factors", [(2.0, 1.0), (1.0, 30.0), (0.4, 1.0), (3.0, 0.5)])
def test_a_length_that_the_camera_contradicts_is_named(factors: tuple[float, float]) -> None:
    stated = [f * length for f, length in zip(factors, TRUE, strict=True)]
    wrong = [(f"l{k + 1}", f) for k, f in enumerate(factors) if f != 1.0]
    assert lengths(looked_at(*stated)) == [(n, pytest.approx(f, rel=SEEN)) for n, f in wrong]


def test_true_lengths_and_a_camera_in_another_unit_are_no_wrong_length() -> None:
    assert lengths(looked_at(*TRUE)) == []
    assert lengths(looked_at(*TRUE, unit=1e-3)) == []


@pytest.mark.parametrize("fault", ["degrees", "gear_ratio", "offset", "scale", "sign", "delay"])
def test_a_wrong_column_is_no_wrong_length(fault: str, rigs: list[Rig]) -> None:
    """Of links as they are stated, whatever the fault is put into."""
    for one, seed in product(rigs, range(6)):
        seeded = FAULTS[fault][0](one.cases[0].recording, np.random.default_rng(seed))
        assert seeded is not None
        assert not list(StatedLength().find(Case(seeded.recording, one.cases[1:])))
        assert lengths(seeded.recording) == []


def test_nothing_else_is_asked_of_another_arm(rigs: list[Rig]) -> None:
    recordings = []
    for case in rigs[1].cases:
        model = case.recording.model
        assert model is not None
        first, second = model.arm.segments
        segments = (first, second.model_copy(update={"length": 30.0 * second.length}))
        wrong = replace(model, arm=model.arm.model_copy(update={"segments": segments}))
        recordings.append(replace(case.recording, model=wrong))
    said = check_all(recordings)
    assert {(f.fault, f.channel) for f in said} == {("stated_length", "l2")}
    assert all("[arm] length of segment 2 is 15 m" in f.evidence for f in said)


@pytest.mark.parametrize(
    "factor, absurd", [(2e-7, True), (1e3, False), (3e2, False), (-1.0, False)]
)
def test_a_factor_beyond_a_unit_and_a_gear_is_absurd(factor: float, absurd: bool) -> None:
    assert is_absurd(ColumnFault("scale", ("u1",), factor, is_usual=False)) == absurd


@pytest.mark.long
def test_no_mend_is_offered_for_a_torque_of_an_absurd_size() -> None:
    from tests.check.test_wrong_columns import moved, torque_driven

    found = torque_driven().cases[1].recording
    headers = {n: n for n in found.channels}
    said = check_all([replace(moved(found, u1=2e-7 * found.channels["u1"]), headers=headers)])
    assert [(f.fault, f.channel, f.fix, f.is_fault) for f in said] == [("scale", "u1", None, False)]
    assert np.log10(said[0].size) == pytest.approx(np.log10(2e-7), abs=0.1)
