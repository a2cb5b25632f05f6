"""Plain identification of seven tables, from the files to the answer."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from flexgui.core.identify.fit_unknowns import unknowns_with_starts
from flexgui.core.identify.predictor import Predictor
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.residuals import Residuals, channel_weights
from flexgui.core.identify.setup import make_setup
from flexgui.core.identify.unknowns import fixed_values
from flexgui.core.progress import Silent
from flexgui.core.results.identification import labelled
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.workbench import load_recordings, model_at_level, run_scenario
from tests.programs.bench.case import write
from tests.programs.bench.row import Row, Size, seconds

WITHIN = 0.1
"""Of a parameter's deviation: how far the answer may be from the tight reference."""

TIGHT = 128
"""Steps per sample of the reference."""


def rows(size: Size) -> list[Row]:
    """Ours alone: what others would write has no checks, no choice of level and no comparison."""
    with TemporaryDirectory() as folder:
        file = write(Path(folder), size.seconds, size.modes)
        scenario = read_scenario(file)
        run_scenario(scenario, folder=file.parent)  # compiles what is new
        found = []
        ours = seconds(lambda: found.append(run_scenario(scenario, folder=file.parent)))
        residuals = _tight(file)
    fit = found[0].fits[0]
    values = {labelled(e.name, e.recording): (e.value, e.std) for e in fit.estimates}
    apart = _apart(residuals, values)
    samples = len(residuals.experiments[0].task.time)
    what = f"plain identification, 7 x {samples} samples from CSV, {size.modes} modes"
    note, errors = f"level {found[0].level}", f"{apart:.3f} deviations"
    return [Row(what, ours, same=apart < WITHIN, value="-", note=note, errors=errors)]


def _tight(file: Path) -> Residuals:
    """The residuals with every simulation as fine as the reference needs."""
    scenario = read_scenario(file)
    model, spec = base_model(scenario), scenario.identify
    recordings = load_recordings(scenario, model, file.parent, None, Silent())
    model, _ = model_at_level(scenario, model, spec, recordings)
    setup = make_setup(model, spec, recordings)
    unknowns = unknowns_with_starts(setup.model, spec, recordings, setup.outputs)
    fixed = fixed_values(setup.model, spec, unknowns)
    experiments = [prepare(setup.model, r, setup.outputs, setup.processing) for r in recordings]
    predictor = Predictor(experiments, unknowns, fixed, steps=TIGHT)
    return Residuals(predictor, channel_weights(experiments, spec.weights))


def _apart(residuals: Residuals, values: dict[str, tuple[float, float]]) -> float:
    """Deviations by which a Gauss-Newton step with central differences moves the answer at most.

    One step is enough: within a deviation of the minimum the residuals are linear to 1e-3.
    """
    answer, deviations = np.array([values[name] for name in residuals.unknowns.labels]).T
    slopes = residuals.vector(residuals.slopes(answer))
    step = np.linalg.lstsq(slopes, residuals(answer), rcond=None)[0]
    return float(np.max(np.abs(step) / deviations))
