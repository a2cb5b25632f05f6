"""EI1 and EI2 of one non-linear recording, against Gauss-Newton with CasADi's sensitivities."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from flexgui.core.identify.fit import identify
from flexgui.core.identify.fit_starts import ROUGH_TOLERANCE
from flexgui.core.identify.prepared_recording import Prepared, prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.refinement import HORIZON_TOLERANCE
from flexgui.core.identify.unknowns import Unknowns, collect_unknowns
from flexgui.core.least_squares import Blocks, bounds_and_prior, levenberg_marquardt
from flexgui.core.model import Model
from flexgui.core.progress import Silent
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.results import Estimate
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import simulate_recording
from flexgui.core.simulate.motion import Task
from tests.programs.bench.casadi_arm import CasadiArm, Run, lacking
from tests.programs.bench.case import NOISE, START_SHARES, TRUTH
from tests.programs.bench.comparisons.nonlinear import make_case
from tests.programs.bench.row import FULL, Row, Size, least_seconds, seconds

TARGET = 5.0
WITHIN = 0.2
"""Of a parameter's deviation: how far both answers may be from the tight reference."""
STEPS, TIGHT = (1, 2, 3, 4, 6, 8, 12, 16), 48
"""Steps per sample that the peer may choose, and those of the reference."""
FIRST = 1.0 / 16.0
"""Share of the recording that the peer fits first: over all of it the start is out of phase."""
REPEATS = 3


@dataclass(frozen=True)
class Fitting:
    """One recording of the tip, what is unknown and how ours is asked."""

    model: Model
    experiment: Prepared
    unknowns: Unknowns
    spec: IdentifySpec

    def ours(self) -> tuple[Estimate, ...]:
        """With standard deviations, correlations and what else a fit states."""
        found = identify("fit", [self.experiment], self.unknowns, self.spec, {}, Silent())
        return found.fit.estimates

    def theirs(self, compiled: Run, steps: int, start: np.ndarray | None = None) -> np.ndarray:
        """EI (2,) at the end of the same descent with the same stop, on sensitivities that each
        simulation brings along."""
        x = self.unknowns.parameters.vector() if start is None else start
        shares = {FIRST: HORIZON_TOLERANCE, 1.0: ROUGH_TOLERANCE}
        for share, tolerance in shares.items():
            errors, slopes = self._sensed(compiled, steps, share)
            x = levenberg_marquardt(
                errors, slopes, x, bounds_and_prior(self.unknowns.parameters), good_enough=0.0,
                share=tolerance,
            ).vector  # fmt: skip
        return x

    def _sensed(
        self, compiled: Run, steps: int, share: float
    ) -> tuple[Callable[[np.ndarray], Blocks], Callable[[np.ndarray], Blocks]]:
        """Errors (N, 2) of the tip and their slopes (N, 2, EI) over the first share."""
        task, count = self.experiment.task, int(np.ceil(share * len(self.experiment.task.time)))
        part = Task(task.time[:count], task.references[:count], task.start, task.schedule)
        known: dict[bytes, np.ndarray] = {}

        def simulated(x: np.ndarray) -> np.ndarray:
            if x.tobytes() not in known:
                known[x.tobytes()] = compiled(part, x, steps)
            return known[x.tobytes()]

        def errors(x: np.ndarray) -> Blocks:
            return [self.experiment.measured[:count] - simulated(x)[:, :2]]

        def slopes(x: np.ndarray) -> Blocks:
            return [-simulated(x)[:, 2:].reshape(count, -1, 2).transpose(0, 2, 1)]

        return errors, slopes


def make_fitting(modes: int, length: float) -> Fitting:
    """A recording of `length` s with the noise of a good camera; the start is 1.3 and 0.7 of the
    truth."""
    model = make_case(modes, length).model
    spec = SimulateSpec(theta2=np.pi / 2.0, seconds=length, seed=1, excitation="prbs")
    recording = simulate_recording(model, spec, "tip", noise=NOISE)
    starts = {f"EI{k + 1}": TRUTH * share for k, share in enumerate(START_SHARES)}
    asked = IdentifySpec(parameters=tuple(starts), start=starts)
    unknowns = collect_unknowns(model, asked, [recording])
    return Fitting(model, prepare(model, recording, [sensor("z")], Processing()), unknowns, asked)


def rows(size: Size) -> list[Row]:
    """With one, two and three modes per segment."""
    return [_row(modes, size) for modes in range(1, size.modes + 1)]


def _row(modes: int, size: Size) -> Row:
    fitting = make_fitting(modes, size.record)
    question = f"fit of EI1 and EI2 to one recording of {size.record:g} s, {modes} mode(s)"
    ours, rival = least_seconds(fitting.ours, REPEATS), "Gauss-Newton, CasADi's sensitivities in C"
    if absent := lacking():
        return Row(question, ours, value="skipped", note=absent, rival=rival)
    compiled: list[Run] = []
    with TemporaryDirectory() as folder:
        arm = CasadiArm(fitting.model)
        built = seconds(lambda: compiled.append(arm.slopes(Path(folder))))
    estimates = fitting.ours()
    values, deviations = np.array([(e.value, e.std) for e in estimates]).T
    tight = fitting.theirs(compiled[0], TIGHT, values)

    def apart(found: np.ndarray) -> float:
        return float(np.max(np.abs(found - tight) / deviations))

    good = (k for k in STEPS if apart(fitting.theirs(compiled[0], k)) < WITHIN)
    steps = next(good, STEPS[-1])
    peer = least_seconds(lambda: fitting.theirs(compiled[0], steps), REPEATS)
    found = fitting.theirs(compiled[0], steps)
    shown = ["{:.3f}, {:.3f}".format(*x) for x in (values, found, tight)]
    note = (
        f"EI in N m^2: ours {shown[0]}, peer {shown[1]} with {steps} steps per sample, reference "
        f"{shown[2]}; ours also states deviations and correlations; peer built in {built:.1f} s, "
        f"{compiled[0].operations} operations per step"
    )
    errors = f"{apart(values):.3f} / {apart(found):.3f} deviations"
    target = TARGET if size == FULL else None
    return Row(question, ours, peer, target, apart(values) < WITHIN, "", note, rival, errors)
