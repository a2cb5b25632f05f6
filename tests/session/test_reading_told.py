"""A long file is read before an identification begins, and the page says so meanwhile."""

from __future__ import annotations

from flexgui.jobs.job import JobState
from flexgui.jobs.messages import Advanced, Stage, Started
from flexgui.stages.identify.panel import WORDS


def test_how_far_a_file_is_read_stands_in_the_sentence() -> None:
    run = JobState(kind="identify")
    for event in (Started(), Stage("Reading the recordings", 1), Advanced(0, "th1.csv, 40% read")):
        run = run.after(event)
    run = run if run.busy else run.after(Started())
    assert "Reading the recordings 0 of 1: th1.csv, 40% read." in WORDS.state(run, None)
