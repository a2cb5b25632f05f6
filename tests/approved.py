"""Texts that somebody has read and found right, one file each in tests/approved.

`APPROVE=1 pytest ...` writes them anew; what has changed is then seen in the next commit.
"""

from __future__ import annotations

import os
from difflib import unified_diff
from pathlib import Path

FOLDER = Path(__file__).parent / "approved"
HINT = "where the new text is right, run the test once with APPROVE=1"


def approved(name: str, text: str) -> None:
    """Compares a text with the approved one of that name."""
    path, text = FOLDER / name, text.rstrip("\n") + "\n"
    if os.environ.get("APPROVE"):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    assert path.is_file(), f"tests/approved/{name} is missing; {HINT}"
    known = path.read_text(encoding="utf-8")
    names = f"approved/{name}", "as it is now"
    difference = unified_diff(known.splitlines(True), text.splitlines(True), *names)
    assert known == text, f"{HINT}:\n{''.join(difference)}"
