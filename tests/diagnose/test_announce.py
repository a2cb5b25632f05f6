"""A round says beforehand what will be slow."""

from __future__ import annotations

from pathlib import Path

import pytest

from core.arm.compiled import compile_arm
from core.arm.symbols import Structure
from core.diagnose.announce import round_title
from core.effects import effect
from tests.helpers import PAPER

CANDIDATES = [
    effect(kind) for kind in ("coulomb_friction", "extra_bending_mode", "base_compliance")
]


def test_only_effects_that_change_the_arm_are_said_to_be_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FLEXGUI_CACHE", str(tmp_path))
    title = round_title(1, PAPER, CANDIDATES)
    assert "compiled for the first time" in title
    assert "Extra bending mode and Soft base" in title
    assert "Coulomb" not in title


def test_what_is_compiled_already_is_not_announced() -> None:
    compile_arm(Structure.of(CANDIDATES[1].changed_arm(PAPER, {})))
    assert round_title(2, PAPER, CANDIDATES[:2]) == "Looking for what is missing, round 2"
