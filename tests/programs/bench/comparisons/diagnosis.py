"""One round of diagnosis: which effect is missing, against refitting every effect with SciPy."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from flexgui.core.diagnose.base_fit import BaseFit, fit_base
from flexgui.core.diagnose.candidates import applicable
from flexgui.core.diagnose.evidence import Round
from flexgui.core.diagnose.output_changes import trials
from flexgui.core.diagnose.search_round import search_round
from flexgui.core.effects import catalogue
from flexgui.core.effects.effect import Effect
from flexgui.core.estimate.problem import problem_of
from flexgui.core.identify.processing import Processing
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.simulate.experiment import NoiseLevels, simulate_recording
from tests.helpers import PAPER, looped
from tests.programs.bench.row import FULL, Row, Size

HIDDEN = "coulomb_friction"
SIZES = {"fc1": 0.5, "fc2": 0.3}
NOISE = {"z": 3e-5, "encoder": 1e-5}
STATED = {"z1": 3e-5, "z2": 3e-5, "theta1": 1e-5, "theta2": 1e-5}

REFITTED_BY_PEER = (HIDDEN, "viscous_friction", "tip_payload", "camera_delay")
"""Measured; the others are taken to need as long per free parameter as these."""

CLOSE = 0.02
"""Relative: both minimise the same sum of squares of the hidden effect's model."""


@dataclass(frozen=True)
class _Ours:
    begun: BaseFit
    found: Round
    first: float
    """s until the first ranking."""
    whole: float
    """s of the round."""


def rows(size: Size) -> list[Row]:
    """The first ranking, and the round with refits against SciPy's least_squares."""
    full = size == FULL
    begun = _begun(size.record)
    candidates = applicable(begun.data, [], () if full else REFITTED_BY_PEER)
    search_round(begun.data, begun.base, [], candidates, lambda _: False)  # compiles what is new
    ours = _round(begun, candidates)
    peer, cost = _peer(begun, candidates)
    best = ours.found.refitted[0]
    apart = best.refit.cost / cost - 1.0
    same = best.screened.effect.kind == HIDDEN and abs(apart) < CLOSE
    samples = begun.data.experiments[0].measured.shape[0]
    what = f"7 x {samples} samples, four outputs, {len(candidates)} candidates"
    note = "SciPy's refits extrapolated from four effects, per parameter; same simulator"
    return [
        Row(f"first ranking, {what}", ours.first, value="-", note="all sizes scanned"),
        Row(f"one round with refits, {what}", ours.whole, peer, None, same, "", note,
            "least_squares per effect", f"{apart:+.0e} relative, our cost to the peer's"),
    ]  # fmt: skip


def _begun(seconds: float) -> BaseFit:
    bare = looped(PAPER)
    hidden = bare.with_effects([catalogue()[HIDDEN]], SIZES)
    recordings = [
        simulate_recording(
            hidden,
            SimulateSpec(theta2=k * np.pi / 8.0, seconds=seconds, seed=k),
            f"th{k}",
            noise=NoiseLevels(NOISE),
        )
        for k in range(1, 8)
    ]
    spec = IdentifySpec(parameters=("EI",))
    return fit_base(bare, (), Processing(), spec, recordings, STATED, 0.001)


def _round(begun: BaseFit, candidates: Sequence[Effect]) -> _Ours:
    seen: list[float] = []
    start = time.perf_counter()
    found = search_round(
        begun.data, begun.base, [], candidates, lambda _: False,
        lambda _: seen.append(time.perf_counter() - start),
    )  # fmt: skip
    return _Ours(begun, found, seen[0], time.perf_counter() - start)


def _peer(begun: BaseFit, candidates: Sequence[Effect]) -> tuple[float, float]:
    """(seconds for all candidates, squared error of the hidden effect's model)."""
    spent, parameters, cost = 0.0, 0, np.inf
    chosen = [c for c in candidates if c.kind in REFITTED_BY_PEER]
    for one in chosen:
        start = problem_of(begun.data, [one], begun.base.problem.values())
        begin_at = time.perf_counter()
        limits = start.limits
        found = scipy.optimize.least_squares(
            lambda x, h=start, s=limits.scales: h.residuals(x * s),
            np.clip(start.vector, limits.lower, limits.upper) / limits.scales,
            bounds=(limits.lower / limits.scales, limits.upper / limits.scales),
        )
        spent += time.perf_counter() - begin_at
        parameters += len(start.vector)
        if one.kind == HIDDEN:
            cost = 2.0 * float(found.cost)
    nuisance = len(begun.data.nuisance)
    whole = sum(nuisance + _free(begun, c) for c in candidates)
    return spent * whole / parameters, cost


def _free(begun: BaseFit, candidate: Effect) -> int:
    """Parameters that a refit frees."""
    tried = trials(begun.base.problem, candidate, begun.data)
    return len({t.parameter for t in tried})
