"""A follower's own copy of the teacher's session."""

from __future__ import annotations

import shutil
from dataclasses import replace

from flexgui.session import Session, Topic


def copy_session(teacher: Session, own: Session) -> None:
    """The scenario, its files, and what was found so far; jobs stay the teacher's."""
    shutil.copytree(teacher.folder, own.folder, dirs_exist_ok=True)
    own.open(teacher.scenario)
    # Frozen records, which both may hold.
    own.outcome, own.outcome_of = teacher.outcome, teacher.outcome_of
    if teacher.challenge is None:
        own.looks = teacher.looks
    else:
        own.take_up(teacher.challenge)
    own.live, own.stage = teacher.live, teacher.stage
    own.cursor = replace(teacher.cursor, playing=False)
    own.tell(Topic.OUTCOME, Topic.DIAGNOSIS, Topic.STAGE, Topic.CURSOR)
    own.refresh_live()
    own.refresh_playback()
