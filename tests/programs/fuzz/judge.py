"""What a command line may do with whatever it is given."""

from __future__ import annotations

import re
from pathlib import Path

from flexgui import cli
from flexgui.core.errors import InputError
from flexgui.plain_words import BAD_INPUT, print_error
from tests.programs.fuzz.cases import Case

LONGEST = 300
"""Characters of a sentence that somebody still reads to its end."""
UPLOAD = 1_000_000
"""Bytes of an upload; the zips are much smaller."""


def perform(case: Case) -> int:
    """The exit code, in the folder of the case; `unpack` is what the page does with a zip."""
    if case.arguments[:1] != ("unpack",):
        return cli.run(case.arguments)
    from flexgui.stages.data.uploads import unpacked

    try:
        unpacked(Path(case.arguments[1]), Path(), UPLOAD)
    except InputError as error:
        print_error(str(error))
        return BAD_INPUT
    return 0


PROGRESS = re.compile(r"^flexgui: .* \(\d+ s\)\n", re.MULTILINE)
"""What a slow machine prints every ten seconds."""


def fault(code: int, said: str) -> str:
    """What is wrong with an exit code and what stands on stderr; empty where nothing is."""
    said = PROGRESS.sub("", said)
    if code == 0:
        return f"it ran and said {said[:200]!r}" if said else ""
    if code != BAD_INPUT:
        return f"exit code {code}: {said[-600:]}"
    if "Traceback" in said or said.count("\n") != 1 or not said.startswith("flexgui: "):
        return f"not one sentence: {said[-600:]!r}"
    if len(said) > LONGEST + 1 or not said.endswith((".\n", "?\n")):
        return f"no sentence, or too long a one: {said!r}"
    return ""
