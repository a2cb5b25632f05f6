"""A result as a script uses it: its covariance, its residuals, its prediction of other motions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

import flexgui as fg
from tests.library.rigs import EI, LOOP, QUICK, rig

OTHER_STEPS = 1e-6
"""rad: two simulations of one motion whose integrators chose their steps for themselves."""


@pytest.fixture(scope="module")
def found() -> fg.Identification:
    noise = {"camera_noise": 1e-4, "encoder_noise": 1e-5}
    recorded = rig(sensors=noise).simulate(theta2=1.1, seconds=0.5, seed=4)
    return rig([recorded.recording], sensors=noise, identify=QUICK).identify()


def references(samples: int = 400) -> pd.DataFrame:
    t = np.arange(samples) * 1e-3
    return pd.DataFrame({"t": t, "dtheta1_ref": 0.2 * np.sin(20.0 * t), "dtheta2_ref": 0.0 * t})


@pytest.fixture(scope="module")
def loads() -> fg.Identification:
    """Of an arm that carries another load in each recording."""
    made = [
        rig().simulate(theta2=1.1, seconds=0.2, seed=k, name=name, values={"mt2": load})
        for k, (name, load) in enumerate(LOADS.items())
    ]
    settings = {**QUICK, "parameters": ["EI1"], "per_recording": ["mt2"]}
    return rig(made, identify=settings).identify()


LOADS = {"empty": 0.1, "full": 1.5}
"""kg"""
NEAR = 1e-3
"""Relative: what is identified without noise."""


@pytest.mark.long
def test_what_belongs_to_a_recording_is_named_with_it(loads: fg.Identification) -> None:
    for name, load in LOADS.items():
        assert loads[f"mt2@{name}"].value == pytest.approx(load, rel=NEAR)
    with pytest.raises(fg.InputError, match="'mt2' differs by recording; .*mt2@empty, mt2@full"):
        loads["mt2"]
    table = loads.covariance()
    assert table.index.is_unique and list(table.index) == list(table.columns)
    assert {"mt2@empty", "mt2@full"} < set(table.index)
    mechanism = loads.outcome.mechanism
    assert mechanism is not None, "what is exported is of one recording and says which"
    assert mechanism.links[1].tip_mass == pytest.approx(LOADS["empty"], rel=NEAR)
    assert any("mt2 of empty" in note for note in loads.outcome.notes)


@pytest.mark.parametrize("name", LOADS)
def test_a_model_has_the_values_of_the_recording_that_is_meant(
    loads: fg.Identification, name: str
) -> None:
    truth = {"mt2": LOADS[name]}
    modes = loads.linear(theta2=1.1, recording=name).modes
    expected = rig().linear(theta2=1.1, values=truth).modes
    assert modes[0].frequency == pytest.approx(expected[0].frequency, rel=NEAR)
    played = {"references": references(), "theta2": 1.1}
    z = loads.simulate(recording=name, **played).recording["z1"]
    assert np.abs(z - rig().simulate(values=truth, **played).recording["z1"]).max() < 1e-5


def test_a_value_that_differs_by_recording_is_asked_for(loads: fg.Identification) -> None:
    for asked in (loads.linear, loads.simulate):
        with pytest.raises(fg.InputError, match="mt2 differs by recording; add recording="):
            asked(theta2=1.1)
        with pytest.raises(fg.InputError, match="'ful' was not fitted; did you mean 'full'"):
            asked(theta2=1.1, recording="ful")
    stated = loads.linear(theta2=1.1, values={"mt2": 0.1})
    assert stated.modes[0].frequency == pytest.approx(
        loads.linear(theta2=1.1, recording="empty").modes[0].frequency, rel=NEAR
    )


def test_covariance_and_residuals_are_those_of_the_fit(found: fg.Identification) -> None:
    table = found.covariance()
    assert list(table.index) == list(table.columns) == [e.label for e in found.parameters]
    assert np.sqrt(np.diag(table)) == pytest.approx([e.std for e in found.parameters])
    assert np.allclose(table, table.T)
    comparison = found.compare()
    left, one = comparison.residuals(), comparison.recordings[0]
    for channel in one.channels:
        assert np.allclose(
            left[channel.channel], channel.measured - channel.model, rtol=0.0, equal_nan=True
        )
    assert comparison.residuals(one.recording).equals(left)
    with pytest.raises(fg.InputError, match="start: m1 is -1; it must be greater than 0"):
        found.given.with_settings(identify={"start": {"m1": -1.0}}).identify()


def test_own_references_are_played_as_they_are(found: fg.Identification) -> None:
    predicted = found.simulate(references=references(), theta2=1.1).to_dataframe()
    assert np.allclose(predicted["t [s]"], references()["t"])
    assert np.allclose(predicted["dtheta1_ref [rad/s]"], references()["dtheta1_ref"])
    truth = rig().simulate(references=references(), theta2=1.1, noise=False).to_dataframe()
    assert found.values["EI1"] == pytest.approx(EI, rel=0.01)
    assert np.abs(predicted["theta1 [rad]"] - truth["theta1 [rad]"]).max() < 1e-4  # 1 % of EI


def test_stated_values_are_those_of_the_simulated_model() -> None:
    soft = rig().simulate(references=references(), theta2=1.1, values={"EI1": 100.0})
    arm = {"preset": "paper", "EI": [100.0, EI]}
    same = fg.project(arm, LOOP, model={"level": "nonlinear"})
    same = same.simulate(references=references(), theta2=1.1)
    z, expected = (s.to_dataframe()["z1 [m]"] for s in (soft, same))
    assert np.abs(z - expected).max() < OTHER_STEPS


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        (references().drop(columns="dtheta2_ref"), "no column dtheta2_ref"),
        (references().assign(t=lambda f: f["t"] ** 2), "not even"),
        (references().assign(dtheta1_ref=np.nan), "empty cell"),
    ],
    ids=["a column is missing", "uneven times", "an empty cell"],
)
def test_what_cannot_be_played_is_one_sentence(table: pd.DataFrame, sentence: str) -> None:
    with pytest.raises(fg.InputError, match=sentence):
        rig().simulate(references=table)


@pytest.mark.parametrize("index", ["rows", "t [s]", "durations"])
def test_a_simulation_is_played_again_from_its_own_table(index: str) -> None:
    first = rig().simulate(theta2=1.1, seconds=0.4, seed=3)
    table = first.to_dataframe()
    if index != "rows":
        table = table.set_index("t [s]")
    if index == "durations":
        table.index = pd.to_timedelta(table.index, unit="s").rename(None)
    table["dtheta1_ref [deg/s]"] = np.degrees(table.pop("dtheta1_ref [rad/s]"))
    again = rig().simulate(references=table, theta2=1.1)
    assert np.abs(again.recording["z1"] - first.recording["z1"]).max() < OTHER_STEPS


ASKED = {
    "simulated": lambda rig, values: rig.simulate(theta2=1.1, seconds=0.1, values=values),
    "linearised": lambda rig, values: rig.linear(theta2=1.1, values=values),
    "compared": lambda rig, values: rig.compare(values),
}


@pytest.mark.parametrize("asked", ASKED.values(), ids=ASKED)
@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"EI1": -1.0}, "values: EI1 is -1; it must be greater than 0"),
        ({"EI1": 0}, "values: EI1 is 0; it must be greater than 0"),
        ({"mt1": -1}, "values: mt1 is -1; it must be at least 0"),
        ({"EI1": "x"}, "values: EI1 is 'x'; it must be a number"),
        ({"EI1": None}, "values: EI1 is None; it must be a number"),
        ({"EI1": float("nan")}, "values: EI1 is nan; it must be a number"),
        ({"EI11": 1.0}, "values: 'EI11' is not a parameter of this arm; did you mean 'EI1'"),
    ],
)
def test_a_value_that_cannot_be_is_one_sentence(
    asked: Callable[..., object], values: dict[str, float], sentence: str, found: fg.Identification
) -> None:
    with pytest.raises(fg.InputError, match=sentence):
        asked(found.given, values)


@pytest.mark.parametrize("level", ["nonlinear", "lpv"])
def test_a_motion_begins_in_the_state_that_is_stated(level: str) -> None:
    rest = references().assign(dtheta1_ref=0.0)
    state = {"theta1": 0.02, "dtheta1": 0.1, "v2_1": 1e-3}
    begun = rig().simulate(references=rest, theta2=1.1, state=state, level=level).recording
    rate = np.diff(begun["theta1"])[0] / begun.sample_time
    assert begun["theta1"][0] == pytest.approx(0.02)
    assert 0.0 < rate < 0.1  # the loop brakes at once
    assert begun["deflection2"][0] == pytest.approx(0.5 * 1e-3)  # v l of the shape v x^2
    still = rig().simulate(references=rest, theta2=1.1, level=level).recording
    assert np.ptp(still["z2"]) < OTHER_STEPS < np.ptp(begun["z2"])


@pytest.mark.parametrize(
    ("state", "sentence"),
    [({"dtheta3": 0.1}, "state: 'dtheta3' is no coord"), ({"theta1": "x"}, "theta1 is 'x'")],
)
def test_a_state_that_cannot_be_is_one_sentence(state: dict[str, float], sentence: str) -> None:
    with pytest.raises(fg.InputError, match=sentence):
        rig().simulate(theta2=1.1, seconds=0.1, state=state)


def test_what_a_complete_model_leaves_follows_no_input(found: fg.Identification) -> None:
    analysis = found.residual_analysis()
    table = analysis.to_dataframe()
    inputs = table[table["with"] != "itself"]
    assert set(inputs["with"]) == {"dtheta1_ref", "dtheta2_ref"}
    assert inputs["outside"].mean() < 0.1
    assert "with the inputs" in repr(analysis)
    for view in ("correlations", "responses"):
        assert analysis.plot(view).data
    with pytest.raises(fg.InputError, match="no recording 'x'"):
        analysis.plot(recording="x")
