"""Page, command line and library say the same of the same scenario."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

import flexgui as fg
from flexgui.core.results import Estimate, LadderStep
from flexgui.core.scenario.read import scenario_toml
from flexgui.session.scenario_edits import ScenarioDict, set_value
from flexgui.session.session import Session
from flexgui.stages.diagnose.effects import present
from flexgui.stages.diagnose.model_versions import combined_diagnosis
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
