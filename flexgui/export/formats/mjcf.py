"""MJCF of the arm: each segment a chain of rigid bodies on elastic hinges.

A uniform beam is cut into N equal pieces. Each bends in a hinge at its middle, of stiffness
EI N / l; rigid slender bodies lie between, the first and the last of half the length. Inside, the
errors of stiffness and mass cancel to 1 / N^4; weights at both ends (`WEIGHTS`) do so for the ends.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
import scipy

from flexgui.core.results import Link, Mechanism, Outcome
from flexgui.export.model_format import ModelFormat, header

CARRIED = frozenset({"arm", "damping", "dry"})
"""What an effect may act on to be in the file; of the drive, see `_drive_is_carried`."""

STABLE = 0.5
"""Share of the longest step, 2 / omega of the fastest vibration, at which MuJoCo's semi-implicit
integrator is stable with springs: none of the chain's fast vibrations is of interest."""
LONGEST_STEP = 1e-3
"""s."""

THICKNESS = 1e-3
"""Share of a slender body's transverse inertia about its axis: nothing turns there, but MuJoCo
refuses a zero."""
SLENDER = 0.02
"""Radius by length of a segment, as it is drawn."""
POINT = 1e-9
"""kg and kg m^2: MuJoCo refuses bodies that move without mass or inertia."""

LIMITS = (
    "Joints motor1, motor2, ...; site tip; sensors theta1, dtheta1, u1, deflection1, ... and z of "
    "the tip. Without a place in it: noise and delays of sensors, references and controllers "
    "beyond a velocity loop, foreshortening beyond what a chain has.",
    "Dry friction is one level at any speed (frictionloss). MuJoCo makes it a soft constraint, so "
    "that a joint creeps a little where it should stick.",
)


class Mjcf(ModelFormat):
    """For MuJoCo, and for tools that read its files."""

    kind = "mjcf"
    label = "Arm for MuJoCo (.xml)"
    hint = "MJCF: the arm as chains of rigid bodies on elastic hinges."

    def unable(self, outcome: Outcome) -> str:
        if outcome.mechanism is None:
            return "The arm of this result is not known; identify again."
        return ""

    def files(self, outcome: Outcome) -> dict[str, bytes]:
        return {} if outcome.mechanism is None else {"model.xml": mjcf(outcome, outcome.mechanism)}


def mjcf(outcome: Outcome, arm: Mechanism) -> bytes:
    """Its text; the header compares the chain's first frequencies with the model's."""
    root = ElementTree.Element("mujoco", model="arm")
    about = "\n".join(["", *_header(outcome, arm), ""])
    root.append(ElementTree.Comment(about))
    ElementTree.SubElement(root, "compiler", angle="radian")
    option = ElementTree.SubElement(
        root, "option", timestep=repr(_step(arm)), integrator="implicitfast",
        gravity=f"{arm.gravity[0]!r} {arm.gravity[1]!r} 0",
    )  # fmt: skip
    ElementTree.SubElement(option, "flag", contact="disable")
    world = ElementTree.SubElement(root, "worldbody")
    tendons, actuators, sensors = (
        ElementTree.SubElement(root, tag) for tag in ("tendon", "actuator", "sensor")
    )
    ground = _ground(world, arm.base_stiffness)
    place = _Place(ground, 0.0)
    for k, link in enumerate(arm.links):
        if link.on_ground:
            place = _Place(ground, 0.0)
        place = _add_link(place, link, k + 1)
        _add_drive(actuators, link, k + 1)
        _add_sensors(sensors, tendons, link, k + 1)
    ElementTree.SubElement(place.body, "site", name="tip", pos=_along(place.x))
    ElementTree.SubElement(sensors, "framepos", name="z", objtype="site", objname="tip")
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="utf-8")
    return text + b"\n"


class _Place:
    """Where the next body hangs: x m along a body."""

    def __init__(self, body: ElementTree.Element, x: float) -> None:
        self.body, self.x = body, x


