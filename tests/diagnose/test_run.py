"""A scenario with [diagnose], from its file to what the run hands on."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from flexgui.core.diagnose import search_round
from flexgui.core.noise.output_noise import stated_noise
from flexgui.core.progress import Silent
from flexgui.core.results import UNJUDGED, Diagnosis, Outcome
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.core.workbench import run_scenario
from flexgui.sentences.written import estimate_text
from flexgui.views.summary import summary
from tests.diagnose.fits import diagnosis_of, set_up

HIDDEN = "hidden = { coulomb_friction = { fc1 = 1.2, fc2 = 0.5 } }"


def text(diagnose: str = "", sensors: str = "", more: str = "", model: str = "") -> str:
    return f"""
title = "x"
[arm]
preset = "paper"
[drive]
kind = "velocity_loop"
gains = [60.0, 30.0]
[model]
level = "nonlinear"
{model}
[sensors]
camera_noise = 3e-5
encoder_noise = 1e-5
{sensors}
[identify]
parameters = ["EI1", "EI2"]
output = ["z", "encoder"]
generations = 0
{diagnose}
[[recordings]]
simulate = {{ theta2 = 1.2, seconds = 0.4, {more} {HIDDEN} }}
"""


def scenario(**parts: str) -> Scenario:
    return parse_scenario(text(**parts), "x")


def ran(progress: Silent | None = None, **parts: str) -> Outcome:
    return run_scenario(scenario(**parts), progress=progress)


FEW = '[diagnose]\ncandidates = ["coulomb_friction", "camera_delay"]\n'
ONE = FEW + "max_effects = 1"


@cache
def said(diagnose: str) -> Diagnosis:
    return diagnosis_of(scenario(diagnose=diagnose))


def test_a_table_without_effects_to_add_gives_a_ranking_and_no_final_verdict() -> None:
    found = said(FEW)
    assert (found.verdict, found.final_verdict) == ("missing", None)
    assert found.ranking[0].effect == "coulomb_friction"
    (step,) = found.steps
    sources = {e.channel.rstrip("12"): e.floor_source for e in step.errors}
    assert sources == {"z": "stated", "theta": "stated", "deflection": "estimated"}


@pytest.mark.long
def test_what_was_added_is_a_model_of_the_same_scenario() -> None:
    """The accepted effects, put into [model], leave nothing to find."""
    found = said(ONE)
    (entry,) = found.effects
    sizes = {k: v["start"] for k, v in entry.items() if isinstance(v, dict)}
    stated = ", ".join(f"{k} = {v}" for k, v in sizes.items())
    again = ran(diagnose=ONE, model=f'effects = [{{ id = "{entry["id"]}", {stated} }}]')
    assert again.diagnosis is not None
    assert again.diagnosis.verdict == "nothing_missing"
    assert again.diagnosis.steps[0].title == "The model with Coulomb friction"
    assert "Effect: Coulomb friction" in [e.title for e in again.equations]


@pytest.mark.long
def test_the_fidelity_adds_to_the_floor_as_an_independent_error() -> None:
    asked = '[diagnose]\ncandidates = ["camera_delay"]\nmax_effects = 0\nfidelity = '
    floors = [said(f"{asked}{share}").floors["z1"] for share in (0.05, 0.1)]
    half, whole = np.square(floors) - 3e-5**2
    assert whole == pytest.approx(4.0 * half, rel=1e-6)
    assert half > 0.0


def test_what_is_compared_is_what_the_ladder_counts_and_every_step_states_deviations() -> None:
    found = said(ONE)
    for signals, step in ((found.given, found.steps[0]), (found.left, found.steps[-1])):
        (recording,) = signals
        rms = {c.channel: np.sqrt(np.mean(c.residual[c.counted] ** 2)) for c in recording.channels}
        for error in step.errors:
            assert rms[error.channel] == pytest.approx(error.rms, rel=SAME_SIGNALS), error.channel
        assert step.parameters
        assert all(np.isfinite(e.std) for e in step.parameters if not e.at_bound)


SAME_SIGNALS = 0.01
"""Relative: the rms of the compared signals against the ladder's, which is simulated alike."""


