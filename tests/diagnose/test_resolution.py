"""A model with too few bending shapes: that is named first, and no soft joint in its place."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import cast

import pytest

from flexgui.core.diagnose.base_fit import BaseFit
from flexgui.core.diagnose.diagnose import fit_base_to_recordings
from flexgui.core.diagnose.fit_problem import UNANCHORED_ERROR, enough_substeps, hypothesis
from flexgui.core.diagnose.linear_screen import Screen, ScreenedCandidate
from flexgui.core.diagnose.search_round import REFITTED, most_promising
from flexgui.core.diagnose.search_state import Options
from flexgui.core.effects import catalogue, effect
from flexgui.core.progress import Silent
from flexgui.core.scenario.schema import Scenario
from tests.diagnose.fits import diagnosis_of, on_paper, set_up

MODE = "extra_bending_mode"

ALL = 1.0
"""Per cent: what a first, coarse refit of the whole cause may leave; with the steps of one shape it
explained none of it."""

STARTS = ("EI1", "EI2"), (400.0, 680.0)
"""N m^2, of the segments that bend."""

ASKED = Options(candidates=("coulomb_friction",))
"""Of a search that only begins: whichever effects it might try, it compiles their arms meanwhile, a
minute for those of three shapes, and this one changes no arm."""


SENSORS = {"camera_noise": 3e-5, "encoder_noise": 1e-5}


def scenario(
    modes: tuple[int, int],
    hidden: dict[str, dict[str, float]],
    sensors: dict[str, float] = SENSORS,
    others: tuple[str, ...] = ("joint_elasticity", "backlash"),
) -> Scenario:
    """Sampled as a camera and its logger often are: at 500 Hz one step per sample serves one
    shape, and not two. The diagnosis may name further shapes and `others`."""
    start = {name: EI for name, EI, shapes in zip(*STARTS, modes, strict=True) if shapes}
    simulate = {"seconds": 1.0, "sample_time": 0.002, "hidden": hidden}
    return on_paper(
        arm={"preset": "paper", "modes": list(modes)},
        model={},
        sensors=sensors,
        identify={"parameters": list(start), "generations": 0, "start": start},
        diagnose={"max_effects": 2, "candidates": [MODE, *others]},
        recordings=[
            {"simulate": {**simulate, "theta2": 1.2}},
            {"simulate": {**simulate, "theta2": 2.2, "seed": 2}},
        ],
    )


@cache
def begun(modes: int) -> BaseFit:
    asked = scenario((modes, modes), {MODE: {}} if modes < 3 else {})
    setup, recordings = set_up(asked)
    return fit_base_to_recordings(setup, asked.identify, recordings, ASKED, Silent())


@pytest.mark.long
def test_a_missing_shape_is_named_though_a_soft_joint_imitates_it() -> None:
    """Of the second segment alone: where both bend, the arms that are tried take a minute to
    compile, and the steps of one shape then explain most of the cause; here they explain none."""
    found = diagnosis_of(scenario((0, 2), {MODE: {}}))
    assert [step.added for step in found.substeps] == [None, MODE]
    assert found.final_verdict == "nothing_missing"
    (named,) = (r for r in found.rounds[0].ranking if r.effect == MODE)
    assert named.refit_drop_percent == pytest.approx(100.0, abs=ALL)


def screened(kind: str, explained: float) -> ScreenedCandidate:
    """What straight lines say of an effect; `explained` squared floors."""
    nothing = ((), (), (), ())
    return ScreenedCandidate(
        effect(kind), explained, 1, 1.0, 0.0, explained, explained, {}, *nothing
    )


def test_a_finer_model_is_refitted_however_little_straight_lines_show_of_it() -> None:
    """In one recording of a beam with one shape an elastic joint, its rotor at a bound, was named:
    the stiffness imitated the missing shapes so well that five effects seemed to explain more.
    With a stiffness a third off straight lines show nothing of the shapes at all."""
    others = sorted(set(catalogue()) - {MODE})[: REFITTED + 2]
    found = [screened(kind, 1000.0 - k) for k, kind in enumerate(others)] + [screened(MODE, 10.0)]
    seen = cast(Screen, SimpleNamespace(candidates=found))
    assert [s.effect.kind for s in most_promising(seen, 100)] == [*others[:REFITTED], MODE]
    nothing = [*found[:-1], screened(MODE, 0.0)]
    seen = cast(Screen, SimpleNamespace(candidates=nothing))
    assert [s.effect.kind for s in most_promising(seen, 100)] == [*others[:REFITTED], MODE]


@pytest.mark.long
def test_a_soft_joint_is_named_where_the_shapes_suffice() -> None:
    hidden = {"joint_elasticity": {"Jh1": 0.1, "Jh2": 0.05, "c1": 3e-4, "c2": 6e-4}}
    found = diagnosis_of(scenario((0, 1), hidden))
    assert [step.added for step in found.substeps] == [None, "joint_elasticity"]


def test_more_shapes_get_the_steps_that_they_need() -> None:
    """A further mode swings several times as fast, and what steps miss of it is not taken off."""
    data = begun(1).data
    assert data.substeps is not None
    more = hypothesis(data, [effect(MODE)], {})
    plain = replace(data, substeps_by_modes=None, anchor=None)
    assert (
        more.substeps
        == enough_substeps(plain, [effect(MODE)], {}, UNANCHORED_ERROR)
        > data.substeps
    )
