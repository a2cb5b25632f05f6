"""From a scenario to the experiments that it should have next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..diagnose.base_fit import BaseFit
from ..diagnose.diagnose import fit_base_to_recordings
from ..diagnose.search_options import Options
from ..estimate.minimum import converge_precisely
from ..experiments.design import Design, ExperimentRequest, design
from ..identify.setup import make_setup
from ..linear_or_nonlinear import AUTO
from ..loading import load_recordings
from ..noise.output_noise import stated_noise
from ..progress import Progress, Silent
from ..recording.recording import Recording
from ..results.identification import final_values
from ..scenario.data_folder import Folder
from ..scenario.schema import Scenario
from ..scenario.stated_effects import base_model, with_effect_parameters
from ..scenario_fits import fit_all
from ..validation import naming_scenario
from ..workbench import model_at_level


def plan(
    scenario: Scenario, request: ExperimentRequest, *, folder: Folder | None = None,
    data_folder: Path | None = None, progress: Progress | None = None,
) -> Design:  # fmt: skip
    """Fit the scenario's model as the diagnosis fits it, and choose what to record next; the
    request holds `[limits]` too. InputError where the scenario, a recording or the request is
    wrong."""
    progress = progress or Silent()
    progress.stage("Reading the recordings", len(scenario.recordings))
    recordings = load_recordings(
        scenario, base_model(scenario), folder or Path(), data_folder, progress
    )
    return design(fit_for_planning(scenario, recordings, progress), request, progress)


@naming_scenario
def fit_for_planning(
    scenario: Scenario, recordings: Sequence[Recording], progress: Progress
) -> BaseFit:
    """The scenario's model on its recordings, identified and then fitted to all channels, as a
    diagnosis begins, and as exactly as one ends: deviations are to be relied on."""
    model = base_model(scenario)
    spec = with_effect_parameters(scenario.identify, model, scenario.model)
    if scenario.model.level == AUTO:
        model, _ = model_at_level(scenario, model, spec, recordings)
    setup = make_setup(model, spec, recordings)
    identified = final_values([f.fit for f in fit_all(setup, recordings, spec, progress)])
    noise = stated_noise(scenario, setup, recordings)
    options = Options(
        fidelity=scenario.diagnose.fidelity,
        stated_noise=noise,
        identified=identified,
        stated_rig=scenario.rig.statements,
    )
    base_fit = fit_base_to_recordings(setup, spec, recordings, options, progress)
    data, base = converge_precisely(base_fit.data, base_fit.base, progress.stopped)
    return replace(base_fit, data=data, base=base, cached_fit=None)
