"""Page, command line and library agree on a scenario; a saved run is opened on the page."""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import flexgui as fg
from flexgui.core.results import Diagnosis, Estimate, LadderStep, Outcome
from flexgui.core.scenario.read import parse_scenario, scenario_toml
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.workbench import run_scenario
from flexgui.export.export_files import export_run
from flexgui.export.saved_run import SavedRun, Source, read_run
from flexgui.export.serialization import serialize
from flexgui.server.serve import beginning
from flexgui.session.scenario_edits import ScenarioDict, apply_edits, set_value
from flexgui.session.session import Session
from flexgui.stages.data.uploads import found_file
from flexgui.stages.diagnose.effects import present
from flexgui.stages.diagnose.fitted_models import errors_of, evidence_of
from flexgui.stages.diagnose.model_versions import combined_diagnosis, ladder_steps
from flexgui.stages.diagnose.panel_candidates import WORDS
from flexgui.views.headline import criteria, final_comparisons
from tests.session.helpers import exported, shortened, until

CANDIDATES = [
    "coulomb_friction", "viscous_friction", "tip_payload", "camera_delay", "structural_damping",
    "drive_gain",
]  # fmt: skip

COULOMB = {"coulomb_friction": {"fc1": 1.2, "fc2": 0.4}}
LATE = {"camera_delay": {"td": 0.01}}
LOADED = COULOMB | {"tip_payload": {"mt2": 0.4}}
HIDDEN: list[Any] = [
    pytest.param({"viscous_friction": {"fv1": 2.0, "fv2": 0.5}}, id="viscous friction"),
    pytest.param({}, id="nothing", marks=pytest.mark.long),
    pytest.param(COULOMB, id="coulomb friction", marks=pytest.mark.long),
    pytest.param(LATE, id="a late camera", marks=pytest.mark.long),
    pytest.param(LOADED, id="two effects", marks=pytest.mark.long),
    pytest.param(LOADED | LATE, id="three effects", marks=pytest.mark.long),
]

SAME_SIZE = 0.1
"""Standard deviations: what adds half a per cent to one."""

SAME_ERROR = 5e-3
"""Relative, of an rms: one more descent from the other's end may still gain as much."""


def hide(effects: Mapping[str, Mapping[str, float]]) -> Any:
    """Simulates the recordings with these effects instead of their own."""

    def edit(document: ScenarioDict) -> None:
        for recording in document["recordings"]:
            recording["hidden"] = effects

    return edit


def grown_on_the_page(session: Session) -> None:
    """Identifies, then adds what is proposed until nothing more is."""
    over = lambda: not session.run.busy and session.diagnosis.pending is None  # noqa: E731
    assert session.identification.start()
    until(over)
    assert session.diagnosis.search()
    until(over)
    while (found := session.diagnosis.versions[-1].diagnosis) and found.proposed:
        assert session.diagnosis.add(found.proposed[0])
        until(over)


def sizes(parameters: tuple[Estimate, ...]) -> dict[str, tuple[float, float]]:
    return {e.name: (e.value, e.std) for e in parameters}


def rms(step: LadderStep) -> dict[str, float]:
    return {e.channel: e.rms for e in step.errors}


@pytest.mark.parametrize("hidden", HIDDEN)
def test_page_command_line_and_library_agree(
    session: Session, tmp_path: Path, hidden: dict[str, dict[str, float]]
) -> None:
    session.choose("something hidden")
    kinds = set_value(("diagnose", "candidates"), CANDIDATES)
    assert session.document.change(shortened(0, 1, 3), hide(hidden), kinds)
    path = tmp_path / "rig.toml"
    path.write_text(scenario_toml(session.document.scenario))
    grown_on_the_page(session)
    page = combined_diagnosis(session.diagnosis.versions)
    library, line = fg.load(path).diagnose(), exported(path, tmp_path / "out")
    headless = library.outcome.diagnosis
    assert page is not None and headless is not None
    assert page.verdict == library.verdict == line["verdict"]
    assert page.standing_verdict == headless.standing_verdict
    assert line["final_verdict"] == library.final_verdict
    added = [kind for kind, _ in present(session.document.scenario)]
    assert added == list(library.added) == [s["added"] for s in line["steps"][1:]]
    assert set(added) == set(hidden)
    values = {p["name"]: p["value"] for p in line["parameters"]}
    mine = sizes(page.parameters)
    for name, (value, deviation) in sizes(headless.parameters).items():
        assert values[name] == pytest.approx(value, rel=1e-9)
        assert mine[name][0] == pytest.approx(value, abs=SAME_SIZE * deviation), name
    assert rms(page.steps[-1]) == pytest.approx(rms(headless.steps[-1]), rel=SAME_ERROR)
    assert page.verdict == ("missing" if hidden else "nothing_missing")
    one_evidence(session, page)


