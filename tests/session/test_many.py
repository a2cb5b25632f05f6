"""Ten people who diagnose at once."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from flexgui.core.results import RankedEffect
from flexgui.jobs import JobPool
from flexgui.jobs.job import DONE, RUNNING
from flexgui.session.scenario_edits import set_value
from flexgui.session.session import Session
from flexgui.session.state import Topic
from tests.jobs.helpers import EVEN
from tests.session.conftest import Offered
from tests.session.helpers import shortened, until

pytestmark = pytest.mark.long

PEOPLE, SOON = 10, 900.0


def made(folder: Path, services: Offered) -> Session:
    folder.mkdir()
    session = Session(folder.name, folder, services)
    session.choose("something hidden")
    kinds = ["coulomb_friction", "viscous_friction", "tip_payload"]
    assert session.document.change(shortened(0, 1), set_value(("diagnose", "candidates"), kinds))
    return session


def figures(ranking: tuple[RankedEffect, ...]) -> list[tuple[str, float, float | None]]:
    return [(r.effect, r.expected_drop_percent, r.refit_drop_percent) for r in ranking]


def test_all_end_in_fair_order_with_the_results_of_one_alone(tmp_path: Path) -> None:
    with JobPool(2, EVEN) as pool:
        services = Offered(pool)
        alone = made(tmp_path / "alone", services)
        assert alone.diagnosis.search()
        until(lambda: over(alone), SOON)
        assert alone.diagnosis.newest is not None
        people = [made(tmp_path / f"person{k}", services) for k in range(PEOPLE)]
        began: list[str] = []
        for one in people:
            watch(one, began)
        start = time.monotonic()
        for one in people:
            assert one.diagnosis.search()
        until(lambda: all(map(over, people)), SOON)
        print(f"{PEOPLE} at once: {time.monotonic() - start:.1f} s")
        for one in people:
            assert one.run.state.phase == DONE and one.diagnosis.newest is not None, one.message
            assert figures(one.diagnosis.newest.ranking) == figures(alone.diagnosis.newest.ranking)
            one.close()
        alone.close()
    # Two workers take two at a time; nobody is overtaken by who came later than the next one.
    assert all(abs(k - int(key.removeprefix("person"))) <= 1 for k, key in enumerate(began))


def over(session: Session) -> bool:
    return not session.run.busy and session.diagnosis.pending is None


def watch(session: Session, began: list[str]) -> None:
    """Notes when its job begins."""

    def hear(topic: Topic) -> None:
        if session.run.state.phase == RUNNING and session.key not in began:
            began.append(session.key)

    session.subscribe(hear)