def _ground(world: ElementTree.Element, stiffness: float | None) -> ElementTree.Element:
    """The ground, or a weightless plate on springs."""
    if stiffness is None:
        return world
    base = ElementTree.SubElement(world, "body", name="base")
    _inertial(base, 0.0, POINT, POINT)
    for axis in ("1 0 0", "0 1 0"):
        ElementTree.SubElement(base, "joint", type="slide", axis=axis, stiffness=repr(stiffness))
    return base


def _add_link(place: _Place, link: Link, number: int) -> _Place:
    """The bodies of a segment; the place of its end."""
    for i, piece in enumerate(pieces(link)):
        body = ElementTree.SubElement(place.body, "body", pos=_along(place.x))
        if i == 0:
            body = _add_joints(body, link, number)
            body.set("name", f"segment{number}")
        else:
            bend = {"name": f"bend{number}_{i}", "type": "hinge", "axis": "0 0 1"}
            damping = link.damping_time * piece.stiffness
            _joint(body, bend, stiffness=piece.stiffness, damping=damping)
        _inertial(body, piece.length / 2.0, piece.mass, piece.mass * piece.length**2 / 12.0)
        _shape(body, 0.0, piece.length, SLENDER * link.length)
        place = _Place(body, piece.length)
    if link.tip_mass or link.tip_inertia:
        load = ElementTree.SubElement(place.body, "body", pos=_along(place.x))
        _inertial(load, 0.0, link.tip_mass + POINT, link.tip_inertia + POINT)
        _shape(load, 0.0, SLENDER * link.length, 2.0 * SLENDER * link.length)
    return place


def _add_joints(body: ElementTree.Element, link: Link, number: int) -> ElementTree.Element:
    """The motor's joint, and behind it the spring's where there is one; the body behind both. A
    rotor without a gear is a body of its own between them."""
    given = {
        "armature": link.hub_inertia,
        "damping": link.joint_damping,
        "frictionloss": link.dry_friction,
    }
    moves = _motion(link)
    _joint(body, {"name": f"motor{number}", **moves}, **given)
    if link.rotor_inertia:
        body.set("name", f"rotor{number}")
        _inertial(body, 0.0, POINT, link.rotor_inertia + POINT)
        body = ElementTree.SubElement(body, "body", pos=_along(0.0))
    if link.joint_stiffness is not None:
        _joint(body, {"name": f"spring{number}", **moves}, stiffness=link.joint_stiffness)
    return body


def _motion(link: Link) -> dict[str, str]:
    if link.joint == "revolute":
        return {"type": "hinge", "axis": "0 0 1"}
    axis = f"{math.cos(link.axis_angle)!r} {math.sin(link.axis_angle)!r} 0"
    return {"type": "slide", "axis": axis}


def _joint(body: ElementTree.Element, attributes: dict[str, str], **values: float) -> None:
    """A joint with those values that are not zero."""
    numbers = {key: repr(float(value)) for key, value in values.items() if value}
    ElementTree.SubElement(body, "joint", {**attributes, **numbers})


def _shape(body: ElementTree.Element, start: float, end: float, radius: float) -> None:
    """To look at: what moves is told by the inertia beside it, and nothing touches."""
    ends = f"{_along(start)} {_along(end)}"
    ElementTree.SubElement(body, "geom", type="capsule", fromto=ends, size=repr(radius))


def _inertial(body: ElementTree.Element, x: float, mass: float, transverse: float) -> None:
    along = THICKNESS * transverse if x else transverse
    ElementTree.SubElement(
        body, "inertial", pos=_along(x), mass=repr(mass),
        diaginertia=f"{along!r} {transverse!r} {transverse!r}",
    )  # fmt: skip


def _along(x: float) -> str:
    return f"{x!r} 0 0"


