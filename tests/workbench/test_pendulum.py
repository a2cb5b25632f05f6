"""A torque rig of another simulator: a rigid double pendulum with Stribeck friction."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import flexgui as fg
from tests.programs.double_pendulum import DoublePendulum

PENDULUM = DoublePendulum()
STEP, SECONDS, RUNS = 1e-3, 3.0, 2
ENCODER, TORQUE = 1e-5, 0.02
"""rad, N m, rms"""
SURE = 3.0
"""Deviations of a right answer."""

TRUE = {
    f"{name}{k + 1}": float(pair[k])
    for name, pair in (
        ("m", PENDULUM.masses),
        ("fv", PENDULUM.viscous),
        ("fc", PENDULUM.coulomb),
        ("fb", PENDULUM.bulge),
        ("vs", PENDULUM.stribeck_speed),
    )
    for k in range(2)
}


def recording(seed: int) -> pd.DataFrame:
    """Both joints follow smooth references from rest."""
    rng, time = np.random.default_rng(seed), STEP * np.arange(int(SECONDS / STEP))
    places = np.empty((len(time), 2))
    for k in range(2):
        hz, sizes = rng.uniform(0.2, 1.5, 4), rng.uniform(0.05, 0.3, 4)
        signs = np.sign(rng.standard_normal(4))
        places[:, k] = 0.5 * (1.0 - np.cos(2.0 * np.pi * time[:, None] * hz)) @ (sizes * signs)
    q, u = PENDULUM.recorded(places + [0.0, 0.8], STEP)
    q, u = q + ENCODER * rng.standard_normal(q.shape), u + TORQUE * rng.standard_normal(u.shape)
    columns = {f"u{k + 1}": u[:, k] for k in range(2)}
    columns |= {f"theta{k + 1}": q[:, k] for k in range(2)}
    return pd.DataFrame({"t": time, **columns})


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 100, 200, 300])
def test_masses_and_all_of_its_friction_are_those_of_the_pendulum(seed: int) -> None:
    pairs = zip(PENDULUM.lengths, (3.6, 1.6), strict=True)
    segments = [{"length": length, "mass": mass, "modes": 0} for length, mass in pairs]
    sizes = {f"{n}{k}": x for n, x in (("fc", 0.5), ("fb", 0.3), ("vs", 0.1)) for k in (1, 2)}
    rig = fg.project(
        {"segments": segments}, "torque", [recording(seed + i) for i in range(RUNS)],
        identify={"parameters": list(TRUE)},
        model={
            "effects": [
                {"id": "viscous_friction", "fv1": 0.2, "fv2": 0.2},
                {"id": "stribeck_friction", **sizes},
            ]
        },
    )  # fmt: skip
    found = rig.identify()
    off = {n: (found[n].value - true) / found[n].std for n, true in TRUE.items()}
    assert max(map(abs, off.values())) < SURE, off
