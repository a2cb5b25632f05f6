"""The two-link arm as chains of rigid bodies on elastic hinges, in MuJoCo's own language.

A uniform beam is cut into N equal pieces. Each piece bends in a hinge at its middle, of stiffness
EI N / l; between the hinges lie rigid slender bodies, the first and the last of half the length.
The bending of the paper's arm is nowhere assumed here: no modes, no small deflections.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

HINGES = 20
"""Per segment; the error of the beam's compliance and frequencies falls with its square."""

THICKNESS = 1e-3
"""Share of a slender body's transverse inertia that it has about its axis: nothing turns there,
but MuJoCo refuses a zero."""

POINT = 1e-9
"""kg and kg m²: MuJoCo refuses a body without mass or inertia; 1e-6 of the lightest element's."""


@dataclass(frozen=True)
class Beam:
    """One uniform segment: length in m, mass in kg, bending stiffness EI in N m²."""

    length: float
    mass: float
    EI: float
    hinges: int = HINGES

    @property
    def hinge_stiffness(self) -> float:
        """N m/rad of each hinge: that of the piece of beam around it."""
        return self.EI * self.hinges / self.length

    @cached_property
    def bodies(self) -> tuple[float, ...]:
        """Lengths in m of the rigid bodies, from the root."""
        piece = self.length / self.hinges
        return (piece / 2, *([piece] * (self.hinges - 1)), piece / 2)


PAPER = (Beam(0.5, 7.5, 520.8333), Beam(0.5, 5.0, 520.8333))
"""The arm of design section 2: ε = 1 GPa and a square section of 5 cm give EI."""


@dataclass(frozen=True)
class Motor:
    """One joint and its drive. At neutral: nothing but u = gain (reference - velocity)."""

    gain: float
    """N m s/rad."""
    coulomb: float = 0.0
    """N m."""
    viscous: float = 0.0
    """N m s/rad."""
    inertia: float = 0.0
    """kg m², of the rotor against the link that carries the motor."""
    spring: float | None = None
    """N m/rad between motor and link; None: rigid. Encoder and loop are on the motor's side."""
    limit: float | None = None
    """N m, of the motor's torque; None: no limit."""


@dataclass(frozen=True)
class Plant:
    """Everything that the engine needs to know. At neutral: the arm of the paper, bare."""

    beams: tuple[Beam, ...] = PAPER
    motors: tuple[Motor, ...] = (Motor(60.0), Motor(30.0))
    tip_mass: float = 0.0
    """kg, a point at the end of the last segment."""
    gravity: tuple[float, float] = (0.0, 0.0)
    """m/s² in the plane of motion."""
    damping_time: float = 0.0
    """s, Kelvin-Voigt: a hinge's damping is this times its stiffness."""
    camera_delay: float = 0.0
    """s."""

    @property
    def has_friction(self) -> bool:
        return any(motor.coulomb for motor in self.motors)


def mjcf(plant: Plant, step: float) -> str:
    """The model's text; `step` in s. Joints motor1, motor2, ...; site tip."""
    bodies = "".join(_bodies(plant, step))
    ends = "</body>" * bodies.count("<body")
    actuators = "".join(_actuator(n, motor) for n, motor in enumerate(plant.motors, 1))
    gx, gy = plant.gravity
    friction = "enable" if plant.has_friction else "disable"
    # PGS works in the space of the constraints, here one or two; Newton's in that of all hinges.
    return f"""<mujoco>
<compiler angle="radian"/>
<option timestep="{step!r}" integrator="implicitfast" gravity="{gx} {gy} 0" jacobian="dense"
 solver="PGS" tolerance="1e-12"><flag contact="disable" constraint="{friction}"/></option>
<worldbody>{bodies}{ends}</worldbody>
<actuator>{actuators}</actuator>
</mujoco>"""


def clamped(beam: Beam, step: float) -> str:
    """One beam alone, its root held by the ground, `step` in s; site tip."""
    text = "".join(_segment(beam, [""], 0.0, 0.0))
    site = f'<site name="tip" pos="{beam.bodies[-1]!r} 0 0"/>'
    return f"""<mujoco><compiler angle="radian"/>
<option timestep="{step!r}" integrator="implicitfast" gravity="0 0 0"/>
<worldbody>{text}{site}{"</body>" * text.count("<body")}</worldbody>
</mujoco>"""


def _bodies(plant: Plant, step: float) -> Iterator[str]:
    """Opened, not closed: each body hangs on the one before, and all end at the tip."""
    place = 0.0
    for n, (beam, motor) in enumerate(zip(plant.beams, plant.motors, strict=True), 1):
        yield from _segment(beam, _joints(n, motor, step), plant.damping_time, place)
        place = beam.bodies[-1]
    yield f'<site name="tip" pos="{place!r} 0 0"/>'
    yield f'<body pos="{place!r} 0 0">{_inertia(0.0, plant.tip_mass + POINT, POINT)}'


def _segment(beam: Beam, joints: list[str], damping_time: float, place: float) -> Iterator[str]:
    """The bodies of one beam; `place` in m is its root on the body before."""
    *motor_side, link_side = joints
    for joint in motor_side:  # the rotor: a point that carries the inertia in its joint
        yield f'<body pos="{place!r} 0 0">{_inertia(0.0, POINT, POINT)}{joint}'
        place = 0.0
    stiffness = beam.hinge_stiffness
    hinge = _hinge(stiffness=stiffness, damping=damping_time * stiffness)
    for i, length in enumerate(beam.bodies):
        mass = beam.mass * length / beam.length
        inertia = _inertia(length / 2, mass, mass * length**2 / 12)
        yield f'<body pos="{place!r} 0 0">{inertia}{hinge if i else link_side}'
        place = length


def _joints(n: int, motor: Motor, step: float) -> list[str]:
    """The motor's joint, and behind it the spring's where there is one."""
    # MuJoCo's friction is a soft constraint. As stiff as it can be made: the sliding velocity is
    # to vanish within one step (time constant 2 steps, ratio 1) at the largest impedance allowed.
    joint = _hinge(
        name=f"motor{n}",
        armature=motor.inertia,
        damping=motor.viscous,
        frictionloss=motor.coulomb,
        solreffriction=f"{2 * step!r} 1",
        solimpfriction="0.9999 0.9999 0.001 0.5 2",
    )
    return [joint] if motor.spring is None else [joint, _hinge(stiffness=motor.spring)]


def _hinge(**attributes: object) -> str:
    listed = " ".join(f'{key}="{value}"' for key, value in attributes.items())
    return f'<joint axis="0 0 1" {listed}/>'


def _inertia(centre: float, mass: float, transverse: float) -> str:
    along = THICKNESS * transverse if centre else transverse
    return (
        f'<inertial pos="{centre!r} 0 0" mass="{mass!r}" '
        f'diaginertia="{along!r} {transverse!r} {transverse!r}"/>'
    )


def _actuator(n: int, motor: Motor) -> str:
    limit = "" if motor.limit is None else f'forcerange="{-motor.limit} {motor.limit}"'
    return f'<velocity name="drive{n}" joint="motor{n}" kv="{motor.gain}" {limit}/>'