class StopsAt(Silent):
    """Asks to stop once a progress text was seen."""

    def __init__(self, text: str) -> None:
        self.awaited, self.seen = text, False

    def advance(self, n: int = 1, text: str = "") -> None:
        self.seen = self.seen or text == self.awaited

    def stopped(self) -> bool:
        return self.seen


def test_a_stopped_diagnosis_says_so_leaves_the_fit_and_refits_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(search_round, "begin_refit", None)
    outcome = ran(StopsAt("Camera delay"), diagnose=ONE)
    assert outcome.fits
    assert outcome.diagnosis is not None
    assert outcome.diagnosis.stopped
    assert outcome.diagnosis.effects == ()
    assert outcome.diagnosis.verdict == UNJUDGED  # no effect is named


PAIR = '[diagnose]\ncandidates = ["coulomb_friction", "tip_payload"]\n'


def hidden_pair(limit: int) -> Diagnosis:
    document = text(diagnose=f"{PAIR}max_effects = {limit}").replace(
        HIDDEN, HIDDEN.replace("{ coulomb", "{ tip_payload = { mt2 = 0.2 }, coulomb")
    )
    return diagnosis_of(parse_scenario(document, "x"))


PINNED = """[identify]
parameters = ["epsilon", "d"]
generations = 0
bounds = {epsilon = [0.99e9, 1.05e9], d = [0.0499, 0.0501]}
"""


@pytest.mark.long
def test_a_bound_makes_nothing_identifiable() -> None:
    """Where only a product is shown, its factors have no deviations, on a bound too."""
    whole = text(diagnose='[diagnose]\ncandidates = ["camera_delay"]\nmax_effects = 0\n')
    before, after = whole.index("[identify]"), whole.index("[diagnose]")
    outcome = run_scenario(parse_scenario(whole[:before] + PINNED + whole[after:], "x"))
    found = outcome.diagnosis
    assert found is not None
    factors = {e.name: e for e in found.parameters if e.name in ("epsilon", "d")}
    assert len(factors) == 2 and not any(e.identifiable for e in factors.values())
    for e in (*factors.values(), *found.steps[0].parameters):
        assert "±" not in estimate_text(e)
    assert next(e for e in found.parameters if e.name == "EI").identifiable
    assert not any("All parameters are identifiable" in line for line in summary(outcome))


@pytest.mark.long
def test_at_the_limit_one_more_look_tells_whether_the_rest_is_on_the_list() -> None:
    found = hidden_pair(1)
    assert (found.verdict, found.final_verdict) == ("missing", "missing")
    assert [len(found.rounds), len(found.steps)] == [2, 2]
    assert found.rounds[-1].accepted is None
    assert found.rounds[-1].ranking[0].effect not in [e["id"] for e in found.effects]
    both = hidden_pair(2)
    assert both.final_verdict == "nothing_missing"
    assert {e["id"] for e in both.effects} == {"coulomb_friction", "tip_payload"}


def test_what_an_effect_includes_is_found_with_it() -> None:
    presliding = (
        "hidden = { presliding_friction = { fc1 = 1.2, fc2 = 0.5, zs1 = 0.01, zs2 = 0.01 } }"
    )
    document = text(diagnose='[diagnose]\ncandidates = ["presliding_friction"]\nmax_effects = 1')
    found = diagnosis_of(parse_scenario(document.replace(HIDDEN, presliding), "x"))
    names = {"fc1", "fc2", "zs1", "zs2"}
    listed = [e.name for e in found.steps[-1].parameters]
    assert set(listed[: len(names)]) == names and listed[len(names) :] == ["EI1", "EI2"]
    assert {e.name for e in found.ranking[0].parameters} == names
    sizes = {k: v for e in found.effects for k, v in e.items() if k != "id"}
    assert set(sizes) == names
    assert [e["id"] for e in found.effects] == ["coulomb_friction", "presliding_friction"]


def stated(**parts: str) -> dict[str, float]:
    given = scenario(**parts)
    return stated_noise(given, *set_up(given))


def test_stated_noise_belongs_to_the_channels_of_its_sensor() -> None:
    found = stated(sensors="torque_noise = 0.2\ndeflection_noise = 1e-4")
    assert found == {"z1": 3e-5, "z2": 3e-5, "theta1": 1e-5, "theta2": 1e-5, "u1": 0.2, "u2": 0.2,
                     "deflection1": 1e-4, "deflection2": 1e-4}  # fmt: skip


