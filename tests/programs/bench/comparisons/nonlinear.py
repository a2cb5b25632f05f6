"""The non-linear arm simulated as exactly on both sides, alone and eight vectors at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from flexgui.core.model import Model
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.simulate.batch import Job, run, run_many
from flexgui.core.simulate.experiment import make_task
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.nonlinear import (
    MOST_SUBSTEPS,
    simulate_within,
)
from flexgui.core.trajectory import Trajectory
from tests.helpers import looped, run_many_extrapolated, with_modes
from tests.programs.bench.casadi_arm import CasadiArm, Run, lacking
from tests.programs.bench.peers import Setting, integrate
from tests.programs.bench.row import FULL, Row, Size, least_seconds, seconds

ACCURATE = 1e-6
"""m: the largest error of the tip that both sides may have."""
VECTORS, SPREAD = 8, 0.1
"""Bending stiffnesses of a population, uniform around the arm's."""
TARGETS = {1: 1.0, 2: 2.0, 3: 3.0}
"""Modes per segment -> times faster than CasADi's code."""
POPULATION_TARGET = 6.0
STEPS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48)
CVODES_TOLERANCES = (1e-3, 1e-4, 1e-5)
METHODS = ("LSODA", "BDF", "Radau")
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
SOLVE_IVP_MODES = 2
REPEATS = 9

Motions = Sequence[Any]
"""Trajectories, or states (N, 2 n)."""


@dataclass(frozen=True)
class Way:
    """The quickest accurate setting of one side."""

    name: str
    work: Callable[[], Motions]
    error: float
    seconds: float


