import io

import numpy as np
import pytest
from rich.console import Console

from flexgui.core.progress import Progress, Silent
from flexgui.core.results import Generation
from flexgui.progress import PlainProgress, TerminalProgress

GENERATION = Generation(3, 1.25, 2.0, 3.0, np.zeros(2))


def work(progress: Progress) -> bool:
    progress.stage("Fitting", total=2)
    progress.advance(text="th1")
    progress.generation("glocal", GENERATION)
    progress.stage("Writing")
    progress.advance()
    return progress.stopped()


def test_silence_is_a_progress() -> None:
    assert work(Silent()) is False


def test_elsewhere_a_plain_line_says_what_is_done(capsys: pytest.CaptureFixture[str]) -> None:
    said = ""
    with PlainProgress(every=0.001) as progress:
        progress.stage("Fitting", total=2)
        progress.advance()
        while "Fitting, 1 of 2 (0 s)\n" not in said:
            said += capsys.readouterr().err
    assert all(line.startswith("flexgui: ") for line in said.splitlines())


def test_what_has_no_stage_leaves_the_terminal_as_it_was() -> None:
    screen = io.StringIO()
    with TerminalProgress(Console(file=screen, force_terminal=True)):
        pass
    assert screen.getvalue() == ""


def test_the_terminal_shows_stages_and_generations() -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=100)
    with TerminalProgress(console) as progress:
        work(progress)
    text = screen.getvalue()
    assert "Fitting" in text
    assert "Writing" in text
