"""Detectability: what a set of experiments shows of a change of the model.

The measure is |G_perp delta|: the part of the output change that the nominal parameters cannot
absorb, per sample and in standard deviations of the noise (root mean square).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from ..challenge.challenge_rig import KINDS, STDS
from ..identify.defect_correction import with_enough_steps
from ..identify.fit_unknowns import unknowns_with_starts
from ..identify.predictor import Predictor
from ..identify.prepared_recording import prepare
from ..identify.processing import Processing
from ..identify.residuals import Residuals
from ..model import Model
from ..recording.recording import Recording
from ..recording.spec import SimulateSpec
from ..scenario.schema import IdentifySpec
from ..sensors import sensor
from ..simulate.experiment import simulate_recording

IDENTIFY = IdentifySpec(parameters=("EI",), output=("z",))
"""The nominal parameter; a diagnosis adds the starts of each recording."""

RANK = 1e-10
"""Relative singular value below which a nuisance direction is absent."""


class Detectability:
    """What a set of experiments shows of a change of the base model."""

    def __init__(self, base: Model, experiments: Sequence[SimulateSpec]) -> None:
        self.base, self._experiments = base, tuple(experiments)
        self.recordings = self._recorded(base)

    def _recorded(self, model: Model) -> list[Recording]:
        specs = enumerate(self._experiments)
        return [simulate_recording(model, spec, f"r{k}") for k, spec in specs]

    @cached_property
    def nuisance(self) -> np.ndarray:
        """(K, P) orthonormal: directions that nominal parameters and starts can absorb."""
        outputs = [sensor(kind) for kind in KINDS]
        unknowns = unknowns_with_starts(self.base, IDENTIFY, self.recordings, outputs)
        prepared = [prepare(self.base, r, outputs, Processing()) for r in self.recordings]
        weights = [np.array([1.0 / STDS[n] for n, _ in e.channels]) for e in prepared]
        residuals = Residuals(Predictor(prepared, unknowns, {}), weights)
        at = unknowns.parameters.vector()
        slopes = with_enough_steps(residuals, at).slopes(at)
        S = np.concatenate([s.reshape(-1, s.shape[-1]) for s in slopes])
        S = S / np.maximum(np.linalg.norm(S, axis=0), 1e-300)
        U, s, _ = np.linalg.svd(S, full_matrices=False)
        return np.asarray(U[:, s > RANK * s[0]])

    def seen(self, shown: Sequence[Recording]) -> float:
        """The size of a change from the base's recordings, in standard deviations of the noise."""
        changes = [
            np.column_stack([(a[name] - b[name]) / std for name, std in STDS.items()])
            for a, b in zip(shown, self.recordings, strict=True)
        ]
        d = np.concatenate([x.ravel() for x in changes])
        Q = self.nuisance
        return float(np.sqrt(np.mean((d - Q @ (Q.T @ d)) ** 2)))

    def of(self, model: Model) -> float:
        """The size of the difference of `model` from the base, in the same unit."""
        return self.seen(self._recorded(model))


CLOSE = 0.02
"""Relative accuracy of a size: far below the interval of sizes."""

SCAN = 2.0
"""Factor between sizes while a crossing is searched."""

MOST_SCANS, MOST_STEPS = 40, 30


def crossing(shown: Callable[[float], float], level: float) -> tuple[float, float]:
    """The multiplier at which `shown` first reaches `level` in its unit, from neutral, and its
    value: octaves first, then false position in logarithms (Illinois variant, Dowell and Jarratt
    1971), since most effects are linear there."""
    low, high, f_low, f_high = _bracket(shown, level)
    for _ in range(MOST_STEPS):
        if high / low < 1.0 + 1e-9:
            break
        share = -f_low / (f_high - f_low)
        m = float(low * (high / low) ** np.clip(share, 0.1, 0.9))
        f = _gap(shown(m), level)
        if abs(f) < np.log1p(CLOSE):
            return m, float(level * np.exp(f))
        if f < 0.0:
            low, f_low = m, f
        else:
            high, f_high = m, f
    return high, float(level * np.exp(f_high))


LEAST_SEEN_SHARE = 1e-3
"""Share of the level below which an effect counts as not seen at all."""


def _gap(size: float, level: float) -> float:
    """log(size / level), bounded below; infinite for a motion that diverged."""
    if not np.isfinite(size):
        return float(-np.log(LEAST_SEEN_SHARE))
    return float(np.log(max(size / level, LEAST_SEEN_SHARE)))


def _bracket(shown: Callable[[float], float], level: float) -> tuple[float, float, float, float]:
    m, f = 1.0, _gap(shown(1.0), level)
    if f < 0.0:
        for _ in range(MOST_SCANS):
            low, f_low = m, f
            m *= SCAN
            f = _gap(shown(m), level)
            if f >= 0.0:
                return low, m, f_low, f
    else:
        for _ in range(MOST_SCANS):
            high, f_high = m, f
            m /= max(SCAN, min(np.exp(f), 64.0))
            f = _gap(shown(m), level)
            if f < 0.0:
                return m, high, f, f_high
    raise UnreachableError(
        f"no size of the effect shows {level:g} times the noise (last {m:g}: {f:g})"
    )


class UnreachableError(ValueError):
    """No size of an effect shows the required level."""
