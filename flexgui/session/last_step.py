"""How the error changed in the last step of a person's way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from core.written import format_number
from flexgui.session.look import Look, ladder_steps

FELL = 0.99
"""Share of the error: what falls by less is not seen in its two figures."""


class Change(NamedTuple):
    """rms over all outputs, in floors of the first look, as the ladder shows it."""

    before: float
    after: float

    @property
    def fell(self) -> bool:
        """Whether the error fell by a noticeable share."""
        return self.after < FELL * self.before

    @property
    def rose(self) -> bool:
        """Whether the error rose by a noticeable share."""
        return self.before < FELL * self.after

    @property
    def words(self) -> str:
        """`from 9.7 to 0.99 times the noise floor`"""
        return f"from {_figure(self.before)} to {_figure(self.after)} times the noise floor"


def last_change(looks: Sequence[Look]) -> Change | None:
    """From the last but one to the last; None before there are two."""
    steps = ladder_steps(looks)
    if len(steps) < 2:
        return None
    before, after = (float(step.cost_per_sample**0.5) for step in steps[-2:])
    return Change(before, after)


def in_vain(looks: Sequence[Look]) -> bool:
    """Whether the last step added something and the error did not fall."""
    change = last_change(looks)
    return bool(looks[-1:] and looks[-1].added) and change is not None and not change.fell


def worse(looks: Sequence[Look]) -> bool:
    """Whether the last step added something and the error rose: that is more than needless."""
    change = last_change(looks)
    return bool(looks[-1:] and looks[-1].added) and change is not None and change.rose


def _figure(value: float) -> str:
    return format_number(value, 2, keep_zeros=True)
