"""From recordings of an arm that obeys one more law to that law, and to nothing where none is."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np
import pytest

import flexgui as fg
from flexgui.core.diagnose.memo import Memo
from flexgui.core.diagnose.search import Found, Move, Search
from flexgui.core.diagnose.search_options import Options
from flexgui.core.diagnose.stated_results import estimates
from flexgui.core.effects import effect
from flexgui.core.estimate.fit_result import FitResult, robust_covariance
from flexgui.core.estimate.fitted_model import FittedModel, fit_model
from flexgui.core.progress import Silent
from flexgui.core.propose import propose as proposing
from flexgui.core.propose.competition import competing_laws
from flexgui.core.propose.propose import propose
from flexgui.core.results import UNLISTED, LawTerm, Proposal, ProposedLaw
from flexgui.core.results.proposal import NO_CARRIER, WITHIN_NOISE
from flexgui.core.trajectory import Trajectory
from tests.diagnose import fits
from tests.diagnose.test_stated_effects import bare
from tests.propose.test_shapes import IN_NUMPY

DRIVE = fg.drives.VelocityLoop(gains=(60.0, 30.0))
NOISE = {"camera_noise": 3e-5, "encoder_noise": 1e-5}
IDENTIFY = {"parameters": ["EI1", "EI2"], "output": ["z", "encoder"]}

FOUND_VALUE = 0.03
"""Relative, of what is estimated from noisy recordings of 0.6 s."""

AT_THE_NOISE = 1.1
"""Times the floor: noise of thousands of samples alone stays below."""

WITHIN = 3.0
"""Standard deviations within which each point of a right law's picture lies: of a hundred points
one is further away in four pictures."""

SCATTERED = 1.5
"""Mean square of these distances at most: one by chance, of twenty points within 0.3, and less,
since the law was fitted to the same errors."""

ATTEMPTS = 15
"""Questions whether to stop: a search is in its first stage by then."""

SOON = 5.0
"""s, of a search that was stopped; whole ones take ten to a hundred."""


def recorded(
    angles: Sequence[float], law: dict[str, Any] | None = None, sensors: dict[str, float] = NOISE,
    **how: Any,
) -> list[dict[str, Any]]:  # fmt: skip
    """Short recordings of the paper's arm, which may obey a law."""
    machine = fg.project("paper", DRIVE, sensors=sensors, model={"level": "nonlinear"})
    machine = machine.with_effects(law) if law else machine
    made = [machine.simulate(theta2=x, seconds=0.6, seed=k, **how) for k, x in enumerate(angles)]
    return [{"table": m.to_dataframe(), "name": f"r{k}"} for k, m in enumerate(made)]


def project(recordings: list[dict[str, Any]]) -> fg.Project:
    """With a model that knows no law."""
    return fg.project(
        "paper", DRIVE, recordings, sensors=NOISE, model={"level": "nonlinear"}, identify=IDENTIFY
    )


@cache
def held() -> list[dict[str, Any]]:
    """The elbow is held by the cube of its angle."""
    law = fg.formula("joint2", "-a*theta2**3", a=0.3)
    return recorded((0.6, 1.3, 2.0), law, amplitude=0.5)


@cache
def spring() -> fg.Project:
    return project(held())


def only_law(found: Proposal, target: str, variable: str) -> ProposedLaw:
    """The first law, which is where it was hidden and leaves the noise alone."""
    assert found.reason == "" and not found.stopped and 1 <= len(found.laws) <= 3
    law = found.laws[0]
    assert (law.target, law.carrier.target, law.carrier.variable) == (target, target, variable)
    assert found.carriers[0].variable == variable and found.carriers[0].share > 0.95
    assert law.rms[0] > 10.0 > AT_THE_NOISE > law.rms[1]
    assert law.explained > 0.99 and law.delta_bic > 10.0
    for term in law.terms:
        away = distances(term)
        assert np.abs(away).max() < WITHIN and np.mean(away**2) < SCATTERED
    return law


