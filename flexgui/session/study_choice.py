"""How much of the Monte Carlo study a person asks for, and whether a scenario allows one."""

from __future__ import annotations

from dataclasses import dataclass

from core.errors import InputError
from core.montecarlo.rig import Rig
from core.montecarlo.settings import StudySettings, make_settings
from core.montecarlo.study import parts, study_cases
from core.scenario.schema import Scenario

FEW, PAPER = 5, 20
"""Runs: for a look in front of a class, and as in the paper."""

MOST_RUNS, MOST_AT_ONCE = 500, 4

NOTHING_TO_DO = "The chosen parts have nothing to do in this scenario; choose Estimates as well."


@dataclass(frozen=True)
class StudyChoice:
    """The first one takes seconds."""

    runs: int = FEW
    parts: tuple[str, ...] = ("fits",)
    at_once: int = 2
    """Cases under way at a time, where the workers are free."""


def whole() -> StudyChoice:
    """All that the paper has, and all that goes beyond it."""
    return StudyChoice(PAPER, tuple(parts()))


def asked(scenario: Scenario, choice: StudyChoice) -> StudySettings:
    """InputError, one sentence, where there is no such study."""
    if not choice.parts:
        raise InputError("No part of the study is chosen; choose Estimates at least.")
    settings = make_settings(scenario, runs=choice.runs)
    _ = Rig(settings).truth  # an arm of another kind is refused here, not in a worker
    if not study_cases(settings, choice.parts):
        raise InputError(NOTHING_TO_DO)
    return settings


def refusal(scenario: Scenario) -> str:
    """Why no study can be made of a scenario, in one sentence; empty where one can."""
    try:
        asked(scenario, StudyChoice())
    except InputError as error:
        return str(error)
    return ""
