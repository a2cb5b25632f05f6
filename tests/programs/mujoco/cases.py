"""Which recordings are made: the experiments that all cases share, and what each case hides."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tests.programs.mujoco.chain import Plant
from tests.programs.mujoco.effects import Effects, with_effects
from tests.programs.mujoco.excitation import RATE_DECIMALS, prbs, sweep

SMOOTH_STEP = 10e-6
"""s. Halving it moves the tip by 8e-7 m; the undamped chain is unstable at 20e-6."""
FRICTION_STEP = 2e-6
"""s. Halving it moves the tip by 1e-7 m; MuJoCo's friction is as soft as the step is long."""
LIMIT_STEP = 0.5e-6
"""s. Halving it moves the tip by 4e-7 m; at 4e-6 the torque chatters and the tip is 4 mm off."""

RANGE = (np.pi / 8, 7 * np.pi / 8)
"""rad, of theta2."""


@dataclass(frozen=True)
class Experiment:
    """One recording: its name, role, the angle of joint 2 at its start in rad, and references."""

    name: str
    role: str
    theta2: float
    reference: np.ndarray


def _experiments() -> tuple[Experiment, ...]:
    postures = (
        Experiment(f"posture{k}", "estimate", k * np.pi / 8, prbs(2.0, seed=k)) for k in range(1, 8)
    )
    # Rounded as it will be written, so that the file holds exactly what the drive was told.
    moving = np.round(sweep(*RANGE, seconds=4.0) + prbs(4.0, seed=8), RATE_DECIMALS)
    return (*postures, Experiment("sweep", "validate", RANGE[0], moving))


EXPERIMENTS = _experiments()


@dataclass(frozen=True)
class Case:
    """One folder of recordings."""

    name: str
    effects: Effects = field(default_factory=dict)
    rotors: tuple[float, float] = (0.0, 0.0)
    """kg m², which the scenario states."""

    @property
    def plant(self) -> Plant:
        return with_effects(self.effects, self.rotors)

    @property
    def step(self) -> float:
        """s, the integrator's."""
        return step_for(self.plant)


def step_for(plant: Plant) -> float:
    """The coarsest step in s at which halving changes nothing that the instruments would see."""
    limited = any(motor.limit is not None for motor in plant.motors)
    if limited:
        return LIMIT_STEP
    return FRICTION_STEP if plant.has_friction else SMOOTH_STEP


COULOMB = {"coulomb_friction": {"fc1": 1.5, "fc2": 0.6}}
VISCOUS = {"viscous_friction": {"fv1": 3.0, "fv2": 1.5}}
PAYLOAD = {"tip_payload": {"mt": 0.4}}
ELASTICITY = {"joint_elasticity": {"k1": 8000.0, "k2": 4000.0, "Jm1": 0.05, "Jm2": 0.02}}
ROTOR = {"rotor_inertia": {"Jh1": 0.3, "Jh2": 0.1}}
TILT = {"gravity_tilt": {"g1": 0.20, "g2": -0.10}}
DELAY = {"camera_delay": {"td": 0.006}}
LIMIT = {"drive_saturation": {"ul1": 20.0, "ul2": 10.0}}
"""At its limit for about a tenth of the time."""
ROTORS = (0.05, 0.02)
"""kg m². Known, not hidden: at a limit a motor without a rotor pushes on the first grain of the
beam, and how that gives way is a matter of all its modes. A simulation with three modes then misses
one with five by a fifth of what the limit moves the tip, and by all of it at 30 and 15 N m; with
these rotors by a twentieth."""
MATERIAL = {"structural_damping": {"tau": 1e-3}}

CASES = (
    Case("nothing"),
    Case("coulomb_friction", COULOMB),
    Case("viscous_friction", VISCOUS),
    Case("tip_payload", PAYLOAD),
    Case("joint_elasticity", ELASTICITY),
    Case("rotor_inertia", ROTOR),
    Case("gravity_tilt", TILT),
    Case("camera_delay", DELAY),
    Case("drive_saturation", LIMIT, ROTORS),
    Case("structural_damping", MATERIAL),
    Case("coulomb_friction-tip_payload", COULOMB | PAYLOAD),
    Case("viscous_friction-joint_elasticity", VISCOUS | ELASTICITY),
    Case("structural_damping-camera_delay", MATERIAL | DELAY),
)
