"""The whole paper study: 20 runs, two signal-to-noise ratios, seven local fits and a glocal one."""

from __future__ import annotations

import scipy

from flexgui.core.identify.fit_starts import evolve
from flexgui.core.identify.predictor import Predictor
from flexgui.core.identify.residuals import Residuals, channel_weights
from flexgui.core.identify.unknowns import collect_unknowns
from flexgui.core.montecarlo.parts.fits import run_data
from flexgui.core.montecarlo.rig import Rig
from flexgui.core.montecarlo.settings import StudySettings, make_settings
from flexgui.core.montecarlo.study import study
from flexgui.core.processors import WORKERS
from flexgui.core.recording.recording import Recording
from flexgui.core.resumable.executor import Here, Processes
from tests.bench.case import GENERATIONS, LOWER, MEMBERS, UPPER, Case
from tests.bench.comparisons.evolution import SAME, SEED, peer_search
from tests.bench.row import Row, Size, seconds
from tests.paper_study.helpers import paper_scenario, records_of

RUNS, SNR_DB = 20, 20.0
LIMIT = 300.0
"""s: what the study may take on two cores."""


def rows(size: Size) -> list[Row]:
    """Against SciPy's search over lsim, which is given as many cores without any loss."""
    settings = make_settings(paper_scenario(seconds=size.seconds), runs=size.study_runs)
    ours = _ours(settings) * RUNS / size.study_runs
    rig = Rig(settings)
    data = run_data(rig, SNR_DB, 1)
    fits = RUNS * len(settings.snr_db)
    local, same_local = _peer(rig, data[:1], size.peer_generations)
    glocal, same_glocal = _peer(rig, data, size.peer_generations)
    peer = fits * (len(data) * local + glocal) / WORKERS
    made = "" if size.study_runs == RUNS else f", extrapolated from {size.study_runs} run(s)"
    note = (
        f"ours on {WORKERS} processes with their start{made}; peer extrapolated from "
        f"{size.peer_generations} of {GENERATIONS} generations of one local and one glocal search "
        f"to {fits} x ({len(data)} + 1) searches on {WORKERS} cores; limit {LIMIT:.0f} s"
    )
    return [
        Row("the whole paper study, lsim", ours, peer, None, same_local and same_glocal, note=note)
    ]


def _ours(settings: StudySettings) -> float:
    """Seconds; few runs stay in this process, where starting others would be all there is."""
    executor = Processes(WORKERS) if settings.runs >= RUNS else Here()
    return seconds(lambda: records_of(study(settings, executor=executor, only=["fits"])))


def _peer(rig: Rig, data: list[Recording], generations: int) -> tuple[float, bool]:
    """Seconds of one whole search, and whether ours has the same best cost after as many."""
    case = _case(rig, data)
    found: list[scipy.optimize.OptimizeResult] = []
    some = seconds(lambda: found.append(peer_search(case, generations)))
    expected = evolve(case.cost, LOWER, UPPER, MEMBERS, generations, SEED, lambda _: False).cost
    evaluations = MEMBERS * (GENERATIONS + 1)
    same = abs(float(found[0].fun) / expected - 1.0) < SAME
    return some * evaluations / found[0].nfev, same


def _case(rig: Rig, data: list[Recording]) -> Case:
    unknowns = collect_unknowns(rig.model, rig.settings.identify(rig.bounds, SEED), data)
    experiments = [rig.prepared(r) for r in data]
    residuals = Residuals(Predictor(experiments, unknowns), channel_weights(experiments, {}))
    cost = residuals.population()
    assert cost is not None
    return Case(rig.model, experiments, cost)
