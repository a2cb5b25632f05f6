"""Models that a user of MuJoCo would write for the recordings of the independent engine: the arm as
a chain of six hinges per link, with one effect more in each.

Parameters are in units of their scales, so that an optimiser sees numbers of about one.
"""

from __future__ import annotations

import gzip
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
from mujoco import rollout

from tests.programs.mujoco.chain import PAPER, Plant, mjcf
from tests.programs.mujoco.excitation import SAMPLE
from tests.programs.mujoco.files import CAMERA_NOISE, ENCODER_NOISE

HINGES = 6
STEP = 1e-4
"""s; a chain of six hinges is stable to 1.5e-4."""
RECORDINGS = ("posture1", "posture4", "posture7")
WRONG = (0.7, 1.3)
"""Times the true bending stiffness: where all models start."""
NOISE = np.array([ENCODER_NOISE] * 2 + [CAMERA_NOISE] * 2)

Values = Mapping[str, float]
Rotors = tuple[float, float]
"""kg m², per motor."""
NO_ROTORS = (0.0, 0.0)


@dataclass(frozen=True)
class Knob:
    """A parameter of one model: its scale in SI, and start and bounds in units of it."""

    scale: float
    start: float
    lower: float
    upper: float


@dataclass(frozen=True)
class Candidate:
    """What is added to the chain; `late` is the name of a delay of the camera."""

    knobs: Mapping[str, Knob]
    change: Callable[[Plant, Values], Plant]
    late: str = ""


def _motors(plant: Plant, **names: Callable[[int], float]) -> Plant:
    motors = (
        replace(m, **{field: of(k) for field, of in names.items()})
        for k, m in enumerate(plant.motors, 1)
    )
    return replace(plant, motors=tuple(motors))


def _both(name: str, *knob: float) -> dict[str, Knob]:
    return {f"{name}{k}": Knob(*knob) for k in (1, 2)}


def _by(field: str, name: str) -> Callable[[Plant, Values], Plant]:
    return lambda plant, v: _motors(plant, **{field: lambda k: v[f"{name}{k}"]})


def _elastic(plant: Plant, v: Values) -> Plant:
    return _motors(plant, spring=lambda k: 1.0 / v[f"c{k}"], inertia=lambda k: v[f"J{k}"])


CANDIDATES = {
    "nothing": Candidate({}, lambda plant, v: plant),
    "viscous_friction": Candidate(_both("fv", 1.0, 0.5, 0.0, 50.0), _by("viscous", "fv")),
    "coulomb_friction": Candidate(_both("fc", 1.0, 0.3, 0.0, 20.0), _by("coulomb", "fc")),
    "rotor_inertia": Candidate(_both("Jh", 0.1, 0.3, 0.0, 20.0), _by("inertia", "Jh")),
    "drive_saturation": Candidate(_both("ul", 10.0, 1.5, 0.3, 10.0), _by("limit", "ul")),
    "joint_elasticity": Candidate(
        _both("c", 1e-4, 0.5, 0.01, 20.0) | _both("J", 0.03, 1.0, 0.03, 30.0), _elastic
    ),
    "tip_payload": Candidate(
        {"mt2": Knob(0.5, 0.2, 0.0, 10.0)}, lambda p, v: replace(p, tip_mass=v["mt2"])
    ),
    "gravity_tilt": Candidate(
        {name: Knob(0.1, 0.5, -20.0, 20.0) for name in ("g1", "g2")},
        lambda p, v: replace(p, gravity=(v["g1"], v["g2"])),
    ),
    "structural_damping": Candidate(
        {"tau": Knob(1e-3, 0.2, 0.0, 10.0)}, lambda p, v: replace(p, damping_time=v["tau"])
    ),
    "camera_delay": Candidate({"td": Knob(5e-3, 0.4, 0.0, 10.0)}, lambda p, v: p, "td"),
}

# A beam twice as stiff is the stiffest that the step is fine enough for.
BARE = {f"EI{k}": Knob(beam.EI, WRONG[k - 1], 0.2, 2.0) for k, beam in enumerate(PAPER, 1)}


def knobs(candidate: str) -> dict[str, Knob]:
    """Of the chain and of what is added."""
    return {**BARE, **CANDIDATES[candidate].knobs}


@dataclass(frozen=True)
class Data:
    """One recording: references (N, 2), encoders and camera (N, 4), SI."""

    references: np.ndarray
    measured: np.ndarray

    @property
    def steps(self) -> int:
        """Of the engine per sample."""
        return round(SAMPLE / STEP)


def recordings(folder: Path) -> list[Data]:
    """Three postures of a case."""
    found = []
    for name in RECORDINGS:
        with gzip.open(folder / f"{name}.csv.gz", "rt") as file:
            d = pd.read_csv(file)
        columns = ["theta1", "theta2", "z1", "z2"]
        references = d[["dtheta1_ref", "dtheta2_ref"]].to_numpy(float)
        found.append(Data(references, d[columns].to_numpy(float)))
    return found


def model(candidate: str, values: Values, rotors: Rotors = NO_ROTORS) -> mujoco.MjModel:
    """The chain with what is added, at values in SI; `rotors` are known."""
    beams = tuple(
        replace(beam, EI=values[f"EI{k}"], hinges=HINGES) for k, beam in enumerate(PAPER, 1)
    )
    bare = _motors(replace(Plant(), beams=beams), inertia=lambda k: rotors[k - 1])
    plant = CANDIDATES[candidate].change(bare, values)
    return mujoco.MjModel.from_xml_string(mjcf(plant, STEP))


def errors(
    candidate: str, values: Values, data: list[Data], rotors: Rotors = NO_ROTORS
) -> np.ndarray:
    """Measured minus simulated over the noise, of all recordings, flat."""
    built = model(candidate, values, rotors)
    late = values.get(CANDIDATES[candidate].late, 0.0)
    return np.concatenate([_one(built, each, late).ravel() for each in data])


def _one(built: mujoco.MjModel, data: Data, late: float) -> np.ndarray:
    held = np.repeat(data.references[:-1], data.steps, axis=0)
    scratch = mujoco.MjData(built)
    places = [int(built.joint(f"motor{k}").qposadr[0]) for k in (1, 2)]
    # The encoders say where it starts; straight and at rest, as every user would assume.
    scratch.qpos[places] = np.round(data.measured[0, :2], 4)
    size = mujoco.mj_stateSize(built, mujoco.mjtState.mjSTATE_FULLPHYSICS.value)
    start = np.empty(size)
    mujoco.mj_getState(built, scratch, start, mujoco.mjtState.mjSTATE_FULLPHYSICS.value)
    states, _ = rollout.rollout(built, scratch, start, held[None])
    kept = np.vstack([start, states[0, data.steps - 1 :: data.steps]])
    q = kept[:, 1 : 1 + built.nq]
    tip = _tips(built, q)
    time = SAMPLE * np.arange(len(q))
    seen = [np.interp(time - late, time, column) for column in tip.T] if late else tip.T
    simulated = np.column_stack([q[:, places], *seen])
    return np.asarray((data.measured - simulated) / NOISE)


def _tips(built: mujoco.MjModel, q: np.ndarray) -> np.ndarray:
    """(N, 2) m: every joint turns about z, so angles add up along the chain."""
    x, angle = np.zeros((len(q), 2)), np.zeros(len(q))
    for body in range(1, built.nbody):
        place = built.body_pos[body, 0]
        x += place * np.column_stack([np.cos(angle), np.sin(angle)])
        if built.body_jntnum[body]:
            angle = angle + q[:, built.body_jntadr[body]]
    return x
