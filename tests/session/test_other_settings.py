"""A result belongs to the settings that it was made with, and stands again with them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from flexgui.core.scenario.read import scenario_toml
from flexgui.core.scenario.schema import Scenario
from flexgui.library.shipped import DEMO, HIDDEN, demo_scenario, hidden_scenario
from flexgui.page.earlier_work import DIAGNOSIS, FIT, other_settings, replaced_work
from flexgui.server.services import Services
from flexgui.session.scenario_edits import (
    Edit,
    apply_edits,
    recording_path,
    set_arm,
    set_simulated_noise,
    set_value,
)
from flexgui.session.session import Session
from flexgui.session.settings import made_with, settings_of
from flexgui.stages.diagnose.effects import with_effect
from tests.marks import long_except
from tests.session.helpers import bring, good_csv, shortened, small, until

KINDS = ["coulomb_friction", "tip_payload"]


@pytest.fixture(scope="module")
def worked(services: Services, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    """A session with an identification, a profile of its parameter, and a diagnosis."""
    made = Session("worked", tmp_path_factory.mktemp("worked"), services)
    made.choose(HIDDEN)
    assert made.document.change(shortened(0, 3), set_value(("diagnose", "candidates"), KINDS))
    assert made.diagnosis.search()
    until(lambda: not made.run.busy and made.diagnosis.pending is None)
    assert made.identification.find_profile("EI", None)
    until(lambda: not made.run.busy and made.identification.profile is not None)
    yield made
    made.close()


def results(session: Session) -> tuple[Any, ...]:
    """All that a person would miss: the result and whether it is of the present settings."""
    fitted, diagnosis = session.identification, session.diagnosis
    assert fitted.outcome is not None and diagnosis.newest is not None
    return (
        session.document.scenario, fitted.outcome, fitted.current, fitted.profile,
        diagnosis.versions, diagnosis.newest.scenario == session.document.scenario,
        [m.version.scenario for m in diagnosis.models.comparable], diagnosis.models.present,
        session.comparison.shown, session.document.live,
    )  # fmt: skip


def value_of(scenario: Scenario, *path: str | int) -> Any:
    place: Any = scenario.model_dump()
    for key in path:
        place = place[key]
    return place


def setting(*path: str | int, other: Any) -> Callable[[Scenario], tuple[Edit, Edit]]:
    return lambda s: (set_value(path, other), set_value(path, value_of(s, *path)))


def slider(name: str, factor: float, unit: float = 1.0) -> Callable[[Scenario], tuple[Edit, Edit]]:
    """There and back in the unit that it shows."""

    def edits(s: Scenario) -> tuple[Edit, Edit]:
        value = settings_of(s)[("arm", "segments", 0, name)]
        there = factor * (value / unit) * unit
        return set_arm(s, name, there), set_arm(apply_edits(s, set_arm(s, name, there)), name,
                                                (value / unit) * unit)  # fmt: skip

    return edits


SETTINGS: dict[str, Callable[[Scenario], tuple[Edit, Edit]]] = {
    "ε": slider("young_modulus", 1.01, 1e9),
    "d": slider("width", 1.002, 1e-3),
    "length": slider("length", 1.1),
    "mass": lambda s: (set_arm(s, "mass", [8.0, 5.0]), set_arm(s, "mass", [7.5, 5.0])),
    "modes": lambda s: (set_arm(s, "modes", 2), set_arm(s, "modes", 1)),
    "SNR": lambda _: (set_simulated_noise(20.0), set_simulated_noise(None)),
    "gains": setting("drive", "gains", other=[60.0, 31.0]),
    "method": setting("identify", "method", other="local"),
    "output": setting("identify", "output", other=["encoder"]),
    "population": setting("identify", "population", other=31),
    "generations": setting("identify", "generations", other=1),
    "refine": setting("identify", "refine", other=False),
    "prior": lambda _: (
        set_value(("identify", "prior", "EI"), 1.0), set_value(("identify", "prior", "EI"), None),
    ),
    "bounds": lambda _: (
        set_value(("identify", "bounds", "EI"), [400.0, 600.0]),
        set_value(("identify", "bounds", "EI"), None),
    ),
    "rig": setting("rig", "direct_drive", other=True),
    "role": setting(*recording_path(1, "role"), other="estimate"),
    "camera": setting(*recording_path(0, "time_shift"), other=1e-3),
    "mask": setting(*recording_path(0, "mask"), other={"z1": [[0.1, 0.2]]}),
    "title": setting("title", other="mine"),
}  # fmt: skip
"""What inputs of the page change -> the edits there and back, of a scenario."""


@pytest.mark.parametrize("name", SETTINGS)
def test_a_setting_that_is_changed_and_changed_back_leaves_everything_as_it_was(
    worked: Session, name: str
) -> None:
    before = results(worked)
    assert before[5] and before[1] is before[2] and before[3] is not None
    there, back = SETTINGS[name](worked.document.scenario)
    assert worked.document.change(there), worked.message
    assert worked.identification.current is None, "of other settings"
    assert worked.identification.outcome is before[1], "and still there"
    assert worked.diagnosis.versions == before[4] and len(worked.diagnosis.models.listed) == 1
    for of in (FIT, DIAGNOSIS):
        assert "Back to these settings" in other_settings(worked, of)
    assert worked.document.change(back)
    assert results(worked) == before
    assert not other_settings(worked, FIT) and not other_settings(worked, DIAGNOSIS)


def test_results_of_several_settings_stand_each_with_its_own(session: Session) -> None:
    small(session)
    found: dict[int, Any] = {}
    for seed in (1, 2):
        assert session.document.change(set_value(("identify", "seed"), seed))
        assert session.identification.start()
        until(lambda: session.identification.current is not None and not session.run.busy)
        found[seed] = session.identification.outcome
    assert session.document.change(set_value(("identify", "seed"), 3))
    assert session.identification.current is None
    for seed in (1, 2, 1):
        assert session.document.change(set_value(("identify", "seed"), seed))
        assert session.identification.current is found[seed]


def test_a_result_that_comes_after_its_settings_were_changed_waits_for_them(
    session: Session,
) -> None:
    small(session)
    assert session.identification.start()
    assert session.document.change(set_value(("identify", "seed"), 2))
    until(lambda: session.identification.outcome is not None and not session.run.busy)
    assert session.identification.current is None
    note = other_settings(session, FIT)
    assert "Made with identify.seed = 1 (now 2)." in note
    made = session.identification.outcome_of
    assert made is not None and session.go_to(made) and session.identification.current is not None


def test_every_model_of_the_session_can_be_returned_to_from_other_settings(
    worked: Session,
) -> None:
    before, (model,) = results(worked), worked.diagnosis.models.listed
    for edit in (set_arm(before[0], "young_modulus", 1.1e9), shortened(0)):
        assert worked.document.change(edit)
        assert worked.diagnosis.models.listed == (model,) and not worked.diagnosis.models.comparable
        assert worked.diagnosis.return_to(model.number)
        assert results(worked) == before


def opens(session: Session) -> None:
    assert session.choose(DEMO)


def hides(session: Session) -> None:
    assert session.challenge.hide(30, "easy")
    until(lambda: session.challenge.state is not None)
    session.run.stop()
    until(lambda: not session.run.busy)


def brings(session: Session) -> None:
    file = good_csv(session)
    assert session.recordings.upload("mine.csv", file).result()
    assert session.recordings.imports.use(alone=True)


def brings_a_scenario(session: Session) -> None:
    text = scenario_toml(demo_scenario()).encode()
    assert session.recordings.upload("mine.toml", text).result()


def chooses_a_rig(session: Session) -> None:
    assert session.recordings.rig.choose_kind("Torque recorded")


QUICK = [opens, hides, brings_a_scenario, chooses_a_rig]


@pytest.mark.parametrize("replace", long_except(QUICK, [*QUICK, brings]))
def test_what_is_replaced_comes_back_with_one_press(
    worked: Session, replace: Callable[[Session], None]
) -> None:
    before = results(worked)
    replace(worked)
    assert worked.document.scenario != before[0]
    assert "An arm with a hidden effect”, is kept" in replaced_work(worked)
    assert worked.replaced.back()
    assert worked.challenge.state is None
    assert results(worked) == before


@pytest.mark.parametrize("replace", [opens, brings_a_scenario, chooses_a_rig])
def test_a_stated_rig_comes_back_with_one_press(
    session: Session, replace: Callable[[Session], None]
) -> None:
    assert session.recordings.rig.state('{"segments.length.0": "0.7"}')
    assert bring(session, "own.csv", good_csv(session))
    stated, own = session.document.scenario, session.recordings.imports.own_files
    replace(session)
    assert session.document.scenario != stated
    assert session.replaced.back()
    assert session.document.scenario == stated and session.recordings.imports.own_files == own
    assert not session.recordings.imports.missing


def test_nothing_is_offered_where_nothing_was_replaced(session: Session) -> None:
    assert session.choose(HIDDEN) and session.choose(DEMO)
    assert not replaced_work(session) and not session.replaced.back()
    assert session.document.set_noise(30.0) and session.choose(HIDDEN)
    assert replaced_work(session)
    session.replaced.forget()
    assert not replaced_work(session)


def test_a_replaced_challenge_goes_on(session: Session) -> None:
    hides(session)
    challenge = session.challenge.state
    assert challenge is not None
    opens(session)
    assert session.challenge.state is None
    assert session.replaced.back() and session.challenge.state == challenge


def test_findings_of_the_check_stand_again_too(session: Session) -> None:
    session.check.checked = given = session.document.scenario
    assert session.document.change(set_arm(given, "width", 0.051))
    assert not session.check.is_checked
    assert session.document.change(set_arm(session.document.scenario, "width", 0.05))
    assert session.check.is_checked


SAID = {
    "Made with ε = 1\N{NO-BREAK SPACE}GPa (now 1.05\N{NO-BREAK SPACE}GPa).": (
        lambda s: [set_arm(s, "young_modulus", 1.05e9)]
    ),
    "Made with SNR = 20\N{NO-BREAK SPACE}dB (now none).": lambda _: [set_simulated_noise(None)],
    "Made with 8 recordings (now 2 recordings).": lambda _: [shortened(0, 1, seconds=3.0)],
    "Made with identify.method = glocal (now local) and identify.population = 30 (now 40).": (
        lambda _: [set_value(("identify", name), value)
                   for name, value in (("method", "local"), ("population", 40))]
    ),
    "Made with the model “as given” (now the model “Coulomb friction”).": (
        lambda _: [with_effect("coulomb_friction", None)]
    ),
    "": lambda s: [set_arm(s, "width", [0.05, 0.05])],
}  # fmt: skip


@pytest.mark.parametrize("said", SAID)
def test_it_is_said_with_which_settings_a_result_was_made(said: str) -> None:
    made = demo_scenario()
    assert made_with(made, apply_edits(made, *SAID[said](made))) == said
    assert made_with(hidden_scenario(), made) == "Made with “An arm with a hidden effect”."


def test_the_slider_of_the_noise_shows_what_the_recordings_have(session: Session) -> None:
    assert session.document.live.snr_db == 20.0
    assert session.choose(HIDDEN) and session.document.live.snr_db is None
    made = session.document.scenario
    assert session.document.set_noise(30.0) and session.document.live.snr_db == 30.0
    assert session.go_to(made) and session.document.live.snr_db is None
