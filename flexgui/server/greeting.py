"""What `flexgui serve` says in the terminal."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable
from urllib.parse import quote

from flexgui.server.access import CODE, TEACHER
from flexgui.server.entry import Word


def qr_text(address: str) -> str:
    """A QR code of half blocks, light on dark, for a terminal that can show them."""
    import segno

    out = io.StringIO()
    segno.make(address, error="m", micro=False).terminal(out, compact=True, border=2)
    return out.getvalue().rstrip("\n")


Say = Callable[[str], None]


def teacher_address(home: str, join: Word | None, teacher: Word | None) -> str:
    """What the own browser opens."""
    if teacher is not None:
        return f"{home}?{TEACHER}={quote(teacher.word)}"
    return home if join is None else f"{home}?{CODE}={quote(join.word)}"


def greet_alone(home: str, say: Say) -> None:
    """The page stays on this machine."""
    say(f"FlexGUI: {home}   (Ctrl-C ends it)")


def greet_class(
    home: str, more: tuple[str, ...], origins: tuple[str, ...], words: tuple[Word, Word | None],
    say: Say,
) -> None:  # fmt: skip
    """What is open, to whom, and how to come in."""
    join, teacher = words
    for_class = f"{more[0]}/?{CODE}={quote(join.word)}" if more else ""
    if for_class:
        say(f"FlexGUI for the class: {for_class}   (Ctrl-C ends it)")
        if sys.stdout.isatty():
            say(qr_text(for_class))
    else:
        say("No network was found: the page can be reached from this machine only.")
    say(f"Join code: {join.word}")
    say("Open: to everybody in this network who has the code, without encryption (http).")
    say("Pages that may connect: " + ", ".join(origins))
    say(f"Your own: {teacher_address(home, join, teacher)}")
