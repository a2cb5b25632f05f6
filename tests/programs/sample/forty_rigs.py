"""Forty rigs whose torque is recorded, drawn at random: arms, rates, encoders and sizes.

Every fifth hides nothing, viscous or Coulomb friction, a payload, or soft joints. Rigs 0 to 29 are
rigid, 30 to 34 bend in one link and 35 to 39 in two. No filter is stated.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from tests.programs.sample.cases import Case
from tests.programs.sample.torque_rigs import SWINGS, TorqueRig, written

RIGS = 40
HIDDEN = ("", "viscous_friction", "coulomb_friction", "tip_payload", "joint_elasticity")
ARMS = (
    TorqueRig((3.0,), (0.6,)),
    TorqueRig((4.0, 2.5), (0.5, 0.4)),
    TorqueRig((5.0, 3.0, 1.5), (0.45, 0.4, 0.3)),
    TorqueRig((6.0,), (0.8,), hub_inertia=0.3),
    TorqueRig((3.0, 2.0), (0.4, 0.4), hub_inertia=0.1),
    TorqueRig((6.0, 3.0, 2.0), (0.5, 0.4, 0.3), hub_inertia=0.05),
    TorqueRig((4.0,), (0.8,), stiffness=(800.0,), hub_inertia=0.1, modes=3, hinges=20),
    TorqueRig(
        (5.0, 3.0), (0.5, 0.5), stiffness=(2000.0, 1200.0), hub_inertia=0.1, modes=3, hinges=20
    ),
)
"""Those that bend stay within about a hundredth of their lengths. Further, a real beam stiffens
(its energy has a term 1/2 EI (w' w'')^2), which is rightly called cubic stiffness."""
REACH = 0.5
"""rad, of the motions."""


def drawn(seed: int) -> tuple[TorqueRig, str, dict[str, float]]:
    """A rig, what it hides, and the truth by name."""
    kind, rng = HIDDEN[seed % len(HIDDEN)], np.random.default_rng([77, seed])
    rig = ARMS[seed // len(HIDDEN)]
    if kind == "tip_payload" and rig.joints == 1 and not rig.stiffness:
        kind = "viscous_friction"  # one rigid link has one inertia, whatever is at its tip
    bits = int(rng.integers(12, 21))
    rate = float(rng.choice([200.0, 500.0, 1000.0, 2000.0]))
    if rig.stiffness:  # a slow loop over light hubs before bending links is unstable
        rate = max(rate, 500.0 * rig.joints)
    rig = replace(rig, bits=bits, rate=rate, counts=0.3 if bits < 16 else 1.0, seconds=4.0)
    middle = np.array([0.0, 1.1, -0.6][: rig.joints])
    inertia = np.diag(rig.inertia(middle)) + rig.hub_inertia
    fastest = 2.0 * np.pi * SWINGS[2]
    torque = inertia * REACH * fastest**2 / 2.0
    share = rng.uniform(0.05, 0.2, rig.joints)
    letter = "EI" if rig.stiffness else "m"
    truth = {f"{letter}{k + 1}": x for k, x in enumerate(rig.stiffness or rig.masses)}
    if kind == "viscous_friction":
        rig = replace(rig, viscous=_values(share * torque / (REACH * fastest)))
        truth |= {f"fv{k + 1}": x for k, x in enumerate(rig.viscous)}
    if kind == "coulomb_friction":
        rig = replace(rig, coulomb=_values(share * torque))
        truth |= {f"fc{k + 1}": x for k, x in enumerate(rig.coulomb)}
    if kind == "tip_payload":
        rig = replace(rig, payload=float(round(rng.uniform(0.08, 0.25) * rig.masses[-1], 4)))
        truth[f"mt{rig.joints}"] = rig.payload
    if kind == "joint_elasticity":
        # A loop holds a motor behind a spring by itself: a light one, sampled seldom, is unstable.
        hub = rig.hub_inertia or float(round(0.3 * inertia.max(), 3))
        rig = replace(rig, rate=max(rig.rate, 500.0), hub_inertia=hub)
        rig = replace(rig, springs=_values(torque / (0.02 * share + 0.002)))
        truth |= {f"c{k + 1}": 1.0 / x for k, x in enumerate(rig.springs)}
    return rig, kind, truth


def _values(sizes: np.ndarray) -> tuple[float, ...]:
    return tuple(float(f"{x:.4g}") for x in sizes)


def cases() -> dict[str, Case]:
    """All forty by name."""
    found = []
    for seed in range(RIGS):
        rig, kind, truth = drawn(seed)
        form = "bending" if rig.stiffness else "rigid"
        name = f"rigs/{seed}_{form}_{rig.joints}_{kind or 'nothing'}"
        write = partial(written, rig, 500 + 10 * seed)
        found.append(Case(name, (kind,) if kind else (), truth, write))
    return {case.name: case for case in found}
