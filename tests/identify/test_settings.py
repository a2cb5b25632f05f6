"""Bounds, priors, starts and parameters of single recordings do what they say."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.core.identify.residuals import channel_weights
from flexgui.core.scenario.rig_spec import PriorSpec
from flexgui.sentences.identifiability import identifiability_sentences
from tests.helpers import PAPER, looped
from tests.identify.helpers import (
    EI,
    LPV,
    POINTS,
    clean,
    estimate,
    fit,
    noisy,
    residuals_of,
    simulated,
    with_channels,
)

EXACT = 1e-6
"""Relative: noise-free data of the same model."""

RATES = ("ydot1", "ydot2")
YDOT = {"output": ("ydot",)}
WRONG = {"EI": 0.85 * EI}
TWO = POINTS[2:4]


def data(count: int = 2):  # type: ignore[no-untyped-def]
    return list(clean()[2 : 2 + count])


def test_a_narrow_prior_wins_over_the_data():
    prior = {"EI": PriorSpec(value=0.9 * EI, std=1e-6 * EI)}
    fitted = fit(LPV, noisy(data(), 20.0, 1), parameters=("EI",), prior=prior, **YDOT)
    assert estimate(fitted, "EI").value == pytest.approx(0.9 * EI, rel=1e-3)
    assert estimate(fitted, "EI").std == pytest.approx(1e-6 * EI, rel=0.01)
    (said,) = identifiability_sentences(fitted.fit)
    assert said.startswith("The prior of EI and the recordings contradict each other")


def test_a_wide_prior_leaves_the_estimate_to_the_data():
    prior = {"EI": PriorSpec(value=0.9 * EI, std=10.0 * EI)}
    recordings = noisy(data(), 20.0, 1)
    pulled = fit(LPV, recordings, parameters=("EI",), prior=prior, **YDOT)
    free = fit(LPV, recordings, parameters=("EI",), **YDOT)
    for figure in ("value", "std"):
        pull, alone = (getattr(estimate(f, "EI"), figure) for f in (pulled, free))
        assert pull == pytest.approx(alone, rel=1e-6)
    assert not pulled.fit.contradicted


def test_prior_and_data_of_equal_precision_meet_half_way():
    rng = np.random.default_rng(1)
    recordings = [
        with_channels(r, {c: r[c] + 0.02 * rng.standard_normal(len(r.time)) for c in RATES})
        for r in data()
    ]
    free = estimate(fit(LPV, recordings, parameters=("EI",), **YDOT), "EI")
    believed = free.value * 1.003
    prior = {"EI": PriorSpec(value=believed, std=free.std)}
    found = estimate(fit(LPV, recordings, parameters=("EI",), prior=prior, **YDOT), "EI")
    assert found.std == pytest.approx(free.std / np.sqrt(2.0), rel=0.05)
    share = (found.value - free.value) / (believed - free.value)
    assert share == pytest.approx(0.5, abs=0.05)  # the stated deviation is itself an estimate


@pytest.mark.parametrize("generations", [0, 5])
def test_a_bound_holds_and_is_flagged(generations):
    bounds = {"EI": (0.5 * EI, 0.9 * EI)}
    fitted = fit(LPV, data(), parameters=("EI",), bounds=bounds, start=WRONG, population=6,
                 generations=generations, **YDOT)  # fmt: skip
    found = estimate(fitted, "EI")
    assert found.at_bound
    assert found.value == pytest.approx(0.9 * EI, rel=1e-5)
    assert found.value <= 0.9 * EI


def test_a_start_outside_the_bounds_is_refused():
    with pytest.raises(InputError, match="outside its bounds"):
        fit(LPV, data(), parameters=("EI",), bounds={"EI": (600.0, 700.0)}, **YDOT)


@pytest.mark.parametrize("setting", ["bounds", "prior"])
def test_settings_of_what_is_not_estimated_are_refused(setting):
    value = (400.0, 600.0) if setting == "bounds" else {"std": 1.0}
    with pytest.raises(InputError, match=rf"{setting} names 'EI2'.*did you mean 'EI1'"):
        fit(LPV, data(), parameters=("EI1",), **{setting: {"EI2": value}}, **YDOT)


@pytest.mark.parametrize(
    "settings, words",
    [
        ({"parameters": ("EI3",)}, "did you mean 'EI"),
        ({"parameters": ("epsilom",)}, "did you mean 'epsilon'"),
        ({"parameters": ("gain_z3",)}, "'z3' is not an output of this arm; known: "),
        ({"parameters": ("start_v9",)}, "is not a coordinate"),
        ({"start": {"EJ": 3.0}}, "'EJ' is not a parameter"),
    ],
)
def test_an_unknown_parameter_is_named_with_the_nearest(settings, words):
    with pytest.raises(InputError, match=words):
        fit(LPV, data(), **settings, **YDOT)


def test_a_parameter_of_each_recording_is_found_for_each():
    stiff, soft = 1.1e9, 0.9e9
    recordings = []
    for k, modulus in enumerate((stiff, soft)):
        segments = tuple(s.model_copy(update={"young_modulus": modulus}) for s in PAPER.segments)
        arm = PAPER.model_copy(update={"segments": segments})
        own = looped(arm, level="lpv")
        recordings += simulated(own, points=TWO, seconds=1.0)[k : k + 1]
    fitted = fit(LPV, recordings, per_recording=("epsilon",), **YDOT)
    assert [e.recording for e in fitted.fit.estimates] == ["th1", "th2"]
    assert fitted.vector == pytest.approx([stiff, soft], rel=EXACT)


def test_gains_and_offsets_are_recovered_exactly():
    recordings = [
        with_channels(r, {"deflection1": 0.937 * r["deflection1"] - 0.02}) for r in data()
    ]
    fitted = fit(
        LPV, recordings, parameters=("EI", "gain_deflection1"), offsets=("deflection1",),
        start=WRONG, output=("deflection",),
    )  # fmt: skip
    assert estimate(fitted, "gain_deflection1").value == pytest.approx(0.937, rel=EXACT)
    assert estimate(fitted, "EI").value == pytest.approx(EI, rel=EXACT)
    own = [estimate(fitted, "offset_deflection1", r.name).value for r in recordings]
    assert own == pytest.approx([-0.02, -0.02], rel=EXACT)


def test_a_gain_of_one_recording_is_recovered():
    first, second = data()
    second = with_channels(second, {"ydot2": 1.2 * second["ydot2"]})
    fitted = fit(LPV, [first, second], parameters=("EI",), per_recording=("gain_ydot2",), **YDOT)
    own = [estimate(fitted, "gain_ydot2", r.name).value for r in (first, second)]
    assert own == pytest.approx([1.0, 1.2], rel=EXACT)


def test_an_initial_state_is_recovered():
    moved = {"start_v1_1": 0.01, "start_v2_1": -0.02, "start_dtheta1": 0.2, "start_dv2_1": 0.1}
    settings = {"parameters": ("EI",), "initial_state": True, **YDOT}
    residuals = residuals_of(LPV, data(), **settings)
    labels = residuals.unknowns.labels
    truth = residuals.unknowns.parameters.vector()
    for name, value in moved.items():
        truth[labels.index(f"{name}@th4")] = value
    shifted = [
        with_channels(r, {"ydot1": y[:, 0], "ydot2": y[:, 1]})
        for r, y in zip(data(), residuals.predictor.predict(truth), strict=True)
    ]
    fitted = fit(LPV, shifted, start=WRONG, **settings)
    assert estimate(fitted, "EI").value == pytest.approx(EI, rel=EXACT)
    for name, value in moved.items():
        assert estimate(fitted, name, "th4").value == pytest.approx(value, rel=1e-5)
        assert estimate(fitted, name, "th3").value == pytest.approx(0.0, abs=1e-7)
    blind = {e.name for e in fitted.fit.estimates if not e.identifiable}
    assert blind >= {"start_theta1"}  # ydot does not see where the arm stands


def test_outputs_of_one_unit_weigh_the_same_and_others_by_their_spread():
    recordings = data()
    same = residuals_of(LPV, recordings, **YDOT).weights
    assert all(np.array_equal(w, np.ones(2)) for w in same)
    mixed = residuals_of(LPV, recordings, output=("ydot", "deflection"))
    for e, w in zip(mixed.experiments, mixed.weights, strict=True):
        assert np.all(w > 0.0)
        for k, (name, _) in enumerate(e.channels):
            together = np.concatenate([r[name] - r[name].mean() for r in recordings])
            assert w[k] == pytest.approx(1.0 / together.std())
    stated = channel_weights(mixed.experiments, {"ydot2": 7.0})
    assert stated[0][1] == 7.0
    assert stated[0][0] == mixed.weights[0][0]


def test_a_channel_of_weight_nearly_nothing_does_not_pull():
    recordings = [with_channels(r, {"ydot2": -r["ydot2"]}) for r in data()]
    weights = {"ydot1": 1.0, "ydot2": 1e-9}
    fitted = fit(LPV, recordings, parameters=("EI",), start=WRONG, weights=weights, **YDOT)
    assert estimate(fitted, "EI").value == pytest.approx(EI, rel=EXACT)


def test_a_masked_stretch_does_not_count():
    broken = []
    for r in data():
        bad = (r.time > 0.5) & (r.time < 1.0)
        spoilt = with_channels(r, {"ydot1": np.where(bad, 9.0, r["ydot1"])})
        broken.append(type(r)(**{**vars(spoilt), "counted": {"ydot1": ~bad}}))
    fitted = fit(LPV, broken, parameters=("EI",), start=WRONG, **YDOT)
    assert estimate(fitted, "EI").value == pytest.approx(EI, rel=EXACT)
    assert fitted.fit.residual_count == sum(2 * len(r.time) - 499 for r in broken)


def test_recordings_of_which_nothing_counts_are_refused():
    empty = [
        type(r)(**{**vars(r), "counted": {c: np.zeros(len(r.time), bool) for c in r.channels}})
        for r in data(1)
    ]
    with pytest.raises(InputError, match="no sample of its outputs counts"):
        fit(LPV, empty, parameters=("EI",), **YDOT)