def _add_drive(actuators: ElementTree.Element, link: Link, number: int) -> None:
    """A velocity loop where that is what drives the joint, else a torque; ctrl is its input."""
    limits = {} if link.limit is None else {"forcerange": f"{-link.limit!r} {link.limit!r}"}
    which = {"name": f"drive{number}", "joint": f"motor{number}"}
    if link.gain is None:
        ElementTree.SubElement(actuators, "motor", {**which, **limits})
    else:
        ElementTree.SubElement(actuators, "velocity", {**which, "kv": repr(link.gain), **limits})


def _add_sensors(
    sensors: ElementTree.Element, tendons: ElementTree.Element, link: Link, number: int
) -> None:
    """Encoder, its rate, the drive's torque, and the chord angle of a segment that bends: a sum
    over its hinges, each by how far the end is from it."""
    joint, drive = f"motor{number}", f"drive{number}"
    ElementTree.SubElement(sensors, "jointpos", name=f"theta{number}", joint=joint)
    ElementTree.SubElement(sensors, "jointvel", name=f"dtheta{number}", joint=joint)
    ElementTree.SubElement(sensors, "actuatorfrc", name=f"u{number}", actuator=drive)
    if not link.modes:
        return
    name = f"deflection{number}"
    chord = ElementTree.SubElement(tendons, "fixed", name=name)
    for i in range(1, HINGES + 1):
        far = repr(1.0 - (i - 0.5) / HINGES)
        ElementTree.SubElement(chord, "joint", joint=f"bend{number}_{i}", coef=far)
    ElementTree.SubElement(sensors, "tendonpos", name=name, tendon=name)


def _drive_is_carried(arm: Mechanism) -> bool:
    """Whether the drives are what a velocity actuator with a limit is."""
    return all(link.gain is not None for link in arm.links)


def _step(arm: Mechanism) -> float:
    """s, of the engine: a whole part of LONGEST_STEP, at which the chain is stable."""
    fastest = max(chain_frequencies(arm, arm.posture), default=0.0)
    return LONGEST_STEP / max(math.ceil(LONGEST_STEP * math.pi * fastest / STABLE), 1)


def _header(outcome: Outcome, arm: Mechanism) -> Sequence[str]:
    acts = CARRIED | ({"drive"} if _drive_is_carried(arm) else set())
    carried = [e for e in arm.effects if e.acts_on in acts]
    what = f"MJCF of the arm, {HINGES} hinges per bending segment"
    return header(outcome, what, carried, (*LIMITS, *_compared(arm)))


def _compared(arm: Mechanism) -> list[str]:
    """A line with the first frequencies of both, joints held."""
    if not arm.frequencies:
        return []
    chain = chain_frequencies(arm, arm.posture)[: len(arm.frequencies)]
    pairs = [f"{c:.4g} ({m:.4g})" for c, m in zip(chain, arm.frequencies, strict=False)]
    posture = ", ".join(f"{x:.4g}" for x in arm.posture)
    line = f"First frequencies of the chain (of the model) in Hz, joints held at ({posture}): "
    return [
        line + ", ".join(pairs) + ".",
        "They differ where the model bends in fewer shapes than a beam: add bending modes to it.",
    ]


HINGES = 8
"""Per segment that bends: the first three frequencies of an arm are within 0.6 % of the beam's, and
its fastest vibration, which the step must follow, grows with the square of this number."""
WEIGHTS = np.ones(HINGES)
"""Of the hinges' compliances, as Euler and Maclaurin correct the ends of a midpoint sum."""
WEIGHTS[[0, -1]] += 1.0 / 24.0
WEIGHTS[[1, -2]] -= 1.0 / 24.0


@dataclass(frozen=True)
class Piece:
    """A rigid slender body, and the hinge at its root (the joint's where it is the first)."""

    length: float
    mass: float
    stiffness: float
    """N m/rad of the hinge; 0 for the first piece."""


