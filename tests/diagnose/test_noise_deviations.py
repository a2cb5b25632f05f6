"""Deviations where the encoders' noise shakes an arm that a servo leads along them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from flexgui.core.diagnose.base_fit import BaseFit
from flexgui.core.diagnose.cost_minimum import with_simulated_deviations
from flexgui.core.diagnose.refit import Refit, with_robust_covariance
from tests.diagnose import fits
from tests.helpers import rms

NOISE = 1e-5
"""rad, of both encoders."""

SEEDS = range(6)

WIDE_ENOUGH = 1.64
"""Deviations, rms over the seeds: of six right ones it is exceeded once in a hundred (chi square of
six is 16.2)."""

SILENT = 1e-9
"""rad: encoders that tell nothing of a noise."""

EQUAL = 1e-12
"""Relative: correlations are only multiplied and divided."""


@cache
def begun(seed: int) -> BaseFit:
    """The paper's arm under recorded torques, with nothing hidden."""
    return fits.begun(fits.on_paper(
        drive={"kind": "torque"},
        sensors={"encoder_noise": NOISE},
        identify={"parameters": ["EI", "m2"]},
        recordings=[{"simulate": {
            "theta2": 1.2, "seconds": 1.0, "sample_time": 0.002, "seed": seed,
            "excitation": "prbs", "amplitude": 2.0, "hold": 0.05,
        }}],
    ))  # fmt: skip


def off(refit: Refit) -> float:
    """Deviations by which EI is off."""
    h = refit.parametrised
    k = h.unknowns.labels.index("EI")
    true = begun(0).data.nuisance[0].parameter.value  # the paper's
    return float((h.vector[k] - true) / np.sqrt(refit.covariance[k, k]))


@pytest.mark.long
def test_deviations_hold_what_the_noise_did_to_the_estimates() -> None:
    plain = {seed: with_robust_covariance(begun(seed).base) for seed in SEEDS}
    wide = [
        off(with_simulated_deviations(begun(seed).data, fit, {})) for seed, fit in plain.items()
    ]
    assert rms(wide) < WIDE_ENOUGH < rms([off(fit) for fit in plain.values()])


def test_no_deviation_becomes_smaller_and_correlations_stay() -> None:
    before = with_robust_covariance(begun(0).base)
    after = with_simulated_deviations(begun(0).data, before, {})
    own = [np.sqrt(np.diag(fit.covariance)) for fit in (before, after)]
    assert np.all(own[1] >= own[0]) and np.any(own[1] > own[0])
    apart = [fit.covariance / np.outer(s, s) for fit, s in zip((before, after), own, strict=True)]
    assert apart[1] == pytest.approx(apart[0], rel=EQUAL)


def test_without_noise_deviations_stay_as_they_are() -> None:
    before = with_robust_covariance(begun(0).base)
    stated = {"theta1": SILENT, "theta2": SILENT}
    assert with_simulated_deviations(begun(0).data, before, stated).covariance == pytest.approx(
        before.covariance
    )


def test_what_has_no_deviation_gets_none() -> None:
    before = with_robust_covariance(begun(0).base)
    before.covariance[:] = np.nan
    assert with_simulated_deviations(begun(0).data, before, {}) is before
