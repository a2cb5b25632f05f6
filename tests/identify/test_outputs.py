"""Every output, at both levels of the model, gives back the stiffness it was made with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.core.identify.compare import compare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.setup import PREFERENCE, make_setup
from flexgui.core.recording.recording import LoggerFilter, Recording
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import NoiseLevels
from tests.helpers import PAPER, looped
from tests.identify.helpers import (
    EI,
    LPV,
    estimate,
    fit,
    residuals_of,
    simulated,
    with_channels,
    without,
)

LEVELS = {"lpv": LPV, "nonlinear": looped(PAPER)}

EXACT = {"lpv": 1e-6, "nonlinear": 1e-3}
"""Relative. A simulation inside a fit may be wrong by 1e-5 m, which is 0.1 % of the bending."""

OUTPUTS = ["y", "ydot", "z", "encoder", "deflection"]
WRONG = {"EI": 0.85 * EI}
POINTS = (0.8, 1.9)


def data(level: str, **spec) -> list[Recording]:  # type: ignore[no-untyped-def]
    return simulated(LEVELS[level], **{"points": POINTS, "seconds": 0.8, **spec})


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("output", [*OUTPUTS, ("z", "deflection", "encoder")], ids=str)
def test_the_stiffness_is_recovered(output, level):
    fitted = fit(LEVELS[level], data(level), parameters=("EI",), start=WRONG, output=output)
    assert estimate(fitted, "EI").value == pytest.approx(EI, rel=EXACT[level])


@pytest.mark.parametrize("level", LEVELS)
def test_rates_from_a_sampled_tip_take_the_same_route_as_the_models(level):
    """Without ydot in the recording both sides are differences of sampled places."""
    made = simulated(looped(PAPER), points=POINTS, seconds=0.8)
    recordings = [without(r, "ydot") for r in made]
    fitted = fit(LEVELS[level], recordings, parameters=("EI",), start=WRONG, output="ydot")
    tolerance = 0.01 if level == "lpv" else EXACT[level]  # the motion itself is not linear
    assert estimate(fitted, "EI").value == pytest.approx(EI, rel=tolerance)


def test_a_slow_camera_is_enough():
    model = LEVELS["nonlinear"]
    recordings = simulated(model, points=POINTS, seconds=0.8, noise=NoiseLevels({}, 100.0))
    assert np.isnan(recordings[0]["z1"]).mean() == pytest.approx(0.9)
    fitted = fit(model, recordings, parameters=("EI",), start=WRONG, output="z")
    assert fitted.fit.residual_count == 2 * 2 * 80
    assert estimate(fitted, "EI").value == pytest.approx(EI, rel=EXACT["nonlinear"])


def test_a_filter_and_decimation_act_on_both_sides():
    settings = {"filter": ZeroPhaseLowPass(cutoff_hz=40.0), "decimate": 5}
    fitted = fit(LPV, data("lpv"), parameters=("EI",), start=WRONG, output="ydot", **settings)
    assert estimate(fitted, "EI").value == pytest.approx(EI, rel=EXACT["lpv"])
    assert fitted.fit.residual_count == 2 * 2 * 160


def test_a_loggers_low_pass_is_undone_by_telling_of_it():
    lag = LoggerFilter(60.0, 0.9)
    told = [replace(r, logger_filters={"deflection1": lag, "deflection2": lag})
            for r in data("lpv")]  # fmt: skip
    y = residuals_of(LPV, told, output="deflection", parameters=("EI",)).predictor.predict(
        np.array([EI])
    )
    logged = [
        with_channels(r, {"deflection1": x[:, 0], "deflection2": x[:, 1]})
        for r, x in zip(told, y, strict=True)
    ]
    aware = fit(LPV, logged, parameters=("EI",), start=WRONG, output="deflection")
    assert estimate(aware, "EI").value == pytest.approx(EI, rel=EXACT["lpv"])
    unaware = [replace(r, logger_filters={}) for r in logged]
    misled = fit(LPV, unaware, parameters=("EI",), start=WRONG, output="deflection")
    assert abs(estimate(misled, "EI").value / EI - 1.0) > 0.01


def test_the_default_is_the_first_output_that_all_recordings_have():
    full = data("lpv")
    for k, kind in enumerate(PREFERENCE):
        gone = {c.name for each in PREFERENCE[:k] for c in sensor(each).channels(PAPER)}
        if "z1" not in gone and k:
            gone |= {"z1", "z2"} if kind != "z" else set()
        kept = [without(r, *gone) for r in full]
        chosen = make_setup(LPV, IdentifySpec(), kept).outputs[0].kind
        assert chosen == ("ydot" if kind == "z" else kind)  # ydot follows from z and encoders


def test_a_stretched_arm_gets_z_by_default_and_is_refused_ydot():
    stretched = data("nonlinear", points=(0.02,), seconds=0.3)
    model = LEVELS["nonlinear"]
    assert make_setup(model, IdentifySpec(), stretched).outputs[0].kind == "z"
    for output in ("y", "ydot"):
        with pytest.raises(InputError, match=r"within .* rad of 0.*choose .* output = \"z\""):
            fit(model, stretched, parameters=("EI",), output=output)


def test_recordings_without_any_output_are_refused():
    bare = [
        replace(r, channels={n: v for n, v in r.channels.items() if n.startswith("dtheta")})
        for r in data("lpv")
    ]
    with pytest.raises(InputError, match="share none of the outputs"):
        make_setup(LPV, IdentifySpec(), bare)


def test_all_outputs_are_compared_and_the_fitted_ones_marked():
    found = compare(LPV, data("lpv")[0], [sensor("ydot")], Processing(), {"EI": EI}, "all")
    fitted = {c.channel: c.fitted for c in found.channels}
    assert [name for name, yes in fitted.items() if yes] == ["ydot1", "ydot2"]
    assert {"z1", "z2", "y1", "deflection2", "theta1"} <= fitted.keys()
    assert all(c.rms < 1e-9 for c in found.channels)
    assert found.tip_rms is not None
    assert found.tip_rms < 1e-9


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("empty", [False, True])
def test_a_channel_is_compared_in_the_recordings_that_have_it(level: str, empty: bool) -> None:
    """One recording without camera took the camera out of the whole fit without a word."""
    whole, other = (without(r, "ydot", "y", "deflection") for r in data(level))
    none = {name: np.full(len(other.time), np.nan) for name in ("z1", "z2")}
    lacking = with_channels(other, none) if empty else without(other, "z")
    setup = make_setup(LEVELS[level], IdentifySpec(parameters=["EI"]), [whole, lacking])
    camera = setup.outputs[0].kind
    assert camera in ("z", "ydot")
    assert {s.kind for s in setup.outputs} == {camera, "encoder"}
    assert f"{camera} is not compared in {lacking.name}, which has no sample of it." in setup.notes
    fitted = fit(LEVELS[level], [whole, lacking], parameters=("EI",), start=WRONG)
    tolerance = 0.01 if camera == "ydot" else EXACT[level]
    assert estimate(fitted, "EI").value == pytest.approx(EI, rel=tolerance)
    assert fitted.fit.residual_count == 2 * 2 * 800 + 2 * 800


def test_an_output_that_is_asked_for_and_stands_in_no_recording_is_refused() -> None:
    bare = [without(r, "z", "ydot", "y") for r in data("lpv")]
    with pytest.raises(InputError, match="has no column z1"):
        make_setup(LPV, IdentifySpec(output=["z"]), bare)


def test_what_a_recording_lacks_is_not_shown_as_compared_in_it() -> None:
    lacking = without(data("lpv")[0], "z", "ydot", "y")
    found = compare(LPV, lacking, [sensor("z"), sensor("encoder")], Processing(), {"EI": EI}, "")
    fitted = {c.channel: c.fitted for c in found.channels}
    assert [name for name, yes in fitted.items() if yes] == ["theta1", "theta2"]
    assert "z1" not in fitted
