import io

import numpy as np
from rich.console import Console

from core.progress import Progress, Silent
from core.results import Generation
from flexgui.progress import TerminalProgress

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


def test_the_terminal_shows_stages_and_generations() -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=100)
    with TerminalProgress(console) as progress:
        work(progress)
    text = screen.getvalue()
    assert "Fitting" in text
    assert "Writing" in text
