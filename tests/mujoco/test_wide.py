"""The wide cases: what is hidden acts as its formula says, and nothing hidden is nothing."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="needs MuJoCo: pip install '.[test]'")

from flexgui.core.effects import catalogue  # noqa: E402
from tests.programs.mujoco.files import CAMERA_NOISE  # noqa: E402
from tests.programs.mujoco.wide_arms import ARMS, STEP, references  # noqa: E402
from tests.programs.mujoco.wide_cases import CASES, SIZES, Case  # noqa: E402
from tests.programs.mujoco.wide_effects import EFFECTS  # noqa: E402
from tests.programs.mujoco.wide_rig import Rig  # noqa: E402
from tests.programs.mujoco.wide_run import Motion, World, run  # noqa: E402

pytestmark = pytest.mark.long

REFERENCE = Path(__file__).resolve().parents[2] / "docs" / "scenario.md"
SHORT = 100
"""Samples: 0.2 s, longer than a reference is held."""
FEW = 5
"""Samples, in which a step that is too coarse has long shown."""
SETTLED = 0.01
"""Relative: how near a quantity at rest is to its formula after the loop has come to rest."""


def moved(case: Case, step: float = STEP) -> Motion:
    arm, rig, _ = case.made()
    return run(rig, arm.postures[0], references(arm, 0)[:SHORT], step)


def single(effect: str, size: float) -> Case:
    return Case("one" if effect != "encoder_offset" else "paper", ((effect, size),))


def test_what_is_hidden_has_an_id_of_the_catalogue() -> None:
    assert set(EFFECTS) == set(SIZES)
    assert set(EFFECTS) <= set(catalogue())


@pytest.mark.parametrize("case", CASES.values(), ids=lambda case: case.name)
def test_every_case_can_be_recorded(case: Case) -> None:
    arm, rig, _ = case.made()
    motion = run(rig, arm.postures[0], references(arm, 0)[:FEW], STEP)
    assert np.abs(motion.tip).max() < 1.5 * arm.reach


def published(effect: str) -> set[str]:
    """Names of its parameters on a two-link arm, from the reference."""
    section = REFERENCE.read_text(encoding="utf-8").split(f"### `{effect}`")[1].split("###")[0]
    return set(re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE))


@pytest.mark.parametrize("effect", sorted(EFFECTS))
def test_the_truth_bears_the_published_names(effect: str) -> None:
    _, _, truth = Case("paper", ((effect, SIZES[effect][1]),)).made()
    below = published("coulomb_friction") if effect == "stribeck_friction" else set()
    assert set(truth[effect]) <= published(effect) | below


@pytest.mark.parametrize("effect", sorted(EFFECTS))
def test_an_effect_moves_what_is_measured(effect: str) -> None:
    case = single(effect, SIZES[effect][2])
    bare, with_it = moved(Case(case.arm)), moved(case)
    change = np.hstack([with_it.angles - bare.angles, with_it.tip - bare.tip])
    assert np.abs(change).max() > CAMERA_NOISE


SEEN = 0.1 * CAMERA_NOISE
"""m: what halving the engine's step may move the tip; a tenth of what the camera could see."""

HARD = ("backlash", "drive_lag")

SEEN_HARD = CAMERA_NOISE
"""m, where a force has an edge, whose moment the engine finds within a step, and where the loop is
computed between two steps, which delays it by one."""


@pytest.mark.parametrize("effect", ["cubic_stiffness", "base_compliance", "drive_lag", "backlash"])
def test_half_the_step_moves_the_tip_by_nothing_that_is_seen(effect: str) -> None:
    case = single(effect, SIZES[effect][1])
    change = moved(case).tip - moved(case, STEP / 2).tip
    assert np.abs(change).max() < (SEEN_HARD if effect in HARD else SEEN)


def test_a_soft_base_gives_way_by_compliance_times_force() -> None:
    compliance, pull = 1e-5, 50.0
    arm = ARMS["one"]
    plant = replace(arm.plant, gravity=(pull / arm.beams[0].mass, 0.0))
    world = World(Rig(plant, base_compliance=compliance), STEP)
    world.model.dof_damping[:] = 200.0  # comes to rest soon
    for _ in range(200):
        world.sample(np.zeros(1))
    assert world.data.qpos[0] == pytest.approx(compliance * pull, rel=SETTLED)


def test_a_lag_delays_the_torque_by_its_time_constant() -> None:
    world = World(Rig(ARMS["one"].plant, lag=0.01), STEP)
    asked, steps = np.array([1.0]), round(0.01 / STEP)
    for _ in range(steps):
        world.force = world._lagged(asked)
    assert world.force[0] == pytest.approx(1.0 - np.exp(-1.0), rel=1e-9)
