"""Wrong input that stands in an approved file, each with the sentence that is said of it."""

from __future__ import annotations

from collections.abc import Callable

from tests.approved import FOLDER, approved


def sentences_for(name: str, said: Callable[[str], str]) -> None:
    """Compare what is said of each entry of `tests/approved/<name>` with the line below it.

    Args:
        name: Entries at the beginning of a line, where a newline is written as a backslash and n;
            headings begin with #. A new entry needs no sentence: it is written with APPROVE=1.
        said: The sentence for an entry.
    """
    lines = (FOLDER / name).read_text(encoding="utf-8").splitlines()
    text = []
    for line in lines:
        if not line.startswith("    "):
            text.append(line)
            if line and not line.startswith("#"):
                text.append("    " + said(line.replace("\\n", "\n")))
    approved(name, "\n".join(text) + "\n")


def changed(text: str, entry: str) -> str:
    """The text with the first place that reads like the left side of 'old -> new' changed."""
    old, _, new = entry.partition(" -> ")
    assert old in text, old
    return text.replace(old, new, 1)
