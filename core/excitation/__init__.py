"""Excitations: what the references do in an experiment, found by walking this folder."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import InputError
from ..excitation.excitation import Excitation
from ..plugins import classes_of
from ..sentences import did_you_mean
from ..validation import validated


def build_excitation(kind: str, options: Mapping[str, Any]) -> Excitation:
    """The excitation of a simulated recording; InputError where a setting is wrong."""
    kinds = classes_of(__name__, Excitation)
    if kind not in kinds:
        raise InputError(f"simulate.excitation {kind!r} is not known; {did_you_mean(kind, kinds)}")
    return validated(kinds[kind], options, f"simulate.options of {kind}")
