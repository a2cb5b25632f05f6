"""How sure a result is: bands of predictions, profiles of parameters, criteria."""

from __future__ import annotations

import numpy as np
import pytest

import flexgui as fg
from tests.library.rigs import QUICK, rig

NOISE = {"camera_noise": 1e-4, "encoder_noise": 1e-4}


def machine() -> fg.Project:
    return rig(sensors=NOISE)


def noisy(seed: int = 1, **identify: object) -> fg.Project:
    made = machine().simulate(theta2=1.1, seconds=0.3, seed=seed)
    return rig(made, sensors=NOISE, identify={**QUICK, **identify})


@pytest.fixture(scope="module")
def found() -> fg.Identification:
    return noisy().identify()


def test_measurements_lie_in_the_band_as_often_as_it_says(found: fg.Identification) -> None:
    level, inside = 0.9, []
    predicted = found.predict(theta2=0.8, seconds=0.3, level=level)
    table = predicted.to_dataframe()
    assert (table["z1 lower"] < table["z1"]).all() and (table["z1"] < table["z1 upper"]).all()
    assert predicted.plot().data and "90 % bands" in repr(predicted)
    for seed in range(5):
        seen = machine().simulate(theta2=0.8, seconds=0.3, seed=seed).recording
        moved = found.predict(theta2=0.8, seconds=0.3, level=level, seed=seed)
        for name in ("z1", "z2", "theta1", "theta2"):
            lower, upper = moved.band(name)
            inside.append(np.mean((seen[name] > lower) & (seen[name] < upper)))
    # 6,000 samples, and an estimate of the noise from 300.
    assert np.mean(inside) == pytest.approx(level, abs=0.04)
    assert set(predicted.noise) >= {"z1", "theta1"}


def test_a_band_without_noise_is_the_covariance_through_the_model(found: fg.Identification) -> None:
    """Against draws from the covariance."""
    rng, covariance = np.random.default_rng(0), found.covariance()
    names = list(covariance.index)
    draws = rng.multivariate_normal([found.values[n] for n in names], covariance, 40)
    motion = {"theta2": 0.8, "seconds": 0.2, "seed": 3}
    drawn = [
        found.simulate(values=dict(zip(names, draw, strict=True)), **motion).recording["z1"]
        for draw in draws
    ]
    spread = found.predict(**motion).spread["z1"]
    # 40 draws know a standard deviation within 11 %.
    assert np.linalg.norm(np.std(drawn, axis=0)) == pytest.approx(np.linalg.norm(spread), rel=0.35)


def test_the_profile_of_a_well_known_parameter_agrees_with_its_deviation(
    found: fg.Identification,
) -> None:
    profile, e = found.profile("EI1"), found["EI1"]
    lower, upper = profile.interval
    # 1.96 deviations on each side of what is nearly a parabola.
    assert (upper - e.value) / e.std == pytest.approx(1.96, rel=0.05)
    assert (e.value - lower) / e.std == pytest.approx(1.96, rel=0.05)
    assert list(profile.to_dataframe().columns[:2]) == ["EI1", "deviance"]
    assert profile.plot().data and "95 % interval" in repr(profile)
    with pytest.raises(fg.InputError, match="'EI3' is not estimated; did you mean"):
        found.profile("EI3")


@pytest.mark.long
def test_what_the_recordings_leave_free_has_no_end() -> None:
    """Young's modulus and width enter as epsilon d^4 alone."""
    free = noisy(parameters=["epsilon", "d"], bounds={"epsilon": [1e7, 1e11], "d": [0.005, 0.2]})
    found = free.identify()
    assert found.criteria is not None
    assert found.criteria.parameters == 2  # EI, which follows from both, is none
    profile = found.profile("epsilon")
    assert profile.interval == (-np.inf, np.inf)
    assert np.ptp(profile.found.values) > profile.found.estimate.value
    assert profile.found.deviance.max() < profile.found.threshold


def test_a_stopped_profile_holds_whole_fits_alone(found: fg.Identification) -> None:
    seen: list[str] = []

    def stop(update: fg.Update) -> bool:
        seen.append(update.text)
        return sum(text.startswith("EI1 =") for text in seen) < 3

    profile = found.profile("EI1", progress=stop)
    assert 1 <= len(profile.found.values) < 7
    assert (profile.found.deviance < 20.0).all()


def test_a_local_fit_needs_its_recording() -> None:
    machines = [
        machine().simulate(theta2=p, seconds=0.2, seed=k, name=f"r{k}")
        for k, p in enumerate((0.7, 1.4))
    ]
    local = rig(machines, sensors=NOISE, identify={**QUICK, "method": "local"}).identify()
    assert local.criteria is not None
    assert local.criteria.parameters == 8  # two of each recording, and where its joints begin
    with pytest.raises(fg.InputError, match="choose a recording of r0 and r1"):
        local.profile("EI1")
    assert np.isfinite(local.profile("EI1", recording="r1").interval).all()


def test_the_criteria_prefer_the_model_of_the_machine() -> None:
    missing = {"coulomb_friction": {"fc1": 1.2, "fc2": 0.5}}
    made = machine().simulate(theta2=1.1, seconds=0.3, hidden=missing)
    plain = rig(made, sensors=NOISE, identify=QUICK)
    whole = plain.with_effects("coulomb_friction")
    with_it, without = (p.identify().criteria for p in (whole, plain))
    assert with_it is not None and without is not None
    assert with_it.bic < without.bic and with_it.aic < without.aic and with_it.fpe < without.fpe
    assert with_it.parameters == without.parameters + 2
