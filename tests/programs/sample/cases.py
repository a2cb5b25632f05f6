"""The thirty cases of the sample, chosen once by rule and not by what the program says of them.

- ENGINE, nine velocity loops of the independent engine: every tenth of the wide cases in their
  order, from the first. Every arm and size is among them, and nothing, one, two and three effects.
- SLOW, three of the engine's with a camera at a tenth of the rate: nothing and the
  first effect of the list of sizes on the unequal arm, the second effect on one segment.
- PLAIN, eight random plain rigs, started 30 % or four times off: the first seeds that have at most
  5 recordings and 3000 samples, hide at most three effects, and can be posed. What is hidden was
  drawn once and stands in `plain_truth.json`, so that it stays when the program changes.
- TORQUE, ten rigs whose torque is recorded and whose files state no filter: rigid and flexible, one
  link, two links and a slide, with nothing, one and two effects, and one shaken by something that
  is no effect of the catalogue.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from tests.programs.mujoco.wide_cases import CASES as WIDE
from tests.programs.mujoco.wide_files import written as write_engine
from tests.programs.sample.torque_rigs import TorqueRig
from tests.programs.sample.torque_rigs import written as write_torque
from tests.programs.studies.plain_matrix import written as write_plain
from tests.programs.studies.plain_matrix_rigs import drawn

TRUTH = Path(__file__).with_name("plain_truth.json")
EVERY = 10
"""Of the wide cases."""
SLOWER = 10
"""Times, of a slow camera."""
SLOW = ("unequal/nothing", "unequal/viscous_friction=0.05", "one/coulomb_friction=0.2")
NOT_JUDGEABLE = "cannot_be_judged"
"""Hidden in a rig that hardly moves: the verdict that is right there."""
OUTSIDE = "outside"
"""Hidden, and no effect of the catalogue."""


@dataclass(frozen=True)
class Case:
    """Files that a stranger could have, and the truth behind them."""

    name: str
    hidden: tuple[str, ...]
    """Ids of the hidden effects, or OUTSIDE."""
    truth: Mapping[str, float]
    """Parameter -> its true value, of the arm and of what is hidden."""
    write: Callable[[Path], Path]
    """Writes scenario and recordings into a folder; the scenario's path."""


def _engine(name: str, camera_every: int = 1) -> Case:
    case = WIDE[name]
    arm, _, by_effect = case.made()
    truth = {k: v for values in by_effect.values() for k, v in values.items()}
    truth |= {f"EI{k + 1}": beam.EI for k, beam in enumerate(arm.beams)}
    kind = "engine" if camera_every == 1 else "slow"
    return Case(
        f"{kind}/{name}", tuple(by_effect), truth, partial(_write_engine, name, camera_every)
    )


def _write_engine(name: str, camera_every: int, folder: Path) -> Path:
    path = write_engine(WIDE[name], folder)
    if camera_every > 1:
        for file in folder.glob("*.csv.gz"):
            table = pd.read_csv(file)
            table.loc[table.index % camera_every != 0, ["z1", "z2"]] = None
            table.to_csv(file, index=False)
    return path


def _plain(seed: int, known: Mapping[str, Any]) -> Case:
    rig = drawn(seed)
    truth = {**known["values"], **{f"EI{k + 1}": s["EI"] for k, s in enumerate(rig.segments)}}
    write = partial(_write_plain, seed, known)
    return Case(f"plain/{seed}", tuple(known["hidden"]), truth, write)


def _write_plain(seed: int, known: Mapping[str, Any], folder: Path) -> Path:
    from flexgui.core.effects import effect
    from flexgui.core.effects.sizes import typical

    rig = drawn(seed)
    healthy = rig.healthy
    effects = [effect(kind) for kind in known["hidden"]]
    machine = healthy.with_effects(effects, known["values"], typical(healthy.arm))
    return write_plain(folder, rig, rig.measured(rig.recordings(machine), 2))


def _torque(name: str, rig: TorqueRig, seed: int) -> Case:
    hidden, truth = list[str](), dict[str, float]()
    for kind, letter, values in (
        ("viscous_friction", "fv", rig.viscous), ("coulomb_friction", "fc", rig.coulomb),
    ):  # fmt: skip
        hidden += [kind] if any(values) else []
        truth |= {f"{letter}{k + 1}": v for k, v in enumerate(values)}
    if rig.payload:
        hidden.append("tip_payload")
        truth[f"mt{rig.joints}"] = rig.payload
    hidden += [OUTSIDE] if any(rig.disturbance) else []
    if name in STIFFENED:
        hidden.append("cubic_stiffness")
        truth["k31"] = STIFFENING * rig.stiffness[0] / rig.lengths[0] ** 5
    letter, values = ("EI", rig.stiffness) if rig.stiffness else ("m", rig.masses)
    truth |= {f"{letter}{k + 1}": v for k, v in enumerate(values)}
    return Case(f"torque/{name}", tuple(hidden), truth, partial(write_torque, rig, seed))


STIFFENED = ("flexible_one_nothing", "flexible_one_viscous")
"""Rigs whose beam bends by a twenty-fifth of its length: its energy has a term of the fourth order,
1/2 EI (w' w'')^2."""
STIFFENING = 324.0 * (1.0 / 3.0 - 2.0 / 5.0 + 1.0 / 7.0) / 8.0
"""Times EI / l^5: four times the integral of that term over the beam under a force at its end,
w = d (3 s^2 - s^3) / 2 with s = x / l, for d = 1."""

_TWO = TorqueRig((4.0, 2.5), (0.5, 0.4))
_ONE = TorqueRig((3.0,), (0.6,))
_SLIDE = TorqueRig((95.0,), (0.5,), slide=True, bits=17)
_BEAM = TorqueRig((4.0,), (0.8,), stiffness=(200.0,), hub_inertia=0.1)
_BEAMS = TorqueRig((5.0, 3.0), (0.5, 0.5), stiffness=(500.0, 300.0), hub_inertia=0.1)

TORQUE = {
    "rigid_two_nothing": _TWO,
    "rigid_two_viscous": replace(_TWO, viscous=(2.0, 0.8), bits=17),
    "rigid_two_coulomb": replace(_TWO, coulomb=(1.5, 0.6), rate=500.0),
    "rigid_one_viscous_coulomb": replace(_ONE, viscous=(0.8,), coulomb=(0.5,)),
    "rigid_one_shaken": replace(_ONE, disturbance=(0.5,), disturbance_hz=17.3),
    "slide_nothing": _SLIDE,
    "slide_viscous_coulomb": replace(_SLIDE, viscous=(200.0,), coulomb=(20.0,)),
    "flexible_one_nothing": _BEAM,
    "flexible_one_viscous": replace(_BEAM, viscous=(1.0,)),
    "flexible_two_payload": replace(_BEAMS, payload=0.3, rate=500.0),
}


def cases() -> dict[str, Case]:
    """All thirty by name."""
    known = json.loads(TRUTH.read_text(encoding="utf-8"))
    found = [_engine(name) for name in list(WIDE)[::EVERY][:9]]
    found += [_engine(name, SLOWER) for name in SLOW]
    found += [_plain(int(seed), one) for seed, one in known.items()]
    found += [_torque(name, rig, 100 + k) for k, (name, rig) in enumerate(TORQUE.items())]
    return {case.name: case for case in found}
