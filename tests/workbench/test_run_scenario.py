"""From a scenario to its outcome: roles, methods, variants, notes."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.core.progress import Silent
from flexgui.core.results import Outcome
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario_fits import MEAN_LABEL
from flexgui.core.simulate.nonlinear import DEFAULT_TOLERANCE
from flexgui.core.workbench import run_scenario
from flexgui.sentences.identifiability import notes

BASE = """
title = "small"
[arm]
preset = "paper"
[drive]
gains = [60.0, 30.0]
[identify]
parameters = ["EI"]
output = "ydot"
generations = 0
METHOD
[[recordings]]
name = "a"
simulate = {theta2 = 0.8, seconds = 0.4, level = "lpv", snr_db = 20}
[[recordings]]
name = "b"
simulate = {theta2 = 1.6, seconds = 0.4, level = "lpv", snr_db = 20, seed = 2}
[[recordings]]
name = "c"
role = "validate"
simulate = {theta2 = 2.2, seconds = 0.4, level = "lpv", seed = 3}
[[compare]]
title = "soft"
arm = {young_modulus = 0.5e9}
identify = false
[[compare]]
title = "two modes"
arm = {modes = 2}
"""

EI = 1e9 * 0.05**4 / 12.0


def scenario(method: str = "") -> Scenario:
    return parse_scenario(BASE.replace("METHOD", method), "small.toml")


@cache
def outcome(method: str = "") -> Outcome:
    return run_scenario(scenario(method))


def test_a_glocal_fit_uses_the_estimation_recordings_only():
    found = outcome()
    assert len(found.fits) == 1
    assert found.fits[0].recordings == ("a", "b")
    assert [c.role for c in found.comparisons] == ["estimate", "estimate", "validate"]
    assert {c.fit_label for c in found.comparisons} == {found.fits[0].label}


def test_local_fits_are_one_per_recording_and_validation_takes_their_mean():
    found = outcome('method = "local"')
    assert [f.recordings for f in found.fits] == [("a",), ("b",)]
    labels = [c.fit_label for c in found.comparisons]
    assert labels == ["a", "b", MEAN_LABEL]


def test_validation_is_predicted_well_by_what_was_identified():
    validation = outcome().comparisons[2]
    fitted = [c for c in validation.channels if c.fitted]
    assert all(c.fit_percent > 99.0 for c in fitted)


def test_the_descriptor_model_holds_the_estimate():
    found = outcome()
    value = found.fits[0].estimates[0].value
    stiffness = [x for x in found.model.A_terms.ravel() if x < 0.0]
    assert value == pytest.approx(EI, rel=0.02)
    assert any(x == pytest.approx(-4.0 * value * 0.5) for x in stiffness)


def test_a_variant_at_its_stated_values_is_not_fitted():
    soft, modes = outcome().variants
    assert soft.estimates == ()
    assert [e.name for e in modes.estimates] == ["EI"]
    base = outcome().comparisons[0].channels[0].rms
    assert soft.comparisons[0].channels[0].rms > 2.0 * base


def test_what_was_done_is_said():
    text = " ".join(notes(outcome()))
    assert "Compared output: ydot" in text
    assert "Model level: full equations; the linear model misses" in text


class Stopped(Silent):
    """Stopped from the beginning."""

    def stopped(self) -> bool:
        return True


@pytest.mark.long
def test_a_stopped_run_still_has_an_outcome():
    spec = scenario().model_copy(
        update={"identify": scenario().identify.model_copy(update={"generations": 30})}
    )
    found = run_scenario(spec, progress=Stopped())
    assert found.fits[0].stopped
    assert len(found.fits[0].convergence) <= 1
    assert len(found.comparisons) == 3
    assert np.isfinite(found.comparisons[0].channels[0].rms)


def test_offsets_of_a_validation_recording_are_fitted_to_it_alone():
    changed = scenario().identify.model_copy(update={"offsets": ("ydot1",)})
    found = run_scenario(scenario().model_copy(update={"identify": changed, "compare": ()}))
    assert "Fitted to this recording alone: offset_ydot1." in found.comparisons[2].note
    assert {e.recording for e in found.fits[0].estimates} == {None, "a", "b"}


SHORT = {"simulate": {"theta2": 1.0, "seconds": 0.3}}
FAST = {"simulate": {"theta2": 1.0, "seconds": 0.3, "excitation": "jump"}}


@pytest.mark.parametrize(
    "change, words",
    [
        ({"recordings": ()}, "no \\[\\[recordings\\]\\]"),
        ({"recordings": ({"simulate": {"theta2": 1.0}, "role": "validate"},)}, "role = .estimate"),
        ({"recordings": ({"file": "gone.csv"},)}, "gone.csv was not found"),
        ({"drive": {"kind": "veloc"}}, "kind 'veloc' is not known"),
        ({"drive": {"gains": (1.0, 2.0, 3.0)}}, "gains has 3 values"),
        ({"rig": {"gear_ratio": (2.0, 2.0, 2.0)}}, "gear_ratio has 3 numbers"),
        ({"identify": {"parameters": ("EI7",)}}, "'EI7' is not a parameter"),
        ({"identify": {"parameters": ("EI",), "offsets": ("i1",)}}, "'i1' is not an output"),
        ({"identify": {"bounds": {"m1": (1.0, 9.0)}}}, "bounds names 'm1'"),
        ({"identify": {"start": {"m1": -1.0}}}, "start: m1 is -1"),
        ({"diagnose": {"candidates": ("rust",)}}, "candidates: 'rust' is not known"),
        ({"recordings": (SHORT | {"hidden": {"rust": {}}},)}, "hidden.rust is not known"),
        ({"recordings": (FAST,)}, "excitation 'jump' is not known"),
        ({"model": {"effects": ({"id": "colomb"},)}}, "did you mean 'coulomb_friction'"),
    ],
)
def test_what_cannot_be_run_is_refused(change, words):
    document = {**scenario().model_dump(exclude_defaults=True), **change}
    with pytest.raises(InputError, match=rf"^Scenario 'small': (?!Scenario).*{words}"):
        run_scenario(Scenario.model_validate(document), folder=Path())


TRUE_MODEL = """
title = "as it is"
[arm]
preset = "paper"
modes = 3
[drive]
gains = [60.0, 30.0]
[model]
level = "nonlinear"
[identify]
parameters = ["EI1"]
refine = false
generations = 0
[[recordings]]
name = "a"
simulate = {theta2 = 1.2, seconds = 0.4, seed = 1}
"""


def test_a_model_that_no_descent_refines_is_simulated_as_exactly_as_its_recordings() -> None:
    (found,) = run_scenario(parse_scenario(TRUE_MODEL, "true.toml")).comparisons
    errors = {c.channel: float(np.sqrt(np.mean(c.residual**2))) for c in found.channels}
    assert max(errors[name] for name in ("z1", "z2", "theta1", "theta2")) < DEFAULT_TOLERANCE