def test_noise_with_a_stated_ratio_has_no_stated_level() -> None:
    found = stated(more="snr_db = 20.0,")
    assert "z1" not in found
    assert found["theta1"] == 1e-5


def test_stated_noise_is_that_of_the_sensor_whatever_the_filter() -> None:
    """The filters' share is taken where the floor is (tests.noise.test_noise_floor)."""
    filtered = parse_scenario(
        text().replace("generations = 0", "generations = 0\nfilter = { cutoff_hz = 40.0 }"), "x"
    )
    assert stated_noise(filtered, *set_up(filtered))["z1"] == 3e-5


@pytest.mark.long
def test_an_early_effect_that_includes_a_simpler_one_gives_way_to_it() -> None:
    """A delay bends what dry friction leaves; once it is known the plain level is enough."""
    hidden = HIDDEN.replace("{ coulomb", "{ camera_delay = { td = 0.012 }, coulomb")
    kinds = '["presliding_friction", "camera_delay"]'
    document = text(diagnose=f"[diagnose]\ncandidates = {kinds}\nmax_effects = 2")
    found = diagnosis_of(parse_scenario(document.replace(HIDDEN, hidden), "x"))
    assert [step.added for step in found.steps] == [None, "coulomb_friction", "camera_delay"]
    assert found.steps[-1].cost_per_sample < 1.1
    friction = found.rounds[0].ranking[0]  # no candidate, so that no screen of the search has it
    assert friction.effect == "coulomb_friction" and friction.delta_bic is not None
    assert found.final_verdict == "nothing_missing"


SCENARIO = """
title = "One link on a turning base"

[[arm.segments]]
length = 0.8
mass = 3.0
EI = 300.0
modes = 1
hub_inertia = 0.05

[drive]
kind = "velocity_loop"
gains = [30.0]

[sensors]
camera_noise = 3e-5
encoder_noise = 1e-4
deflection_noise = 1e-5

[identify]
parameters = ["EI1"]
output = ["encoder", "z"]

[diagnose]
max_effects = 2
candidates = ["base_rotation", "joint_elasticity", "rotor_inertia", "drive_saturation"]
"""
RECORDING = """
[[recordings]]
role = "{role}"

[recordings.simulate]
seconds = 1.0
seed = {seed}
hidden = {{ base_rotation = {{ cp = 2e-5, Jp = {Jp} }} }}
"""
COLUMN, LIGHT = 0.3, 0.002
"""kg m²: of a column, and of nearly nothing."""


def diagnosis(Jp: float) -> Diagnosis:
    """Of two recordings and one that validates."""
    roles = ("estimate", "estimate", "validate")
    recordings = [RECORDING.format(role=r, seed=k + 1, Jp=Jp) for k, r in enumerate(roles)]
    found = run_scenario(parse_scenario(SCENARIO + "".join(recordings), "base.toml")).diagnosis
    assert found is not None
    return found


@pytest.mark.long
def test_a_column_that_turns_is_no_elastic_joint() -> None:
    found = diagnosis(COLUMN)
    assert found.kept == ("base_rotation",)
    values = {e.name: e.value for e in found.parameters}
    assert values["cp"] == pytest.approx(2e-5, rel=0.01)
    assert values["Jp"] == pytest.approx(COLUMN, rel=0.01)
    shares = {r.effect: r.refit_drop_percent for r in found.rounds[0].ranking}
    assert shares["base_rotation"] == pytest.approx(100.0, abs=0.5)
    assert (shares["joint_elasticity"] or 0.0) < 80.0


@pytest.mark.long
def test_a_base_without_inertia_acts_as_an_elastic_joint() -> None:
    """Nothing needless stays: the first fit of the base ended beside the minimum, and a limit of
    the drive that came in only led there."""
    found = diagnosis(LIGHT)
    assert found.kept == ("base_rotation",)
    shares = {r.effect: r.refit_drop_percent for r in found.rounds[0].ranking}
    assert (shares["joint_elasticity"] or 0.0) > 99.0
