"""What the command line says where something is wrong: one sentence, an exit code, no traceback."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import typer

BAD_INPUT = 2
INTERRUPTED = 130
"""What a shell expects after Ctrl-C: 128 + SIGINT."""
VARIABLE = "FLEXGUI_TRACEBACK"
"""Set by whoever looks for a fault of the program: errors of numbers then show where they arose."""


@contextmanager
def plain_words() -> Iterator[None]:
    """Errors of input, memory, disk and numbers end in one sentence and 2, Ctrl-C in 130.

    Warnings of libraries are for programmers; what a person has to know is in the report.
    """
    from core.errors import InputError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except KeyboardInterrupt:
        typer.echo("flexgui: stopped; nothing was overwritten.", err=True)
        raise typer.Exit(INTERRUPTED) from None
    except InputError as error:
        _end(str(error))
    except (OSError, MemoryError, ArithmeticError, ValueError, RecursionError) as error:
        if os.environ.get(VARIABLE):
            raise
        _end(sentence_of(error))


def sentence_of(error: Exception) -> str:
    """For errors that no part of the program has put into words."""
    if isinstance(error, OSError):
        place = error.filename if isinstance(error.filename, str) else "A file"
        reason = (error.strerror or type(error).__name__).lower()
        return f"{place} cannot be read or written: {reason}; choose another place."
    if isinstance(error, MemoryError):
        return "There is not enough memory for this; cut the recordings or simulate fewer samples."
    text = str(error).rstrip(".") or "no number"
    return (
        f"The numbers of this scenario lead outside what can be computed ({text}); look for one "
        f"that is far too large or too small."
    )


def print_error(text: str) -> None:
    """One line on stderr."""
    from core.sentences import brief

    typer.echo(brief(f"flexgui: {text}"), err=True)


def _end(text: str) -> None:
    print_error(text)
    raise typer.Exit(BAD_INPUT) from None
