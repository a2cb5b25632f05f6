"""A chain with what a plain one has not: a soft base, cubic springs, play, and forces by formula.

What MuJoCo has itself (springs, dampers, dry friction, inertia, gravity) is left to it; the rest
acts between two of its steps.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from tests.programs.mujoco.chain import Plant, mjcf

Law = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Of the motors' angles (rad), rates (rad/s) and torques (N m): N m at each motor."""


@dataclass(frozen=True)
class Rig:
    """At neutral: the plant, its loops, and instruments that report what is."""

    plant: Plant
    base_compliance: float = 0.0
    """m/N, alike in both directions."""
    pedestal: tuple[float, float] | None = None
    """rad/(N m) and kg m², of a base that turns; none: it does not."""
    cubic: tuple[float, ...] = ()
    """N/m³ of each segment's deflection at its end."""
    tip_inertia: float = 0.0
    """kg m², of a payload."""
    gaps: tuple[float, ...] = ()
    """rad, half the play of each joint, in series with its spring."""
    pushes: tuple[Law, ...] = ()
    """Torques at the motors."""
    friction: Law | None = None
    """Levels of dry friction that change on the way; else those of the motors."""
    friction_time: float = 0.0
    """s, in which a joint that sticks loses its rate; none: as short as the engine can."""
    lag: float = 0.0
    """s, of the drives' torque."""
    drag: float = 0.0
    """N s²/m², at the tip."""
    camera_lag: float = 0.0
    """s"""
    camera_angle: float = 0.0
    """rad"""
    camera_scale: float = 0.0
    encoder_offsets: tuple[float, ...] = ()
    """rad"""

    def pushed(self, push: Law) -> Rig:
        return replace(self, pushes=(*self.pushes, push))

    @property
    def torque_driven(self) -> bool:
        """Whether the loops are computed here: the engine's own have neither lag nor play of
        their limits with a rotor."""
        return self.lag > 0.0 or any(m.limit is not None for m in self.plant.motors)

    @property
    def plain(self) -> bool:
        """Whether the engine has all that acts, and needs no look between its steps."""
        laws = (*self.pushes, self.friction, self.torque_driven, self.drag, self.camera_lag)
        return not (any(laws) or any(self.cubic) or any(self.gaps))


def text(rig: Rig, step: float) -> str:
    """MJCF; joints motor1, ... and, with play, teeth1, ...; actuators in the joints' order, then
    those of the cubic springs; site tip."""
    found = mjcf(rig.plant, step)
    if any(rig.gaps):
        found = _named_teeth(found)
    if rig.base_compliance:
        found = _on_soft_base(found, 1.0 / rig.base_compliance)
    if rig.pedestal is not None:
        found = _on_pedestal(found, *rig.pedestal)
    if rig.friction is not None:
        found = found.replace('constraint="disable"', 'constraint="enable"')
    if rig.friction_time:
        soft = f'solreffriction="{rig.friction_time!r} 1"'
        found = re.sub(r'solreffriction="[^"]*" solimpfriction="[^"]*"', soft, found)
    if rig.torque_driven:
        found = re.sub(
            r'<velocity (name="\S+" joint="\S+") kv="\S+" ?[^/]*/>', r"<motor \1/>", found
        )
    return _with_bends(found, rig) if any(rig.cubic) else found


def _on_soft_base(found: str, stiffness: float) -> str:
    """Two slides before the first joint: a body's joints move it in their order."""
    slides = "".join(
        f'<joint name="base{n}" type="slide" axis="{axis}" stiffness="{stiffness!r}"/>'
        for n, axis in enumerate(("1 0 0", "0 1 0"), 1)
    )
    return found.replace("<joint ", f"{slides}<joint ", 1)


def _on_pedestal(found: str, compliance: float, inertia: float) -> str:
    """A body around the arm that turns against a spring."""
    along = f'diaginertia="{inertia!r} {inertia!r} {inertia!r}"'
    turning = (
        f'<body><inertial pos="0 0 0" mass="{inertia!r}" {along}/>'
        f'<joint axis="0 0 1" stiffness="{1.0 / compliance!r}"/>'
    )
    first, last = found.index("<body"), found.rindex("</body>")
    return found[:first] + turning + found[first:last] + "</body>" + found[last:]


def _named_teeth(found: str) -> str:
    """The springs behind the motors, which have no damping, without their stiffness."""
    count = iter(range(1, 100))
    return re.sub(
        r'<joint axis="0 0 1" stiffness="[^"]*"/>',
        lambda _: f'<joint axis="0 0 1" name="teeth{next(count)}"/>',
        found,
    )


def _with_bends(found: str, rig: Rig) -> str:
    """Tendons whose lengths are the deflections of the segments' ends, and motors on them."""
    count = iter(range(10_000))
    found = re.sub(
        r'<joint axis="0 0 1" stiffness="([^"]*)" damping',
        lambda m: f'<joint axis="0 0 1" name="hinge{next(count)}" stiffness="{m[1]}" damping',
        found,
    )
    tendons, motors = "", ""
    for n, joints in enumerate(_arms_of_bending(rig.plant)):
        inside = "".join(f'<joint joint="hinge{k}" coef="{c!r}"/>' for k, c in joints)
        tendons += f'<fixed name="bend{n}">{inside}</fixed>'
        motors += f'<motor name="cubic{n}" tendon="bend{n}"/>'
    found = found.replace("<actuator>", f"<tendon>{tendons}</tendon><actuator>")
    return found.replace("</actuator>", f"{motors}</actuator>")


def _arms_of_bending(plant: Plant) -> Iterator[list[tuple[int, float]]]:
    """Per segment: its hinges' numbers and their distances in m from its end."""
    at = 0
    for beam in plant.beams:
        places = np.cumsum(beam.bodies)[:-1]
        yield [(at + i, float(beam.length - x)) for i, x in enumerate(places)]
        at += beam.hinges
