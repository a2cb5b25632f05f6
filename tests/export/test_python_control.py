"""The exported script, run in a process of its own, against python-control on our own model."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.effects import effect
from flexgui.core.results import Diagnosis
from flexgui.core.simulate.posture import posture
from flexgui.export.formats.python_control import ControlScript, script
from tests.export.helpers import MODELS, outcome_of
from tests.helpers import ARMS, looped
from tests.marks import long_except

pytest.importorskip("control", reason="python-control is not installed: pip install control")

SAME = 1e-9
"""Relative: poles of two solves with E."""

ASK = """
import json, runpy
found = runpy.run_path("model_control.py")["system"]({arguments})
print(json.dumps([found.input_labels, found.output_labels,
                  found.poles().real.tolist(), found.poles().imag.tolist()]))
"""


def answered(folder: Path, *order: str) -> str:
    return subprocess.run(
        [sys.executable, "-W", "error::SyntaxWarning", *order], cwd=folder, check=True,
        capture_output=True, text=True,
    ).stdout  # fmt: skip


@pytest.fixture
def folder(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    for name, content in ControlScript().files(outcome_of(MODELS[request.param])).items():
        (tmp_path / name).write_bytes(content)
    return tmp_path


@pytest.mark.parametrize(
    "folder", long_except(("torque",), ("loop 2-2", "loop ground", "torque")), indirect=True
)
def test_it_runs_and_prints_its_poles(folder: Path) -> None:
    assert "Hz, damping" in answered(folder, "model_control.py")


@pytest.mark.parametrize("folder", ["loop 2-2"], indirect=True)
def test_its_poles_are_the_models_at_any_posture(folder: Path) -> None:
    model = MODELS["loop 2-2"]
    text = ASK.format(arguments="theta2=0.4")
    inputs, outputs, real, imag = json.loads(answered(folder, "-c", text))
    expected = outcome_of(model).model
    assert (tuple(inputs), tuple(outputs)) == (expected.inputs, expected.outputs)
    ours = posture(model, np.array([0.0, 0.4])).poles
    theirs = np.array(real) + 1j * np.array(imag)
    assert len(theirs) == len(ours)
    assert np.abs(ours[:, None] - theirs).min(axis=1).max() < SAME * np.abs(ours).max()


def test_what_was_found_and_what_was_stated_is_listed_inside_or_outside() -> None:
    model = looped(ARMS["2-2"]).with_effects(
        [effect(k) for k in ("tip_payload", "coulomb_friction", "camera_delay", "drive_lag")],
        {"mt2": 0.4, "fc1": 0.5, "fc2": 0.2, "td": 0.004, "tl": 0.002},
    )
    kept = ("tip_payload", "camera_delay")
    diagnosis = Diagnosis("missing", "nothing_missing", (), (), {}, kept=kept)
    outcome = replace(outcome_of(model), diagnosis=diagnosis)
    said = " ".join(script(outcome).split('"""')[1].split())
    places = ("Found and in", "Stated and in", "Found, but NOT in", "Stated, but NOT in")
    sizes = ("mt2 = 0.4 kg", "tl = 0.002 s", "td = 0.004 s", "fc1 = 0.5 N m")
    parts = re.split(f"(?:{'|'.join(places)}) this file", said)[1:]
    for part, own in zip(parts, sizes, strict=True):
        assert [size for size in sizes if size in part] == [own]


def test_a_title_cannot_leave_its_text() -> None:
    outcome = outcome_of(MODELS["torque"], title='evil """ import os \\')
    compile(script(outcome), "model_control.py", "exec")
    assert script(outcome).count('"""') == 4, "of the script and of its function"
