"""The contract of a format in which a model leaves, and what each says about its limits."""

from __future__ import annotations

import re
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Iterable

from core.results import Outcome, PresentEffect
from core.written import format_number
from flexgui import __version__

WIDTH = 92
"""Characters in a line of a header."""

LINEAR_LIMITS = (
    "It is the linear model of small motion about a posture, with the drive's loop closed; the "
    "posture is scheduled.",
    "Without a place in it: sensor noise, the tip camera's own outputs z1 and z2, which are not "
    "linear in the joint angles, and limits of the drives.",
)
"""Of every format that holds the matrices."""


class ModelFormat(ABC):
    """One format; the export writes its files, the page offers them as a download."""

    kind: str = ""
    """Id of the plug-in; the page lists formats in the order of their ids."""
    label: str = ""
    """On the page's button."""
    hint: str = ""

    def unable(self, outcome: Outcome) -> str:
        """A sentence why this outcome cannot be written so; empty where it can."""
        return ""

    @abstractmethod
    def files(self, outcome: Outcome) -> dict[str, bytes]:
        """Path inside the export -> content; several files share one folder."""


def linear_header(outcome: Outcome, what: str) -> list[str]:
    """Lines about a file with the linear model: what it is, what it carries, what it cannot."""
    effects = _effects(outcome)
    carried = [e for e in effects if e.linear and e.acts_on != "sensor"]
    return header(outcome, what, carried, LINEAR_LIMITS)


def header(
    outcome: Outcome, what: str, carried: Iterable[PresentEffect], limits: Iterable[str]
) -> list[str]:
    """Lines of at most WIDTH characters.

    Args:
        outcome: Whose model it is.
        what: A phrase for the file, such as "C code of the linear model".
        carried: Those of the outcome's effects that are in the file.
        limits: Sentences on what the format cannot carry in general.
    """
    inside = tuple(carried)
    outside = [e for e in _effects(outcome) if e not in inside]
    texts = [f"{plain(outcome.title)}: {what}, written by FlexGUI {__version__}. SI units."]
    if inside:
        texts.append(f"Found and in this file: {_listed(inside)}.")
    if outside:
        texts.append(f"Found, and NOT in this file, which has no place for it: {_listed(outside)}.")
    texts += limits
    return [line for text in texts for line in textwrap.wrap(text, WIDTH)]


def _effects(outcome: Outcome) -> tuple[PresentEffect, ...]:
    return () if outcome.mechanism is None else outcome.mechanism.effects


def _listed(effects: Iterable[PresentEffect]) -> str:
    return "; ".join(_effect(e) for e in effects)


def _effect(effect: PresentEffect) -> str:
    sizes = [f"{name} = {format_number(x)} {unit}".strip() for name, x, unit in effect.sizes]
    return plain(f"{effect.title} ({', '.join(sizes)})" if sizes else effect.title)


def plain(text: str) -> str:
    """One line without what ends a comment in C, XML or Python."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return re.sub(r"-{2,}", "-", line).replace("*/", "* /").replace("/*", "/ *").replace("\\", "/")
