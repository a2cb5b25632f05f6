"""What is left of a slightly different friction is no further effect."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexgui.core.results import Diagnosis
from flexgui.core.scenario.read import read_scenario
from flexgui.sentences.verdict import verdict_paragraphs
from tests.diagnose.fits import diagnosis_of
from tests.programs.mujoco.soft_friction import written

SIZED = 0.02
"""Relative, of the levels."""

SEEDS, RIGHT = 20, 19


def diagnosed(seed: int, folder: Path) -> tuple[Diagnosis, float]:
    """What is found, and by how much the worst level is off."""
    path, levels = written(seed, folder)
    found = diagnosis_of(read_scenario(path), folder=folder)
    sizes = {e.name: e.value for e in found.parameters}
    return found, max(abs(sizes.get(name, 0.0) / x - 1.0) for name, x in levels.items())


@pytest.mark.long
def test_what_a_friction_that_yields_leaves_over_is_named_as_that(tmp_path: Path) -> None:
    found, off = diagnosed(3, tmp_path)
    assert [s.added for s in found.steps] == [None, "coulomb_friction"]
    assert off < SIZED
    assert found.final_verdict == "nothing_missing"
    assert found.steps[-1].cost_per_sample > 1.0
    assert any("idealised" in text for text in verdict_paragraphs(found))


@pytest.mark.long
def test_nothing_is_added_to_frictions_that_yield(tmp_path: Path) -> None:
    right = 0
    for seed in range(SEEDS):
        folder = tmp_path / str(seed)
        folder.mkdir()
        found, off = diagnosed(seed, folder)
        alone = [s.added for s in found.steps] == [None, "coulomb_friction"]
        right += alone and off < SIZED
    assert right >= RIGHT
