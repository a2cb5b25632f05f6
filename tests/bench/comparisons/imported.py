"""Seven tables as a rig would hand them over: outputs of many vectors, and their slopes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from flexgui.core.identify.linear_outputs import POSTURE_TOLERANCE, LinearOutputs
from flexgui.core.identify.predictor import Predictor
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.setup import make_setup
from flexgui.core.identify.unknowns import collect_unknowns, fixed_values
from flexgui.core.progress import Silent
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.workbench import load_recordings
from tests.bench.case import write
from tests.bench.row import Row, Size, median_seconds, seconds

VECTORS = 8
SPREAD = 0.05
"""Relative, of the vectors around the start."""
SAME = 5.0 * POSTURE_TOLERANCE
"""Of a channel's rms; what is stated is the error at the start."""
REPEATS = 5


def rows(size: Size) -> list[Row]:
    """Against one exponential per sample: the recordings tell no working point, so that the
    posture is followed."""
    with TemporaryDirectory() as folder:
        outputs, predictor = _case(write(Path(folder), size.seconds, size.modes))
    vectors = _vectors(outputs)
    exact: list[list[np.ndarray]] = []
    peer = seconds(lambda: exact.append(predictor.predict(vectors[0])))
    found = outputs.blocks(vectors)
    pairs = zip(found, exact[0], strict=True)
    worst = max(float(np.abs(b[0] - y).max() / np.sqrt(np.mean(y**2))) for b, y in pairs)
    each = median_seconds(lambda: outputs.blocks(vectors), REPEATS) / VECTORS
    samples = len(outputs.experiments[0].task.time)
    note = (
        f"{VECTORS} vectors in one call; largest difference {worst:.0e} of a channel's rms, "
        f"stated {max(outputs.errors.values()):.0e}"
    )
    what = (
        f"outputs of 7 x {samples} imported samples, {size.modes} modes, an exponential per sample"
    )
    return [Row(what, each, peer, same=worst < SAME, note=note)]


def _case(file: Path) -> tuple[LinearOutputs, Predictor]:
    scenario = read_scenario(file)
    model = replace(base_model(scenario), level="lpv")  # what both sides are about
    recordings = load_recordings(scenario, model, file.parent, None, Silent())
    setup = make_setup(model, scenario.identify, recordings)
    unknowns = collect_unknowns(setup.model, scenario.identify, recordings)
    fixed = fixed_values(setup.model, scenario.identify, unknowns)
    experiments = [prepare(setup.model, r, setup.outputs, setup.processing) for r in recordings]
    return LinearOutputs(experiments, unknowns, fixed), Predictor(experiments, unknowns, fixed)


def _vectors(outputs: LinearOutputs) -> np.ndarray:
    start = outputs.unknowns.parameters.vector()
    moves = np.random.default_rng(0).uniform(-SPREAD, SPREAD, (VECTORS, len(start)))
    return np.asarray(start * (1.0 + moves))
