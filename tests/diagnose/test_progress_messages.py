"""A round says what it tries, and beforehand what will be slow."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexgui.core.arm.arm import Structure
from flexgui.core.arm.compiled import compile_arm
from flexgui.core.diagnose.output_changes import Trial
from flexgui.core.diagnose.progress_messages import (
    RoundProgress,
    fit_title,
    round_title,
    split_note,
)
from flexgui.core.effects import catalogue, effect
from flexgui.core.progress import Silent
from tests.helpers import PAPER

TWISTED = {"c1": 1e-5, "c2": 0.0, "Jh1": 0.05, "Jh2": 0.0}


class Heard(Silent):
    """What was told, in order."""

    def __init__(self) -> None:
        self.titles: list[str] = []
        self.texts: list[str] = []
        self.done = 0

    def stage(self, title: str, total: int | None = None) -> None:
        self.titles.append(title)

    def advance(self, n: int = 1, text: str = "") -> None:
        self.done += n
        self.texts.append(text)


def planned(*kinds: str, **values: float) -> list[Trial]:
    return [Trial(effect(kind), "", values, {}, False, False, ()) for kind in kinds]


def test_what_an_effect_brings_along_is_not_counted_as_one_more() -> None:
    present = [effect(kind) for kind in ("rotor_inertia", "joint_elasticity", "coulomb_friction")]
    assert fit_title(present) == "Fitting the model with Elastic joint and Coulomb friction"


@pytest.fixture
def nothing_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FLEXGUI_CACHE", str(tmp_path))


def test_the_first_round_tries_every_known_effect() -> None:
    assert round_title(()) == "Trying every known effect"
    assert round_title((), chosen=True) == "Trying the chosen effects"


def test_a_later_round_and_its_fit_name_what_the_model_has_by_then() -> None:
    friction = [effect("coulomb_friction")]
    assert round_title(friction) == "Continuing the search with Coulomb friction in the model"
    assert fit_title(friction) == "Fitting the model with Coulomb friction"
    assert fit_title(()) == "Fitting the model as it is"


def test_many_effects_are_counted_so_that_the_title_stays_short() -> None:
    many = [effect(k) for k in ("coulomb_friction", "backlash", "torque_ripple")]
    assert round_title(many) == "Continuing the search with 3 effects in the model"


@pytest.mark.usefixtures("nothing_compiled")
def test_only_effects_that_change_the_arm_are_said_to_be_compiled() -> None:
    heard = Heard()
    tried = planned("coulomb_friction", "extra_bending_mode", "base_compliance")
    RoundProgress(heard, PAPER, tried).begin("Trying", 3)
    (text,) = heard.texts
    assert text.startswith("(to be compiled once")
    assert "Extra bending mode and Soft base" in text
    assert "Coulomb" not in text
    assert heard.titles == ["Trying"]
    assert heard.done == 0


@pytest.mark.usefixtures("nothing_compiled")
def test_the_note_goes_once_it_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    heard, compiled = Heard(), False
    monkeypatch.setattr("flexgui.core.diagnose.progress_messages.is_compiled", lambda _: compiled)
    told = RoundProgress(heard, PAPER, planned("base_compliance"))
    told("Slow sensor")
    compiled = True
    told("")
    assert split_note(heard.texts[0])[1] != ""
    assert heard.texts[1] == "Slow sensor"
    assert heard.done == 1


def test_what_is_compiled_already_is_not_announced() -> None:
    tried = planned("joint_elasticity", **TWISTED)
    compile_arm(Structure.of(tried[0].effect.changed_arm(PAPER, TWISTED)))
    heard = Heard()
    told = RoundProgress(heard, PAPER, tried)
    told.begin("Continuing the search", 1)
    assert heard.texts == []
    told("Elastic joint")
    assert heard.texts == ["Elastic joint"]


def test_no_title_of_an_effect_can_be_mistaken_for_an_aside() -> None:
    assert all(split_note(one.title) == (one.title, "") for one in catalogue().values())
