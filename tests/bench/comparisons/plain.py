"""Plain identification of seven tables, from the files to the answer, in costs by lsim.

Beside it SciPy's least_squares over CVODES with the same equations.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import scipy

from flexgui.core.identify.predictor import Predictor
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.residuals import Residuals, channel_weights
from flexgui.core.identify.setup import make_setup
from flexgui.core.identify.unknowns import collect_unknowns, fixed_values
from flexgui.core.model import Model
from flexgui.core.progress import Silent
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.simulate.motion import Task
from flexgui.core.workbench import load_recordings, model_at_level, run_scenario
from tests.bench.case import AWAY, glocal_case, write
from tests.bench.peers import held_stretches, lsim_response, peer_cost
from tests.bench.row import FULL, Row, Size, median_seconds, seconds
from tests.helpers import finer

MOST_COSTS = 40
"""Times one glocal cost by lsim."""

AGAINST_CVODES = 200.0

WITHIN = 0.1
"""Of a parameter's deviation: how far the answer may be from the tight reference."""

TIGHT = 4
"""Times the steps of the fit's tolerance, for the reference."""

RELATIVE, ABSOLUTE = 1e-6, 1e-9
"""Tolerances of CVODES: its tip is then as exact as our fit's simulation, 1e-5 m."""


def rows(size: Size) -> list[Row]:
    """Ours against one cost by lsim in the same run, and against CVODES."""
    with TemporaryDirectory() as folder:
        file = write(Path(folder), size.seconds, size.modes)
        scenario = read_scenario(file)
        run_scenario(scenario, folder=file.parent)  # compiles what is new
        found = []
        ours = seconds(lambda: found.append(run_scenario(scenario, folder=file.parent)))
        residuals, start = _tight(file)
    fit = found[0].fits[0]
    values = {e.name: (e.value, e.std) for e in fit.estimates}
    apart = _apart(residuals, values)
    case = glocal_case(size.seconds)
    cost = median_seconds(lambda: peer_cost(case, lsim_response, AWAY), size.peer_repeats)
    samples = len(residuals.experiments[0].task.time)
    what = f"plain identification, 7 x {samples} samples from CSV, {size.modes} modes"
    note = (
        f"level {found[0].level}; one glocal cost by lsim {cost * 1e3:.0f} ms; {apart:.3f} "
        f"deviations from a tight reference at most"
    )
    aim = f", at most {MOST_COSTS}" if size == FULL else ""
    plain = Row(what, ours, value=f"{ours / cost:.0f} costs{aim}", same=apart < WITHIN, note=note)
    return [plain, _cvodes(what, ours, residuals, start, size)]


def _tight(file: Path) -> tuple[Residuals, np.ndarray]:
    """The residuals with every simulation as fine as the reference needs, and the start."""
    scenario = read_scenario(file)
    model, spec = base_model(scenario), scenario.identify
    recordings = load_recordings(scenario, model, file.parent, None, Silent())
    model, _ = model_at_level(scenario, model, spec, recordings)
    setup = make_setup(model, spec, recordings)
    unknowns = collect_unknowns(setup.model, spec, recordings)
    fixed = fixed_values(setup.model, spec, unknowns)
    experiments = [prepare(setup.model, r, setup.outputs, setup.processing) for r in recordings]
    predictor = Predictor(experiments, unknowns, fixed)
    predictor.predict(unknowns.parameters.vector())  # finds the steps of the fit's tolerance
    weights = channel_weights(experiments, spec.weights)
    return Residuals(finer(predictor, TIGHT), weights), unknowns.parameters.vector()


def _apart(residuals: Residuals, values: dict[str, tuple[float, float]]) -> float:
    """Deviations by which a Gauss-Newton step with central differences moves the answer at most.

    One step is enough: within a deviation of the minimum the residuals are linear to 1e-3.
    """
    names = [item.parameter.name for item in residuals.unknowns.items]
    answer, deviations = np.array([values[name] for name in names]).T
    slopes = residuals.vector(residuals.sensitivities(answer))
    step = np.linalg.lstsq(slopes, residuals(answer), rcond=None)[0]
    return float(np.max(np.abs(step) / deviations))


def _cvodes(what: str, ours: float, residuals: Residuals, start: np.ndarray, size: Size) -> Row:
    what += ", least_squares over CVODES"
    if find_spec("sksundae") is None:
        return Row(what, ours, value="skipped", note="scikit-sundae is not installed")
    first = residuals.experiments[0]
    length = int(round(size.nonlinear_seconds / first.task.sample_time)) + 1
    task = Task(
        first.task.time[:length], first.task.references[:length], first.task.start,
        first.task.schedule,
    )  # fmt: skip
    once = seconds(lambda: integrate(first.model, task))
    whole = sum(len(e.task.time) for e in residuals.experiments)
    runs = _evaluations(residuals, start)
    peer = once * whole / length * runs
    target = AGAINST_CVODES if size == FULL else None
    note = (
        f"extrapolated from {length} samples of one recording to {runs} costs of 7; the same "
        f"compiled equations, BDF restarted at every change of the input"
    )
    return Row(what, ours, peer, target, note=note)


def _evaluations(residuals: Residuals, start: np.ndarray) -> int:
    """Costs that least_squares takes from the start, with one-sided differences."""
    count = 0
    scales = residuals.scales
    residuals.predictor.coarsen(start)  # few steps: only the number of costs matters here

    def counted(x: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        return residuals(x * scales)

    p = residuals.unknowns.parameters
    bounds = (p.lower() / scales, p.upper() / scales)
    scipy.optimize.least_squares(counted, start / scales, bounds=bounds, x_scale="jac")
    return count


def integrate(model: Model, task: Task) -> np.ndarray:
    """States (N, 2 n) at the samples, by CVODES."""
    from sksundae.cvode import CVODE

    numbers, n = model.numbers(), model.arm.coordinates
    law = numbers.law
    feedback = np.hstack([law.P, law.V])
    states = np.empty((len(task.time), 2 * n))
    states[0] = task.start
    drive = np.zeros(len(law.R))

    def rate(_: float, x: np.ndarray, dx: np.ndarray) -> None:
        x = x.copy()  # it is read-only, which compiled code does not take
        M, f = model.compiled.mass_and_force(x[:n], x[n:], numbers.p)
        f[: len(drive)] += drive - feedback @ x
        dx[:n], dx[n:] = x[n:], np.linalg.solve(M, f)

    solver = CVODE(rate, rtol=RELATIVE, atol=ABSOLUTE)
    for a, b in held_stretches(task):
        drive[:] = law.R @ task.references[a]
        found = solver.solve(task.time[a : b + 1], states[a].copy())
        states[a : b + 1] = found.y
    return states