def pieces(link: Link) -> tuple[Piece, ...]:
    """From the root; one where the segment does not bend."""
    if not link.modes:
        return (Piece(link.length, link.mass, 0.0),)
    length = link.length / HINGES
    lengths = (length / 2.0, *([length] * (HINGES - 1)), length / 2.0)
    stiffness = (0.0, *(float(k) for k in link.EI / (length * WEIGHTS)))
    return tuple(
        Piece(x, link.mass * x / link.length, k) for x, k in zip(lengths, stiffness, strict=True)
    )


def chain_frequencies(arm: Mechanism, posture: Sequence[float]) -> np.ndarray:
    """Hz, ascending, of the undamped chain with the motors held and without gravity.

    Args:
        arm: What is cut into pieces.
        posture: (nj,) joint positions in rad (m).
    """
    chain = _Chain(arm, posture)
    if not chain.stiffness:
        return np.zeros(0)
    K = np.diag(chain.stiffness)
    squares = scipy.linalg.eigh(K, chain.mass_matrix(), eigvals_only=True)
    return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)


class _Chain:
    """Every place is a complex number in the plane; a spring moves all that hangs on it."""

    def __init__(self, arm: Mechanism, posture: Sequence[float]) -> None:
        self.stiffness: list[float] = []
        self._springs: list[tuple[complex, complex]] = []
        """Pivot, and direction of a slide: the spring turns about the one or gives along the
        other."""
        self._turns: list[bool] = []
        self._bodies: list[tuple[complex, float, float, tuple[int, ...]]] = []
        """Centre, mass, inertia, and the springs that move it."""
        base = self._base(arm.base_stiffness)
        hanging, root, angle = base, 0j, 0.0
        for link, position in zip(arm.links, posture, strict=True):
            if link.on_ground:
                root, angle, hanging = 0j, 0.0, base
            turns = link.joint == "revolute"
            slide = np.exp(1j * (angle + link.axis_angle))
            angle, root = (angle + position, root) if turns else (angle, root + position * slide)
            self._bodies.append((root, 0.0, link.rotor_inertia, hanging))
            if link.joint_stiffness is not None:
                hanging = (*hanging, self._spring(link.joint_stiffness, root, slide, turns))
            root, hanging = self._link(link, root, np.exp(1j * angle), hanging)

    def _base(self, stiffness: float | None) -> tuple[int, ...]:
        if stiffness is None:
            return ()
        return tuple(self._spring(stiffness, 0j, direction, False) for direction in (1.0, 1j))

    def _spring(self, stiffness: float, pivot: complex, slide: complex, turns: bool) -> int:
        self.stiffness.append(stiffness)
        self._springs.append((pivot, slide))
        self._turns.append(turns)
        return len(self.stiffness) - 1

    def _link(
        self, link: Link, root: complex, along: complex, hanging: tuple[int, ...]
    ) -> tuple[complex, tuple[int, ...]]:
        for piece in pieces(link):
            if piece.stiffness:
                hanging = (*hanging, self._spring(piece.stiffness, root, 0j, True))
            inertia = piece.mass * piece.length**2 / 12.0
            self._bodies.append((root + along * piece.length / 2.0, piece.mass, inertia, hanging))
            root = root + along * piece.length
        self._bodies.append((root, link.tip_mass, link.tip_inertia, hanging))
        return root, hanging

    def mass_matrix(self) -> np.ndarray:
        """(springs, springs)"""
        M = np.zeros((len(self.stiffness),) * 2)
        for place, mass, inertia, hanging in self._bodies:
            which = list(hanging)
            velocity = np.array([self._velocity(i, place) for i in which])
            turning = np.array([float(self._turns[i]) for i in which])
            part = mass * np.real(np.outer(velocity.conj(), velocity))
            M[np.ix_(which, which)] += part + inertia * np.outer(turning, turning)
        return M

    def _velocity(self, spring: int, place: complex) -> complex:
        pivot, slide = self._springs[spring]
        return 1j * (place - pivot) if self._turns[spring] else slide
