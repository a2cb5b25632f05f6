"""A run of the command line or the library, opened on the page: its ladder, its models, its end."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexgui.core.results import Outcome
from flexgui.core.scenario.schema import Scenario
from flexgui.core.workbench import run_scenario
from flexgui.export.export_files import export_run
from flexgui.export.saved_run import SavedRun, Source, read_run
from flexgui.export.serialization import serialize
from flexgui.server.serve import beginning
from flexgui.session.scenario_edits import apply_edits, set_value
from flexgui.session.session import Session
from flexgui.stages.diagnose.model_versions import ladder_steps
from flexgui.views.headline import criteria, final_comparisons
from tests.session.helpers import shortened

CANDIDATES = ["coulomb_friction", "viscous_friction", "tip_payload"]
TEXT = "title = 'friction'"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a saved diagnosis that added a friction."""
    from flexgui.library.shipped import EMBEDDED

    settings = {"candidates": CANDIDATES, "max_effects": 2}
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


def test_the_ladder_is_that_of_the_run(opened: Session, run: Path) -> None:
    _, outcome = saved(run)
    assert outcome.diagnosis is not None
    assert outcome.diagnosis.added == ("coulomb_friction",)
    assert ladder_steps(opened.diagnosis.versions) == outcome.diagnosis.steps
    last = opened.diagnosis.newest
    assert last is not None
    assert last.diagnosis is not None
    assert last.diagnosis.verdict == outcome.diagnosis.final_verdict


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


def test_both_models_are_listed(opened: Session) -> None:
    titles = [model.title for model in opened.diagnosis.models.comparable]
    assert titles == ["As given", "Coulomb friction"]


def test_each_model_has_the_criteria_that_the_report_states(opened: Session, run: Path) -> None:
    given, grown = (model.criteria for model in opened.diagnosis.models.comparable)
    assert given is not None and grown is not None
    assert grown.parameters == given.parameters + 2
    assert grown == criteria(saved(run)[1])


def test_one_can_return_to_the_model_as_given(opened: Session, run: Path) -> None:
    assert opened.diagnosis.return_to(1)
    assert opened.document.scenario == saved(run)[0]
    ranking = opened.diagnosis.versions[-1].ranking
    assert ranking[0].effect == "coulomb_friction"
    assert opened.identification.current is None
