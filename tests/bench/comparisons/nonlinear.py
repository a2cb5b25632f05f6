"""The non-linear arm with two modes per segment, at equal accuracy of the tip."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.presets import presets
from flexgui.core.drives import build_drive
from flexgui.core.model import Model, Numbers
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.experiment import make_task
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.nonlinear import MOST_SUBSTEPS, simulate_within
from flexgui.core.trajectory import Trajectory
from tests.bench.case import GAINS
from tests.bench.peers import Setting, SympyArm, integrate
from tests.bench.row import Row, Size, median_seconds, seconds
from tests.helpers import simulate_fixed

ACCURATE = 5e-6
"""m: the largest error of the tip that both sides may have."""
REFERENCES_AGREE = 1e-8
"""m: between our finest run and solve_ivp at its tight tolerance."""
TIGHT = 1e-10
METHODS = ("LSODA", "BDF", "Radau")
TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 1e-4, 1e-5, 1e-6)
OUR_REPEATS = 5


def rows(size: Size) -> list[Row]:
    """Our cheapest accurate setting and the default one, against the best of solve_ivp."""
    model = Model(_arm(), build_drive("velocity_loop", {"gains": GAINS}))
    spec = SimulateSpec(theta2=np.pi / 2.0, seconds=size.record, seed=1)
    task = make_task(model, spec, "bench")[0]
    numbers = model.numbers()
    truth = run(model, numbers, task, MOST_SUBSTEPS)
    peer = _peer(model, _shortened(task, size.nonlinear_seconds))
    scaled = peer.seconds * size.record / size.nonlinear_seconds
    how, cheapest = _cheapest(model, numbers, task, truth)
    ours = median_seconds(cheapest, OUR_REPEATS)
    what = f"non-linear, two modes, {size.record:g} s, solve_ivp"
    note = (
        f"tip within {ACCURATE:.0e} m on both sides; ours: {how}; peer: {peer.setting}, "
        f"{size.nonlinear_seconds:g} s of the record, scaled; the two references agree to "
        f"{peer.agreement:.0e} m"
    )
    same = peer.agreement < REFERENCES_AGREE
    return [
        Row(what, ours, scaled, 100.0, same, note=note),
        _default(f"{what}; our default", model, task, truth, scaled),
    ]


def _default(what: str, model: Model, task: Task, truth: Trajectory, peer: float) -> Row:
    """simulate_within(), which finds the steps of a tolerance by itself."""
    numbers = model.numbers()
    error = tip_error(simulate_within(model, numbers, task).trajectory, truth)
    ours = median_seconds(lambda: simulate_within(model, numbers, task), OUR_REPEATS)
    note = f"steps chosen and error stated by simulate_within(); tip error {error:.0e} m"
    return Row(what, ours, peer, None, error < ACCURATE, note=note)


def _arm() -> Arm:
    arm = presets()["paper"]
    segments = tuple(s.model_copy(update={"modes": 2}) for s in arm.segments)
    return arm.model_copy(update={"segments": segments})


def _shortened(task: Task, length: float) -> Task:
    count = int(round(length / task.sample_time)) + 1
    return Task(task.time[:count], task.references[:count], task.start, task.schedule)


def tip_error(found: Trajectory, truth: Trajectory) -> float:
    """Largest distance of the tips in m; infinite where the simulation failed."""
    distance = np.linalg.norm(found.tip()[0] - truth.tip()[0], axis=1).max()
    return float(distance) if np.isfinite(distance) else np.inf


def _cheapest(
    model: Model, numbers: Numbers, task: Task, truth: Trajectory
) -> tuple[str, Callable[[], Trajectory]]:
    """The quickest of our fixed settings that is accurate enough, and its name."""
    found: list[tuple[float, str, Callable[[], Trajectory]]] = []
    choices = [(run, s) for s in (1, 2, 3, 4, 6, 8)] + [(simulate_fixed, s) for s in (2, 4, 6, 8)]
    for function, substeps in choices:
        work = partial(function, model, numbers, task, substeps)
        if tip_error(work(), truth) < ACCURATE:
            name = f"{function.__name__} with {substeps} steps per sample"
            found.append((median_seconds(work, 3), name, work))
    _, name, best = min(found, key=lambda each: each[0])
    return name, best


@dataclass(frozen=True)
class _Peer:
    """Time of the quickest accurate setting, and the largest difference of the references."""

    seconds: float
    setting: Setting
    agreement: float


def _peer(model: Model, task: Task) -> _Peer:
    arm = SympyArm(model)
    n = model.arm.coordinates
    truth = run(model, model.numbers(), task, MOST_SUBSTEPS)

    def error(states: np.ndarray) -> float:
        q, v = states[:, :n], states[:, n:]
        return tip_error(replace(truth, q=q, v=v), truth)

    found = [
        _loosest(arm, task, method, restart, error)
        for method in METHODS
        for restart in (True, False)
    ]
    time, setting = min((f for f in found if f is not None), key=lambda each: each[0])
    agreement = error(integrate(arm, task, Setting("Radau", TIGHT, restart=True)))
    return _Peer(time, setting, agreement)


def _loosest(
    arm: SympyArm, task: Task, method: str, restart: bool, error: Callable[[np.ndarray], float]
) -> tuple[float, Setting] | None:
    """Time and setting of the largest tolerance that is accurate enough."""
    for rtol in TOLERANCES:
        setting = Setting(method, rtol, restart)
        if error(integrate(arm, task, setting)) < ACCURATE:
            return seconds(partial(integrate, arm, task, setting)), setting
    return None
