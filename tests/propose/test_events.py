"""A push in one stretch of each recording is named as such, and is gone with the stretch."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import flexgui as fg
from flexgui.core.results import Event
from flexgui.session.scenario_edits import apply_edits
from flexgui.stages.diagnose.effects import without_events
from tests.propose.test_propose import DRIVE, NOISE, project, recorded

PUSHES = {"r0": (0.35, (3.0, -1.5)), "r1": (0.62, (-2.0, 2.5)), "r2": (0.22, (1.0, 3.0)),
          "unseen": (0.5, (2.0, 2.0))}  # fmt: skip
"""Recording -> when the push begins, in s, and its force in N along z1 and z2."""
LASTS, SECONDS = 0.15, 1.2

NEAR = 0.01
"""s, of begin and end: a 25th of the stretch in which the force is looked for."""

ABOUT = 0.1
"""Relative, of the force: its edges are smoothed."""


def pushed(name: str, theta2: float, seed: int) -> dict[str, Any]:
    """A recording in which somebody pushes the tip."""
    start, force = PUSHES[name]
    during = f"(tanh((t - {start})/0.001) - tanh((t - {start + LASTS})/0.001))/2"
    machine = fg.project("paper", DRIVE, sensors=NOISE, model={"level": "nonlinear"})
    laws = [fg.formula(f"tip{k}", f"f{k}*{during}", **{f"f{k}": f}) for k, f in enumerate(force, 1)]
    made = machine.with_effects(*laws).simulate(theta2=theta2, seconds=SECONDS, seed=seed)
    return {"table": made.to_dataframe(), "name": name}


@cache
def rig() -> fg.Project:
    """With a model that knows of no push."""
    places = zip(PUSHES, (0.6, 1.3, 1.9, 1.0), strict=True)
    recordings = [pushed(name, x, seed) for seed, (name, x) in enumerate(places)]
    return project([*recordings[:-1], {**recordings[-1], "role": "validate"}])


@cache
def events() -> tuple[Event, ...]:
    found = rig().propose()
    assert not found.laws and found.reason == ""
    return found.events


@pytest.mark.long
def test_a_push_in_each_recording_is_named_with_its_time_its_place_and_its_force() -> None:
    assert [e.recording for e in events()] == list(PUSHES)
    for event in events():
        start, force = PUSHES[event.recording]
        assert (event.target, event.unit) == ("tip", "N")
        assert event.start == pytest.approx(start, abs=NEAR)
        assert event.stop == pytest.approx(start + LASTS, abs=NEAR)
        assert np.linalg.norm(np.subtract(event.force, force)) < ABOUT * np.linalg.norm(force)


@pytest.mark.long
def test_what_is_left_of_the_recordings_without_their_events_holds_none() -> None:
    for event in events():
        (first, start), (stop, last) = event.rest
        assert first == 0.0 < start < event.start < event.stop < stop < last < SECONDS


@pytest.mark.long
def test_a_law_of_the_motion_is_no_event() -> None:
    law = fg.formula("joint2", "-a*theta2**3", a=0.3)
    assert not project(recorded((0.6, 1.3, 2.0), law, amplitude=0.5)).propose().events


def test_a_recording_is_stated_before_and_after_its_event() -> None:
    event = Event("b", 1.0, 1.2, "tip", "the tip", (1.0, 2.0), "N", ((0.0, 0.9), (1.3, 3.0)))
    entries = [{"name": name, "file": f"{name}.csv", "mask": {"z1": [[0.1, 0.2]]}} for name in "ab"]
    scenario = fg.project("paper", DRIVE).scenario
    stated = apply_edits(scenario, lambda s: s.update(recordings=entries))
    scenario = apply_edits(stated, without_events([event]))
    first, *parts = scenario.recordings
    assert first.window is None
    assert [p.window for p in parts] == [(0.0, 0.9), (1.3, 3.0)]
    assert {p.file for p in parts} == {"b.csv"} and len({p.name for p in parts}) == 2
    assert all(p.mask == first.mask for p in parts)
    again = apply_edits(scenario, without_events([event]))
    assert len({p.name for p in again.recordings}) == len(again.recordings) == 4
