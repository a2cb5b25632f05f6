"""The whole way with real clicks: on recordings of an independent engine, and on a challenge."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexgui.core.scenario.read import read_scenario
from flexgui.session.scenario_edits import set_value
from flexgui.session.session import Session
from flexgui.stages.data.uploads import fetch_files
from flexgui.stages.diagnose.effects import present, titled
from flexgui.stages.diagnose.model_versions import ladder_steps
from tests.page.helpers import press, sees
from tests.page.test_diagnose import HEADLESS, answer, bars, headless
from tests.session.helpers import until
from tests.workbench.test_real_rigs import SCENARIOS, data_folder

pytestmark = pytest.mark.long

RECORDED = Path(__file__).resolve().parents[2] / "scenarios" / "mujoco"

SLOW = 600_000
"""ms: a search over all effects on a machine with two cores."""


def walk(page: Any, session: Session, right: str, identified: bool = False) -> None:
    """From recordings, which may be identified already, to a found effect and back again."""
    title = titled([right])[0]
    press(page, "Identify")
    if not identified:
        press(page, "Start identification")
    page.get_by_role("button", name="Next: compare model and measurements").wait_for(timeout=SLOW)
    press(page, "Next: compare model and measurements")
    sees(page, "Worst places")
    press(page, "Next: diagnose")
    press(page, "Find what is missing")
    page.get_by_text("Something is missing.").wait_for(timeout=SLOW)
    page.get_by_role("button", name=f"Add {title}", exact=True).first.wait_for()
    assert session.diagnosis.newest is not None
    assert session.diagnosis.newest.ranking[0].effect == right
    expected = headless(session)
    given = ladder_steps(session.diagnosis.versions)
    press(page, f"Add {title}")
    page.get_by_text(f"{title}: error from").wait_for(timeout=SLOW)
    first, second = ladder_steps(session.diagnosis.versions)
    assert np.sqrt(second.cost_per_sample) == pytest.approx(expected, rel=HEADLESS)
    assert second.cost_per_sample < 0.5 * first.cost_per_sample
    until(lambda: len(bars(page)) == 2)
    press(page, "Undo the last step")
    until(lambda: len(bars(page)) == 1 and not present(session.document.scenario))
    # Over its own floors again; beside the second step it stood over that one's.
    assert ladder_steps(session.diagnosis.versions) == given


def test_on_recordings_of_an_independent_engine(page: Any, session: Session) -> None:
    path = RECORDED / "tip_payload.toml"
    scenario = read_scenario(path)
    scenario = fetch_files(scenario, path.parent, None, session.folder)
    assert session.open(scenario)
    kinds = ["tip_payload", "coulomb_friction", "viscous_friction", "camera_delay"]
    assert session.document.change(set_value(("diagnose", "candidates"), kinds))
    walk(page, session, "tip_payload")


def test_on_a_real_bench(page: Any, session: Session) -> None:
    folder = data_folder("quanser_2dsfl_steps.csv", "ctu_2dsfl_lqr.csv")
    path = SCENARIOS / "bench_2dsfl.toml"
    scenario = read_scenario(path).model_copy(update={"compare": ()})
    scenario = fetch_files(scenario, path.parent, folder, session.folder)
    assert session.open(scenario)
    kinds = ["coulomb_friction", "viscous_friction", "presliding_friction", "gravity_tilt"]
    assert session.document.change(set_value(("diagnose", "candidates"), kinds))
    walk(page, session, "presliding_friction")


def test_on_a_challenge(page: Any, session: Session) -> None:
    press(page, "Challenge")
    press(page, "Hide an effect")
    page.get_by_text("these recordings hide an effect").wait_for(timeout=SLOW)
    known = session.challenge.state
    assert known is not None
    kind = known.truth.effects[0]
    walk(page, session, kind, identified=True)
    press(page, "Challenge")
    answer(page, kind)