def distances(term: LawTerm) -> np.ndarray:
    """(n,) of the drawn points from the drawn curve, in the points' standard deviations."""
    seen, drawn = np.isfinite(term.carrier.deviations), term.carrier
    curve = np.interp(drawn.places, term.places, term.values)
    return np.asarray(((drawn.values - curve) / drawn.deviations)[seen])


def values_of(law: ProposedLaw) -> dict[str, float]:
    return {e.name: e.value for e in law.parameters}


@pytest.mark.long
def test_a_spring_at_a_joint_is_found_with_its_stiffness_and_leaves_nothing_once_added() -> None:
    rig = spring()
    law = only_law(rig.propose(), "joint2", "theta2")
    assert law.formula == "a*theta2**3"
    assert values_of(law) == {"a": pytest.approx(-0.3, rel=FOUND_VALUE)}
    (term,) = law.terms
    assert term.values == pytest.approx(-0.3 * term.places**3, rel=FOUND_VALUE)
    assert (law.carrier.unit, law.carrier.value_unit) == ("rad", "N m")
    places = law.carrier.places
    visited = np.concatenate([r["table"].filter(regex="^theta2") for r in held()]).ravel()
    near = np.abs(visited - places[:, None]).min(axis=1) < places[1] - places[0]
    assert np.array_equal(np.isfinite(law.carrier.deviations), near), "no point elsewhere"
    assert 0 < near.sum() < len(near)
    assert np.isnan(law.unseen_rms).all(), "there are no validation recordings"
    after = rig.with_effects(law.settings).propose()
    assert after.reason == WITHIN_NOISE and not after.laws and not after.carriers


@pytest.mark.long
def test_a_stop_that_bends_is_found_with_its_place_and_holds_on_what_no_fit_has_seen() -> None:
    law = fg.formula("joint2", "-a*max(theta2 - c, 0)", a=2.0, c=1.2)
    recordings = recorded((0.6, 1.3, 1.9, 1.5), law, amplitude=2.0)
    recordings[-1]["role"] = "validate"
    found = only_law(project(recordings).propose(), "joint2", "theta2")
    assert found.formula == "a*max(theta2 - c, 0)"
    assert values_of(found) == {
        "a": pytest.approx(-2.0, rel=FOUND_VALUE), "c": pytest.approx(1.2, rel=FOUND_VALUE)
    }  # fmt: skip
    assert found.unseen_rms[0] > 10.0 > 2.0 > found.unseen_rms[1]


def test_what_a_camera_reads_too_much_is_found_in_its_channel() -> None:
    recordings = recorded((0.7, 1.5), fg.formula("z1", "a*z1**2", a=0.02))
    law = only_law(project(recordings).propose(), "z1", "z1")
    assert law.formula == "a*z1**2"
    assert values_of(law) == {"a": pytest.approx(0.02, rel=FOUND_VALUE)}
    assert law.parameters[0].unit == "1/m"


def test_where_nothing_is_missing_nothing_is_proposed() -> None:
    found = project(recorded((0.7, 1.5))).propose()
    assert found.reason == WITHIN_NOISE
    assert not found.laws and not found.carriers and not found.refused


def test_noise_that_is_larger_than_it_was_said_to_be_has_no_law() -> None:
    loud = recorded((0.7, 1.5), sensors={**NOISE, "camera_noise": 2e-4})
    found = project(loud).propose()
    assert found.reason == NO_CARRIER and not found.laws
    assert found.carriers[0].share < 0.05


@pytest.mark.long
def test_a_listed_effect_that_came_in_for_a_law_is_needless_beside_it() -> None:
    """A constant torque was found for a spring; with the spring nothing is left for it."""
    rig = spring().with_effects("torque_offset")
    fitted = fits.fitted(*fits.set_up(rig.scenario, rig.folder), rig.scenario)
    found = propose(fitted, added=1)
    assert found.laws[0].formula == "a*theta2**3" and found.needless == ("Torque offset",)