@dataclass(frozen=True)
class Case:
    """One arm, one task, and the bending stiffnesses (vectors, segments) in N m^2."""

    model: Model
    task: Task
    stiffness: np.ndarray

    @cached_property
    def jobs(self) -> list[Job]:
        """One per vector."""
        names = [f"EI{k + 1}" for k in range(self.model.arm.joints)]
        values = [dict(zip(names, row.tolist(), strict=True)) for row in self.stiffness]
        return [Job(self.model, self.model.numbers(v), self.task) for v in values]

    @cached_property
    def truth(self) -> list[Trajectory]:
        """With very many steps."""
        return [run(*job.parts, MOST_SUBSTEPS) for job in self.jobs]

    def error(self, found: Motions) -> float:
        """Largest distance of the tips in m; infinite where a simulation failed."""
        n, worst = self.model.arm.coordinates, 0.0
        for motion, truth in zip(found, self.truth, strict=True):
            if not isinstance(motion, Trajectory):
                motion = replace(truth, q=motion[:, :n], v=motion[:, n:])
            distance = np.linalg.norm(motion.tip()[0] - truth.tip()[0], axis=1).max()
            worst = max(worst, float(distance)) if np.isfinite(distance) else np.inf
        return worst

    def cheapest(
        self, plain: Callable[[int], Motions], extrapolated: Callable[[int], Motions]
    ) -> Way:
        """Of plain passes and of pairs whose results are extrapolated."""
        found = []
        for name, simulate in (("", plain), (", extrapolated", extrapolated)):
            for steps in STEPS:
                if (error := self.error(simulate(steps))) < ACCURATE:
                    work = partial(simulate, steps)
                    what = f"{steps} steps per sample{name}"
                    found.append(Way(what, work, error, least_seconds(work, REPEATS)))
                    break
        return min(found, key=lambda way: way.seconds)

    def ours(self, workers: int) -> Way:
        """In lanes and threads."""
        return self.cheapest(
            lambda steps: run_many(self.jobs, steps, workers),
            lambda steps: run_many_extrapolated(self.jobs, steps, workers),
        )

    def casadi(self, compiled: Run, workers: int) -> Way:
        """One vector after the other on each thread; the C code holds no lock."""

        def one(steps: int, stiffness: np.ndarray) -> np.ndarray:
            return compiled(self.task, stiffness, steps)

        def mixed(steps: int, stiffness: np.ndarray) -> np.ndarray:
            fine = one(max(steps, 2), stiffness)
            return fine + (fine - one(max(steps // 2, 1), stiffness)) / 3.0

        def all_of(each: Callable[[int, np.ndarray], np.ndarray], steps: int) -> Motions:
            if workers == 1:
                return [each(steps, row) for row in self.stiffness]
            with ThreadPoolExecutor(workers) as pool:
                return list(pool.map(partial(each, steps), self.stiffness))

        return self.cheapest(partial(all_of, one), partial(all_of, mixed))


def make_case(modes: int, length: float, vectors: int = 1) -> Case:
    """The paper's arm, `length` s at 1 kHz; the first of several vectors is the arm's own."""
    model = looped(with_modes(modes, modes))
    spec = SimulateSpec(theta2=np.pi / 2.0, seconds=length, seed=1)
    own = np.array([s.bending_stiffness for s in model.arm.segments])
    moves = np.random.default_rng(0).uniform(-SPREAD, SPREAD, (vectors, len(own)))
    moves[0] = 0.0
    return Case(model, make_task(model, spec, "bench")[0], own * (1.0 + moves))


def rows(size: Size) -> list[Row]:
    """With one, two and three modes per segment."""
    return [row for modes in range(1, size.modes + 1) for row in _rows(modes, size)]


def _rows(modes: int, size: Size) -> Iterator[Row]:
    case = make_case(modes, size.record)
    many = make_case(modes, size.record, VECTORS)
    about = f"non-linear, {modes} mode(s) per segment, {size.record:g} s"
    question = f"{about}, tip within {ACCURATE:.0e} m"
    eight = [(f"{about}, {VECTORS} vectors, {k} thread(s)", many.ours(k), k) for k in (1, 2)]
    ours = case.ours(1)
    if absent := lacking():
        for what, way in ((question, ours), *((what, way) for what, way, _ in eight)):
            yield Row(what, way.seconds, value="skipped", note=absent, rival="CasADi's C code")
    else:
        full = size == FULL
        arm, compiled = CasadiArm(case.model), []
        with TemporaryDirectory() as folder:
            built = seconds(lambda: compiled.append(arm.states(Path(folder))))
        peer, rival = case.casadi(compiled[0], 1), "CasADi's C code"
        remark = f"{compiled[0].operations} operations per step of the peer, built in {built:.1f} s"
        yield _row(question, ours, peer, TARGETS[modes] if full else None, rival, remark)
        target = POPULATION_TARGET if full else None
        for what, way, workers in eight:
            yield _row(what, way, many.casadi(compiled[0], workers), target, rival, "")
        yield _row(question, ours, _cvodes(case, arm), None, "CVODES of CasADi", "equations in C")
        yield _row(f"{about}, simulate_within() by default", _default(case), peer, None, rival, "")
    if modes == min(SOLVE_IVP_MODES, size.modes):
        yield _row(question, ours, _solve_ivp(case), 100.0, "solve_ivp", "our compiled equations")


def _row(question: str, ours: Way, peer: Way, target: float | None, rival: str, remark: str) -> Row:
    same = max(ours.error, peer.error) < ACCURATE
    note = "; ".join(filter(None, (f"ours: {ours.name}", f"peer: {peer.name}", remark)))
    errors = f"{ours.error:.1e} / {peer.error:.1e} m"
    return Row(question, ours.seconds, peer.seconds, target, same, "", note, rival, errors)


def _default(case: Case) -> Way:
    """simulate_within(), which finds the steps of a tolerance by itself."""

    def work() -> Motions:
        return [simulate_within(*job.parts).trajectory for job in case.jobs]

    return Way("steps found on the way", work, case.error(work()), least_seconds(work, REPEATS))


def _cvodes(case: Case, arm: CasadiArm) -> Way:
    for rtol in CVODES_TOLERANCES:
        states = arm.cvodes(case.task, case.stiffness[0], rtol)
        if (error := case.error([states()])) < ACCURATE:
            break
    name = f"rtol {rtol:.0e}, restarted at every change of the input"
    return Way(name, lambda: [states()], error, least_seconds(states, 2))


def _solve_ivp(case: Case) -> Way:
    """The quickest accurate setting."""
    found = []
    for method in METHODS:
        for rtol in TOLERANCES:
            setting = Setting(method, rtol)
            work = partial(integrate, case.model, case.task, setting)
            if (error := case.error([work()])) < ACCURATE:
                found.append(Way(str(setting), lambda w=work: [w()], error, seconds(work)))
                break
    return min(found, key=lambda way: way.seconds)
