"""`help(fg.Segment)` shows what a person states, with units, and nothing of the machinery."""

from __future__ import annotations

import inspect
import pydoc
import re

import pytest

import flexgui as fg
from flexgui.core.drives.drive import drive_classes
from flexgui.core.field_texts import HEAD
from flexgui.core.recording.recording import CameraPose

PUBLIC = [getattr(fg, name) for name in dir(fg)]
KINDS = [kind for kind in PUBLIC if isinstance(kind, type) and ".core." in kind.__module__]
STATED = [fg.Arm, fg.Segment, fg.Excitation, *drive_classes().values()]


@pytest.mark.parametrize("kind", STATED, ids=lambda kind: kind.__name__)
def test_help_of_a_part_of_a_rig_is_about_the_rig(kind: type) -> None:
    text = pydoc.render_doc(kind, renderer=pydoc.plaintext)
    assert not re.search("pydantic(?!.main.BaseModel$)|model_|Annotated|schema", text, re.MULTILINE)
    above = text.partition("Method resolution order")[0]
    assert (HEAD in above) == bool(inspect.signature(kind).parameters)


@pytest.mark.parametrize("kind", [*STATED, *KINDS, CameraPose], ids=lambda kind: kind.__name__)
def test_help_has_words_for_every_field(kind: type) -> None:
    own, _, fields = (inspect.getdoc(kind) or "").partition(HEAD)
    for field in re.findall(r"^ {4}(\w.*)$", fields, re.MULTILINE):
        name = field.split()[0]
        assert re.match(r"\w+( \(empty by default\)| = .+?)?: ", field) or f"{name} " in own, field


def test_the_settings_of_a_segment_have_units_and_defaults() -> None:
    text = inspect.getdoc(fg.Segment) or ""
    assert "\n    mass: kg\n" in text
    assert "\n    tip_mass = 0.0: kg, at the end of the segment.\n" in text
    assert list(inspect.signature(fg.Segment).parameters)[:2] == ["length", "mass"]