def one_evidence(session: Session, report: Diagnosis) -> None:
    """What the report of a session says for an effect is the difference of the criteria that its
    table of models shows."""
    models = session.diagnosis.models
    assert models.present is not None
    rows = [evidence_of(model, models.present.version) for model in models.comparable]
    found = [r.delta_bic for tried in report.rounds for r in tried.ranking
             if r.effect == tried.accepted]  # fmt: skip
    assert [row.fall for row in rows[1:]] == pytest.approx(found)
    for before, after in pairwise(rows):
        assert before.criteria is not None and after.criteria is not None
        assert after.fall == pytest.approx(before.criteria.bic - after.criteria.bic)


FEW = ["coulomb_friction", "viscous_friction", "tip_payload"]
TEXT = "title = 'friction'"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a saved diagnosis that added a friction."""
    from flexgui.library.shipped import EMBEDDED

    settings = {"candidates": FEW, "max_effects": 2}
    edits = (shortened(0, 1, 3), set_value(("diagnose",), settings))
    scenario = apply_edits(EMBEDDED["something hidden"](), *edits)
    folder = tmp_path_factory.mktemp("saved")
    export_run(run_scenario(scenario), Source(scenario, TEXT, folder), folder, whole=False)
    return folder


@pytest.fixture
def opened(run: Path, session: Session) -> Session:
    beginning(run, None, print)(session)
    return session


def saved(run: Path) -> tuple[Scenario, Outcome]:
    known: SavedRun = read_run(run)
    return known.scenario, known.outcome


@pytest.mark.long
def test_the_ladder_is_that_of_the_run(opened: Session, run: Path) -> None:
    _, outcome = saved(run)
    assert outcome.diagnosis is not None
    assert outcome.diagnosis.added == ("coulomb_friction",)
    assert ladder_steps(opened.diagnosis.versions) == outcome.diagnosis.steps
    last = opened.diagnosis.newest
    assert last is not None
    assert last.diagnosis is not None
    assert last.diagnosis.verdict == outcome.diagnosis.final_verdict


@pytest.mark.long
def test_what_is_exported_is_what_was_saved(opened: Session, run: Path) -> None:
    assert opened.diagnosis.whole is not None
    assert serialize(opened.diagnosis.whole) == serialize(saved(run)[1])


def test_the_model_holds_the_effect_and_keeps_what_was_stated(opened: Session, run: Path) -> None:
    scenario, _ = saved(run)
    now = opened.document.scenario
    assert [e.id for e in now.model.effects] == ["coulomb_friction"]
    assert now.identify == scenario.identify
    assert opened.identification.current is not None
    errors = [c.rms for r in opened.comparison.shown for c in r.channels]
    assert errors == [c.rms for r in final_comparisons(saved(run)[1]) for c in r.channels]


def test_the_scenario_of_what_was_found_goes_on_from_its_fit(opened: Session) -> None:
    whole = opened.diagnosis.whole
    assert whole is not None and whole.diagnosis is not None
    name, content = found_file(opened.document.scenario, whole, opened.folder)
    assert name.endswith("_diagnosed.toml")
    values = base_model(parse_scenario(content.decode(), name)).effect_values
    fitted = {e.name: e.value for e in whole.diagnosis.parameters}
    assert values["fc1"] == pytest.approx(fitted["fc1"])


def test_each_model_has_the_criteria_that_the_report_states(opened: Session, run: Path) -> None:
    """So that their differences are the evidence: one number wherever it stands."""
    models = opened.diagnosis.models
    assert models.present is not None
    (given, none), (grown, fall) = (
        evidence_of(model, models.present.version) for model in models.comparable
    )
    assert given is not None and grown is not None and none is None
    assert grown.parameters == given.parameters + 2
    assert grown == criteria(saved(run)[1])
    assert fall == pytest.approx(given.bic - grown.bic)
    diagnosis = saved(run)[1].diagnosis
    assert diagnosis is not None
    assert diagnosis.ranking[0].effect == "coulomb_friction"
    assert diagnosis.ranking[0].delta_bic == pytest.approx(fall)


def test_the_table_of_models_states_numbers_that_agree(opened: Session) -> None:
    models = opened.diagnosis.models
    assert models.present is not None
    like = models.present.version
    rows = [(m, errors_of(m, like), evidence_of(m, like), "", "") for m in models.comparable]
    text = str(WORDS.models(rows, models.present, None, True)).replace("\u2212", "-")
    bics = [float(x) for x in re.findall(r"[^\u0394]BIC (-?\d+)", text)]
    assert bics[0] - bics[1] > 1000.0 and "\u0394BIC over 1000" in text


def test_one_can_return_to_the_model_as_given(opened: Session, run: Path) -> None:
    assert opened.diagnosis.return_to(1)
    assert opened.document.scenario == saved(run)[0]
    ranking = opened.diagnosis.versions[-1].ranking
    assert ranking[0].effect == "coulomb_friction"
    assert opened.identification.current is None
