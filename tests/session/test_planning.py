"""The next experiment, planned on the page: files to play, or a sentence."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexgui.session.session import Session
from tests.session.helpers import shortened, until


@pytest.fixture
def brief(session: Session) -> Session:
    assert session.document.change(shortened(0, 1))
    return session


def test_the_files_to_play_and_the_words_are_handed_on(brief: Session) -> None:
    folders: list[Path] = []
    limits = {"speed": [0.3, 0.5]}
    assert brief.export.plan(2.0, limits, folders.append)
    until(lambda: not brief.run.busy)
    (folder,) = folders
    names = {path.name for path in folder.iterdir()}
    assert {"play1.csv", "expected1.csv", "plan.json", "plan.txt", "planned.toml"} <= names
    assert brief.export.planned[0].startswith("Record ")
    assert "limits" not in brief.document.scenario.model_dump(exclude_unset=True), (
        "it is left as it is"
    )
    text = (folder / "planned.toml").read_text(encoding="utf-8")
    assert "speed = [" in text and 'played = "play1.csv"' in text


@pytest.mark.long
def test_a_shorter_plan_leaves_nothing_of_the_one_before(brief: Session) -> None:
    folders: list[Path] = []
    for seconds, last in ((2.0, True), (1.0, False)):
        assert brief.export.plan(seconds, {}, folders.append)
        until(lambda: not brief.run.busy)
        assert (folders[-1] / "play2.csv").exists() is last


def test_a_wrong_limit_is_said(brief: Session) -> None:
    assert not brief.export.plan(2.0, {"speed": [-1.0]}, lambda _: None)
    assert "limits" in brief.message.text
