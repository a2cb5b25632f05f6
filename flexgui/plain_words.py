"""What the command line says where something is wrong: one sentence, an exit code, no traceback."""

from __future__ import annotations

import errno
import tempfile
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import typer

BAD_INPUT = 2
INTERNAL = 1
INTERRUPTED = 130
"""What a shell expects after Ctrl-C: 128 + SIGINT."""


@contextmanager
def plain_words(raw: bool = False) -> Iterator[None]:
    """Bad input ends in one sentence and 2, all else that fails in 1, Ctrl-C in 130.

    Only `InputError`, and a place that the system refuses, is the user's: anything else is the
    program's, and its traceback goes into a file or, where it is wanted `raw`, onto the terminal.
    Warnings of libraries are for programmers; what a person has to know is in the report.
    """
    from flexgui.core.errors import InputError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except KeyboardInterrupt:
        typer.echo("flexgui: stopped; nothing was overwritten.", err=True)
        raise typer.Exit(INTERRUPTED) from None
    except (typer.Exit, typer.Abort, typer.TyperException):
        raise
    except InputError as error:
        print_error(str(error))
        raise typer.Exit(BAD_INPUT) from None
    except Exception as error:
        if place := _refused_place(error):
            print_error(place)
            raise typer.Exit(BAD_INPUT) from None
        if raw:
            raise
        print_error(f"{_internal(error)}{_saved_traceback(error)}")
        raise typer.Exit(INTERNAL) from None


def _refused_place(error: Exception) -> str:
    """For a file that exists or was named by the user; empty: it is another error. A file that is
    missing was asked for by the program: those of the user are looked for before."""
    if not isinstance(error, OSError) or isinstance(error, FileNotFoundError):
        return ""
    if not isinstance(error.filename, str) and error.errno != errno.ENOSPC:
        return ""
    place = error.filename or "A file"
    reason = (error.strerror or type(error).__name__).lower()
    return f"{place} cannot be read or written: {reason}; choose another place."


def _internal(error: Exception) -> str:
    """For errors that no part of the program has put into words."""
    if isinstance(error, MemoryError):
        return "There is not enough memory. Cut the recordings, or simulate fewer samples."
    text = " ".join(f"{type(error).__name__}: {error}".split()).rstrip(".: ")
    return f"Internal error in FlexGUI, not in your input ({text})."


def _saved_traceback(error: Exception) -> str:
    """Where the traceback was written; empty where nothing can be written."""
    with suppress(OSError):
        with tempfile.NamedTemporaryFile(
            "w", prefix="flexgui-", suffix=".txt", delete=False, encoding="utf-8"
        ) as file:
            file.writelines(traceback.format_exception(error))
        return f" The traceback is in {file.name}."
    return ""


def print_error(text: str) -> None:
    """One line on stderr."""
    from flexgui.core.sentences import brief

    typer.echo(brief(f"flexgui: {text}"), err=True)
