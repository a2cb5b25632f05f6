"""A follower's own copy of the teacher's session. Imported when the first one is made: what a
session needs takes long to load, and the server listens before."""

from __future__ import annotations

import contextlib
import shutil
from dataclasses import replace
from pathlib import Path

from flexgui.core.errors import InputError
from flexgui.core.scenario.data_folder import Within
from flexgui.session import Session, Topic


def copy_session(teacher: Session, own: Session) -> None:
    """The scenario, its files, and what was found so far; jobs stay the teacher's."""
    _copy_files(teacher.folder, own.folder)
    own.open(teacher.scenario)
    # Frozen records, which both may hold.
    own.outcome, own.outcome_of = teacher.outcome, teacher.outcome_of
    if teacher.challenge is None:
        own.looks = teacher.looks
    else:
        own.take_up(teacher.challenge)
    own.live, own.stage = teacher.live, teacher.stage
    own.cursor = replace(teacher.cursor, playing=False)
    own.notify(Topic.OUTCOME, Topic.DIAGNOSIS, Topic.STAGE, Topic.CURSOR)
    own.refresh_live()
    own.refresh_playback()


def _copy_files(source: Path, target: Path) -> None:
    """Recordings only: studies and reports are the teacher's, and a link may lead anywhere."""
    for path in source.iterdir():
        with contextlib.suppress(InputError, FileNotFoundError):  # no recording, or gone meanwhile
            shutil.copyfile(Within(source).find(path.name), target / path.name)