def along(law: ProposedLaw, motions: Sequence[Trajectory]) -> np.ndarray:
    """What a law adds along motions: its formula as Python reads it."""
    parts = []
    for m in motions:
        words = {"t": m.time - m.time[0], "friction": lambda x: np.sign(np.gradient(x))}
        for k in range(2):
            words |= {f"theta{k + 1}": m.q[:, k], f"dtheta{k + 1}": m.v[:, k]}
            words |= {f"u{k + 1}": m.torque[:, k]}
        value = eval(law.formula, {**IN_NUMPY, **words, **values_of(law)})
        parts.append(np.broadcast_to(value, m.time.shape))
    return np.concatenate(parts)


@pytest.mark.long
def test_laws_that_are_proposed_are_not_one_in_other_words(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of viscous friction: a damping is no other law than a torque over the speed."""
    motions = [motion for motion, _, _ in bare().base.problem.motions()]
    stated: list[FitResult] = []
    monkeypatch.setattr(
        proposing, "estimates", lambda refit: stated.append(refit) or estimates(refit)
    )
    found = propose(bare())
    assert found.laws and found.laws[0].target == "joint1"
    assert len(stated) == len(found.laws)
    for refit in stated:  # deviations of all laws hold for coloured noise
        assert np.array_equal(refit.covariance, robust_covariance(refit), equal_nan=True)
    for one, other in combinations(found.laws, 2):
        if one.target == other.target:
            a, b = along(one, motions), along(other, motions)
            assert np.linalg.norm(a - b) > 0.01 * np.linalg.norm(b), (one.formula, other.formula)


class Stopping(Silent):
    """Is stopped from the nth question on."""

    def __init__(self, after: int) -> None:
        self.asked, self.after = 0, after

    def stopped(self) -> bool:
        self.asked += 1
        return self.asked > self.after


@pytest.mark.parametrize("after", [0, ATTEMPTS])
def test_a_search_that_is_stopped_ends_soon_and_says_so(after: int) -> None:
    fitted = bare()
    began = time.perf_counter()
    found = propose(fitted, progress=Stopping(after))
    assert time.perf_counter() - began < SOON
    assert found.stopped and not found.laws


def searched(after: int = 10**9) -> tuple[Search, Found, FittedModel]:
    """A search that ended at once on a model without viscous friction; and the model with it."""
    fitted = bare()
    memo = Memo(fitted.validation, (), fitted.data.bare.arm.modes)
    search = Search(Options(), Stopping(after), None, memo)
    model = FittedModel(fitted.data, fitted.base, ())
    values = fitted.base.problem.all_values()
    complete = fit_model(fitted.data, [effect("viscous_friction")], values, lambda: False)
    return search, Found((Move(model),), ()), complete


def test_where_the_list_was_enough_no_law_is_looked_for() -> None:
    search, found, complete = searched()
    enough = found._replace(path=(*found.path, Move(complete, "Viscous", ("viscous_friction",))))
    assert competing_laws(search, enough) == enough


def test_a_listed_effect_that_the_limit_keeps_out_comes_before_a_law() -> None:
    search, found, _ = searched()
    kept_out = found._replace(proposed=("viscous_friction",))
    assert competing_laws(search, kept_out) == kept_out


def test_after_a_search_that_was_stopped_no_law_is_looked_for() -> None:
    search, found, _ = searched(after=0)
    assert competing_laws(search, found) == found


@pytest.mark.long
def test_a_listed_effect_that_imitates_a_law_is_not_named() -> None:
    """Viscous and dry friction take most of a root of the speed."""
    law = fg.formula("joint2", "-a*dtheta2/(abs(dtheta2) + 0.0005)**0.5", a=0.6)
    recordings = recorded((0.6, 1.3, 1.9, 1.5), law, amplitude=2.0)
    recordings[-1]["role"] = "validate"
    found = project(recordings).diagnose()
    assert found.verdict == UNLISTED and not found.added
    proposal = found.propose()
    assert proposal.needless
    first = proposal.laws[0]
    assert (first.target, first.carrier.variable) == ("joint2", "dtheta2")
    assert first.unseen_rms[1] < AT_THE_NOISE
