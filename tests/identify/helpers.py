"""Fits of simulated recordings, set up as the workbench sets them up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from flexgui.core.identify.fit import Fitted, identify
from flexgui.core.identify.predictor import Predictor
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.residuals import Residuals, channel_weights
from flexgui.core.identify.setup import make_setup
from flexgui.core.identify.unknowns import collect_unknowns, fixed_values
from flexgui.core.model import Model
from flexgui.core.progress import Progress, Silent
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.simulate.experiment import NO_NOISE, NoiseLevels, simulate_recording
from tests.helpers import PAPER, looped

LPV = looped(PAPER, level="lpv")
"""The paper's model; its stiffness is that of design section 2."""

EI = 1e9 * 0.05**4 / 12.0
"""N m²"""

POINTS = tuple(np.pi / 8.0 * k for k in range(1, 8))
"""rad, the working points."""

BOX = {"epsilon": (0.8e9, 1.2e9), "d": (0.04, 0.06)}
"""±20 %"""

PAIR: dict[str, Any] = {"parameters": ("epsilon", "d"), "bounds": BOX, "output": ("ydot",)}


def simulated(
    model: Model,
    *,
    points: Sequence[float] = POINTS,
    seed: int = 1,
    noise: NoiseLevels = NO_NOISE,
    **spec: Any,
) -> list[Recording]:
    """One recording per working point, each with its own seed."""
    given = {"level": model.level, **spec}
    return [
        simulate_recording(
            model, SimulateSpec(theta2=x, seed=1000 * seed + k, **given), f"th{k + 1}", "estimate",
            noise,
        )
        for k, x in enumerate(points)
    ]  # fmt: skip


@cache
def clean() -> tuple[Recording, ...]:
    """The seven experiments of the linear model, without noise."""
    return tuple(simulated(LPV))


def noisy(recordings: Sequence[Recording], snr_db: float, seed: int) -> list[Recording]:
    """The same with white noise on ydot: SNR = 10 log10(cov y / cov noise) per channel."""
    rng = np.random.default_rng(seed)
    found = []
    for r in recordings:
        changed = {}
        for name in ("ydot1", "ydot2"):
            size = r[name].std() * 10.0 ** (-snr_db / 20.0)
            changed[name] = r[name] + size * rng.standard_normal(len(r.time))
        found.append(with_channels(r, changed))
    return found


def without(recording: Recording, *prefixes: str) -> Recording:
    """Without the channels whose names begin so."""
    kept = {n: x for n, x in recording.channels.items() if not n.startswith(prefixes)}
    return replace(recording, channels=kept)


def with_channels(recording: Recording, channels: Mapping[str, np.ndarray]) -> Recording:
    return replace(recording, channels={**recording.channels, **channels})


FINE = 32
"""Steps per sample: with edges they miss a hundredth of the noise."""


def residuals_of(model: Model, recordings: Sequence[Recording], **settings: Any) -> Residuals:
    """What the fit minimises."""
    spec = IdentifySpec(**settings)
    setup = make_setup(model, spec, recordings)
    unknowns = collect_unknowns(setup.model, spec, recordings)
    experiments = [prepare(setup.model, r, setup.outputs, setup.processing) for r in recordings]
    held = fixed_values(setup.model, spec, unknowns)
    predictor = Predictor(experiments, unknowns, held, steps=FINE)
    return Residuals(predictor, channel_weights(experiments, spec.weights))


def fit(
    model: Model,
    recordings: Sequence[Recording],
    progress: Progress | None = None,
    **settings: Any,
) -> Fitted:
    """One fit over all recordings; by refinement alone unless generations are asked for."""
    spec = IdentifySpec(**{"generations": 0, **settings})
    residuals = residuals_of(model, recordings, **{"generations": 0, **settings})
    return identify(
        "all", residuals.experiments, residuals.unknowns, spec, residuals.predictor.fixed,
        progress or Silent(),
    )  # fmt: skip


def estimate(fitted: Fitted, name: str, recording: str | None = None) -> Any:
    """The estimate of that name, derived ones included."""
    everything = (*fitted.fit.estimates, *fitted.fit.derived)
    return next(e for e in everything if (e.name, e.recording) == (name, recording))
