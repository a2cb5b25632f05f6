"""A result as a script uses it: its covariance, its residuals, its prediction of other motions."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import flexgui as fg

EI = 520.8333
"""N m², of the paper's arm."""
OTHER_STEPS = 1e-6
"""rad: two simulations of one motion whose integrators chose their steps for themselves."""


def machine() -> fg.Project:
    drive = fg.drives.VelocityLoop(gains=(60.0, 30.0))
    return fg.project("paper", drive, model={"level": "nonlinear"})


@pytest.fixture(scope="module")
def found() -> fg.Identification:
    noise = {"camera_noise": 1e-4, "encoder_noise": 1e-5}
    recorded = machine().with_settings(sensors=noise).simulate(theta2=1.1, seconds=0.5, seed=4)
    settings = {"parameters": ["EI1", "EI2"], "output": ["z", "encoder"], "generations": 0}
    rig = fg.project(
        "paper", fg.drives.VelocityLoop(gains=(60.0, 30.0)), [recorded.recording],
        model={"level": "nonlinear"}, sensors=noise, identify=settings,
    )  # fmt: skip
    return rig.identify()


def references(samples: int = 400) -> pd.DataFrame:
    t = np.arange(samples) * 1e-3
    return pd.DataFrame({"t": t, "dtheta1_ref": 0.2 * np.sin(20.0 * t), "dtheta2_ref": 0.0 * t})


def test_the_covariance_has_the_deviations_on_its_diagonal(found: fg.Identification) -> None:
    table = found.covariance()
    assert list(table.index) == list(table.columns) == ["EI1", "EI2"]
    assert np.sqrt(np.diag(table)) == pytest.approx([found["EI1"].std, found["EI2"].std])
    assert np.allclose(table, table.T)


def test_residuals_are_measured_minus_modelled(found: fg.Identification) -> None:
    comparison = found.compare()
    table, one = comparison.residuals(), comparison.recordings[0]
    assert set(table["recording"]) == {each.recording for each in comparison.recordings}
    for channel in one.channels:
        assert np.allclose(
            table[channel.channel], channel.measured - channel.model, rtol=0.0, equal_nan=True
        )
    assert comparison.residuals(one.recording).equals(table)


def test_own_references_are_played_as_they_are(found: fg.Identification) -> None:
    predicted = found.simulate(references=references(), theta2=1.1).to_dataframe()
    assert np.allclose(predicted["t [s]"], references()["t"])
    assert np.allclose(predicted["dtheta1_ref [rad/s]"], references()["dtheta1_ref"])
    truth = machine().simulate(references=references(), theta2=1.1, noise=False).to_dataframe()
    assert found.values["EI1"] == pytest.approx(EI, rel=0.01)
    assert np.abs(predicted["theta1 [rad]"] - truth["theta1 [rad]"]).max() < 1e-4  # 1 % of EI


def test_stated_values_are_those_of_the_simulated_model() -> None:
    soft = machine().simulate(references=references(), theta2=1.1, values={"EI1": 100.0})
    same = fg.project(
        {"preset": "paper", "EI": [100.0, EI]}, fg.drives.VelocityLoop(gains=(60.0, 30.0)),
        model={"level": "nonlinear"},
    ).simulate(references=references(), theta2=1.1)  # fmt: skip
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
        machine().simulate(references=table)
