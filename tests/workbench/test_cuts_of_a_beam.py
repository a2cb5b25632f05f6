"""Cuts of a log of an independent beam, from a scenario that states nothing of them."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import flexgui as fg
from tests.programs.finite_element_beam import Beam

BEAM = Beam(damping_time=1e-4)
STEP, SECONDS = 2e-3, 1.5
ENCODER, GAUGE = 1e-5, 1e-5
"""rad, rms"""
WITHIN = 0.01
"""Of the true stiffness; three polynomial shapes cost a fifth of that."""
MISLEADING = 0
"""A cut whose stiffness was off by 40 % while the arm was taken to rest."""


def cut(seed: int) -> pd.DataFrame:
    """A part of a log under a smooth torque, from anywhere."""
    rng = np.random.default_rng(seed)
    first = int(rng.uniform(0.2, 2.0) / STEP)
    time = STEP * np.arange(first + int(SECONDS / STEP))
    waves = np.sin(2.0 * np.pi * rng.uniform(0.5, 8.0, 6) * time[:, None] + rng.uniform(0, 6.3, 6))
    torque = 0.35 * waves.sum(axis=1)
    theta, deflection = BEAM.motion(torque, STEP)
    noise = rng.standard_normal((2, len(time)))
    table = {
        "t": time, "u1": torque, "theta1": theta + ENCODER * noise[0],
        "deflection1": deflection / BEAM.length + GAUGE * noise[1],
    }  # fmt: skip
    part = pd.DataFrame(table)[first:].reset_index(drop=True)
    part["t"] -= part["t"][0]
    return part


def off(seed: int) -> float:
    """By what share the identified stiffness of one cut is wrong, from a start a quarter off."""
    segment = {
        "length": BEAM.length, "mass": BEAM.mass, "EI": 1.25 * BEAM.EI,
        "hub_inertia": BEAM.hub_inertia, "modes": 3,
    }  # fmt: skip
    rig = fg.project(
        {"segments": [segment]}, "torque", [cut(seed)], identify={"parameters": ["EI1"]}
    )
    return abs(rig.identify()["EI1"].value / BEAM.EI - 1.0)


@pytest.mark.long
def test_a_cut_in_motion_gives_the_stiffness() -> None:
    assert off(MISLEADING) < WITHIN


@pytest.mark.long
def test_sixty_cuts_in_motion_give_the_stiffness() -> None:
    wrong = {seed: share for seed in range(60) if not (share := off(seed)) < WITHIN}
    assert wrong == {}
