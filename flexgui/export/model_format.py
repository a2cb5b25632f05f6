"""The contract of a model format: its limits in words, its matrices over the posture."""

from __future__ import annotations

import ast
import re
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence

from flexgui import __version__
from flexgui.core.results import Outcome, PresentEffect
from flexgui.sentences.written import format_number

HEADER_WIDTH = 92
"""Characters in a line of a header."""

OUTSIDE = "NOT in this file, because its format cannot hold it"
"""Said of effects."""

LINEAR_LIMITS = (
    "Linear model of small motion about a posture, with the drive's loop closed. The posture is "
    "scheduled.",
    "Not in this file: sensor noise, limits of the drives, and the camera outputs z1 and z2 (not "
    "linear in the joint angles).",
)
"""Of every format that holds the matrices."""

WHOLE_LIMITS = (
    "The full equations of motion with the drive's loop closed. All estimated values are in it, "
    "those of the linear model where that was identified.",
    "Not in this file: noise, delays and filters of sensors, and the outputs y and ydot, which "
    "follow from z1 and z2.",
)
"""Of every format that holds the state equations."""


class ModelFormat(ABC):
    """One format; exports write its files, the page offers them as a download."""

    kind: str = ""
    """Id of the plug-in; the page lists formats in the order of their ids."""
    label: str = ""
    """On the page's button."""
    hint: str = ""

    def unable(self, outcome: Outcome) -> str:
        """Why this outcome cannot be written in this format; empty if it can."""
        return ""

    @abstractmethod
    def files(self, outcome: Outcome) -> dict[str, bytes]:
        """Path inside the export -> content."""


def linear_header(outcome: Outcome, what: str) -> list[str]:
    """Lines about a file with the linear model: what it is, what it carries, what it cannot."""
    effects = _effects(outcome)
    carried = [e for e in effects if e.linear and e.acts_on != "sensor"]
    return header(outcome, what, carried, LINEAR_LIMITS)


def whole_header(outcome: Outcome, what: str) -> list[str]:
    """The same about a file with the state equations."""
    carried = [e for e in _effects(outcome) if e.acts_on != "sensor"]
    return header(outcome, what, carried, WHOLE_LIMITS)


def no_equations(outcome: Outcome) -> str:
    """Why there are no state equations; empty where there are some."""
    if outcome.state_equations is not None:
        return ""
    return (
        "This result has no full equations with a drive: joints follow their recorded positions, "
        "or an earlier version made it. State the rig's control loop in [drive], and identify "
        "again."
    )


def header(
    outcome: Outcome, what: str, carried: Iterable[PresentEffect], limits: Iterable[str]
) -> list[str]:
    """Lines of at most HEADER_WIDTH characters.

    Args:
        outcome: Whose model it is.
        what: A phrase for the file, such as "C code of the linear model".
        carried: Those of the outcome's effects that are in the file. The lines state which were
            found and which the scenario states.
        limits: Sentences on what the format cannot carry in general.
    """
    inside, effects = tuple(carried), _effects(outcome)
    found = () if outcome.diagnosis is None else outcome.diagnosis.kept
    texts = [f"{plain(outcome.title)}: {what}, written by FlexGUI {__version__}. SI units."]
    for held, place in ((True, " and in this file"), (False, f", but {OUTSIDE}")):
        some = [e for e in effects if (e in inside) == held]
        for origin, new in (("Found", True), ("Stated", False)):
            these = [e for e in some if (e.kind in found) == new]
            texts += [f"{origin}{place}: {_listed(these)}."] if these else []
    texts += limits
    return [line for text in texts for line in textwrap.wrap(text, HEADER_WIDTH)]


def _effects(outcome: Outcome) -> tuple[PresentEffect, ...]:
    return () if outcome.mechanism is None else outcome.mechanism.effects


def _listed(effects: Iterable[PresentEffect]) -> str:
    return "; ".join(_effect(e) for e in effects)


def _effect(effect: PresentEffect) -> str:
    sizes = [f"{name} = {format_number(x)} {unit}".strip() for name, x, unit in effect.sizes]
    return plain(f"{effect.title} ({', '.join(sizes)})" if sizes else effect.title)


def plain(text: str) -> str:
    """One line without sequences that end a comment in C, XML or Python."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return re.sub(r"-{2,}", "-", line).replace("*/", "* /").replace("/*", "/ *").replace("\\", "/")


FUNCTIONS = frozenset({"cos", "sin"})
"""Of the posture, in the matrices."""


def scheduled(bases: Sequence[str]) -> tuple[str, ...]:
    """Names of the joint positions that the matrices depend on, such as theta2."""
    indices = {
        node.id
        for text in bases
        for node in ast.walk(ast.parse(text, mode="eval"))
        if isinstance(node, ast.Name) and node.id not in FUNCTIONS
    }
    return tuple(sorted(indices))
