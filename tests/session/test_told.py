"""In which order the search for what is missing tells what it finds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flexgui.core.progress import Silent
from flexgui.core.results import RecordingComparison
from flexgui.core.scenario.read import parse_scenario
from flexgui.stages.diagnose.model_versions import ModelFindings
from flexgui.stages.diagnose.task import COMPARED, LOOKED, diagnose
from tests.diagnose.test_doubts import scenario as judged
from tests.diagnose.test_doubts import validated
from tests.diagnose.test_run import HIDDEN, text

CANDIDATES = """[diagnose]
candidates = ["coulomb_friction", "drive_saturation", "camera_delay"]"""
TEXT = f"""
{text(diagnose=CANDIDATES)}
[[recordings]]
role = "validate"
simulate = {{ theta2 = 0.8, seconds = 0.4, seed = 2, {HIDDEN} }}
"""


class Heard(Silent):
    """Keeps what is told; stops once a look says that it should."""

    def __init__(self, stop: Any = lambda _: False) -> None:
        self.versions: list[ModelFindings] = []
        self.order: list[str] = []
        self.compared: tuple[RecordingComparison, ...] = ()
        self._stop, self._stopped = stop, False

    def partial(self, name: str, value: Any) -> None:
        self.order.append(name)
        if name == LOOKED:
            self.versions.append(value)
            self._stopped = self._stopped or self._stop(value)
        else:
            self.compared = value

    def stopped(self) -> bool:
        return self._stopped


def unseen(version: ModelFindings) -> bool:
    """Whether the model was tried on recordings that no fit saw."""
    return all(np.isfinite(e.validation_rms) for e in version.step.errors)


def test_the_error_comes_first_then_a_ranking_of_all_then_the_comparison() -> None:
    heard = Heard()
    found = diagnose(parse_scenario(TEXT, "test"), progress=heard)
    first, *more = heard.versions
    assert first.step.errors and not first.ranking and not unseen(first)
    assert {r.effect for r in more[0].ranking} == {
        "coulomb_friction", "drive_saturation", "camera_delay"
    }  # fmt: skip
    to_come = [version.to_come for version in more]
    assert to_come[0] > 0 and to_come == sorted(to_come, reverse=True) and to_come[-1] == 0
    assert not any(version.untried for version in more)
    whole = to_come.index(0)
    assert [unseen(version) for version in more] == [k > whole for k in range(len(more))]
    assert heard.order.count(COMPARED) == 1 and len(heard.compared) == 2
    assert unseen(found) and found.diagnosis is not None
    assert found.ranking[0].effect == "coulomb_friction"


def test_who_stops_at_the_first_ranking_keeps_it() -> None:
    found = diagnose(
        parse_scenario(TEXT, "test"), progress=Heard(lambda version: bool(version.ranking))
    )
    assert found.ranking and found.to_come > 0
    assert found.diagnosis is not None and found.diagnosis.stopped


def test_an_added_effects_own_fit_is_not_held_up_by_the_ranking() -> None:
    heard = Heard()
    diagnose(parse_scenario(TEXT, "test"), fit="before", progress=heard)
    assert heard.order[:4] == [LOOKED, LOOKED, COMPARED, LOOKED]
    assert heard.versions[2].outcome is not None and not heard.versions[2].ranking
    assert heard.order.count(COMPARED) == 1


@pytest.mark.parametrize("hidden", [False, True])
def test_a_search_beside_the_page_judges_by_unseen_recordings_as_a_run_does(hidden: bool) -> None:
    """It left them out and found nothing missing, beside an error of 40 noise floors on them."""
    scenario = judged(hidden)
    found, run = diagnose(scenario, progress=Heard()).diagnosis, validated(hidden)
    assert found is not None
    assert found.verdict == run.verdict and [d.reason for d in found.doubts] == [
        d.reason for d in run.doubts
    ]
    shown, stated = (d.steps[-1].errors for d in (found, run))
    assert [e.validation_rms for e in shown] == pytest.approx([e.validation_rms for e in stated])
