"""A round says beforehand what will be slow."""

from __future__ import annotations

from pathlib import Path

import pytest

from core.arm.compiled import compile_arm
from core.arm.symbols import Structure
from core.diagnose.announce import round_title
from core.diagnose.columns import Trial
from core.effects import effect
from tests.helpers import PAPER


def planned(*kinds: str, **values: float) -> list[Trial]:
    return [Trial(effect(kind), "", values, {}, False, False, ()) for kind in kinds]


def test_only_effects_that_change_the_arm_are_said_to_be_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FLEXGUI_CACHE", str(tmp_path))
    title = round_title(
        1, PAPER, planned("coulomb_friction", "extra_bending_mode", "base_compliance")
    )
    assert "compiled for the first time" in title
    assert "Extra bending mode and Soft base" in title
    assert "Coulomb" not in title


def test_what_is_compiled_already_is_not_announced() -> None:
    twisted = {"c1": 1e-5, "c2": 0.0, "Jh1": 0.05, "Jh2": 0.0}
    tried = planned("joint_elasticity", **twisted)
    compile_arm(Structure.of(tried[0].effect.changed_arm(PAPER, twisted)))
    assert round_title(2, PAPER, tried) == "Looking for what is missing, round 2"
