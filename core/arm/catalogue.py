"""The parameters of an arm by name, and how their values enter the vector p."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arm import slots
from core.arm.arm import Arm
from core.arm.joints import joint
from core.arm.segment import Segment
from core.parameters import Parameter

GRAVITY_BOUND = 20.0
"""m/s^2: no rig on Earth needs more in one component."""

RELATIVE_BOUND = 10.0
"""Positive parameters may move by this factor when the user states no bounds."""


COMPLIANCE_BOUND = 1e3
"""Springs of joints and bases differ by orders of magnitude between rigs."""

LEAST_COMPLIANCE = 1e-9
"""rad/(N m), m/N: as good as rigid; an infinite stiffness could not be simulated."""

LEAST_MOTOR = 1e-2
"""Of the stated hub inertia: the motor of an elastic joint moves by itself, so its inertia must
not vanish."""


@dataclass(frozen=True)
class _Direct:
    """Writes one value into fixed places of p."""

    places: tuple[int, ...]

    def write(self, p: np.ndarray, section: np.ndarray, value: np.ndarray) -> None:
        p[:, self.places] = value[:, None]


@dataclass(frozen=True)
class _AtLeast:
    """Writes one value, or the smallest that makes sense, into one place of p."""

    place: int
    least: float

    def write(self, p: np.ndarray, section: np.ndarray, value: np.ndarray) -> None:
        p[:, self.place] = np.maximum(value, self.least)


@dataclass(frozen=True)
class _Inverse:
    """Writes the stiffness of a stated compliance into one place of p."""

    place: int

    def write(self, p: np.ndarray, section: np.ndarray, value: np.ndarray) -> None:
        p[:, self.place] = 1.0 / np.maximum(value, LEAST_COMPLIANCE)


@dataclass(frozen=True)
class _Section:
    """Writes a modulus (row 0) or a width (row 1) of some segments; EI follows."""

    row: int
    segments: tuple[int, ...]

    def write(self, p: np.ndarray, section: np.ndarray, value: np.ndarray) -> None:
        section[:, self.row, self.segments] = value[:, None]
        for k in self.segments:
            stiffness = section[:, 0, k] * section[:, 1, k] ** 4 / 12.0
            p[:, slots.slot(k, slots.STIFFNESS)] = stiffness


Writer = _Direct | _AtLeast | _Inverse | _Section


@dataclass(frozen=True)
class _Entry:
    parameter: Parameter
    writer: Writer


class ArmCatalogue:
    """All parameters of an arm: `entries[name].parameter`, and `vectors` to compute p."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.base = slots.arm_vector(arm)
        self.entries: dict[str, _Entry] = {}
        for k in range(arm.joints):
            self._add_segment(k)
        self._add_compliances()
        self._add_shared()
        for i in range(2):
            place = (slots.gravity_slot(arm.joints, i),)
            self._add_signed(
                f"g{i + 1}", arm.gravity[i], "m/s²", place, f"gravity component {i + 1}"
            )

    @property
    def parameters(self) -> dict[str, Parameter]:
        """The arm's parameters by name, each with its unit."""
        return {name: entry.parameter for name, entry in self.entries.items()}

    def vectors(self, names: Sequence[str], values: np.ndarray) -> np.ndarray:
        """p (S, 9 N + 3) for S value vectors (S, len(names)); the rest as in the arm."""
        p = np.tile(self.base, (len(values), 1))
        moduli = [s.young_modulus or np.nan for s in self.arm.segments]
        widths = [s.width or np.nan for s in self.arm.segments]
        section = np.tile(np.array([moduli, widths]), (len(values), 1, 1))
        for i, name in enumerate(names):
            self.entries[name].writer.write(p, section, values[:, i])
        return p

    def _add_segment(self, k: int) -> None:
        s, n, at = self.arm.segments[k], k + 1, slots.slot
        kind = joint(s.joint)
        self._add_positive(f"l{n}", s.length, "m", (at(k, slots.LENGTH),), f"length of segment {n}")
        self._add_positive(f"m{n}", s.mass, "kg", (at(k, slots.MASS),), f"mass of segment {n}")
        if s.modes:
            place = (at(k, slots.STIFFNESS),)
            title = f"bending stiffness of segment {n}"
            self._add_positive(f"EI{n}", s.bending_stiffness, "N m²", place, title)
            place = (at(k, slots.DAMPING_TIME),)
            title = f"damping time of segment {n}"
            self._add_nonnegative(f"tau{n}", s.damping_time, "s", place, title, 1e-3)
        if s.has_section:
            assert s.young_modulus is not None and s.width is not None
            self._add_section(f"epsilon{n}", s.young_modulus, "Pa", 0, (k,), f"Young modulus {n}")
            self._add_section(f"d{n}", s.width, "m", 1, (k,), f"section width {n}")
        place = (at(k, slots.TIP_MASS),)
        self._add_nonnegative(f"mt{n}", s.tip_mass, "kg", place, f"mass at the tip of {n}", 0.1)
        place = (at(k, slots.TIP_INERTIA),)
        title = f"inertia at the tip of {n}"
        self._add_nonnegative(f"Jt{n}", s.tip_inertia, "kg m²", place, title, 0.01)
        self._add_hub(k, s, kind.inertia_unit)
        self._add_rotor(k, s)

    def _add_hub(self, k: int, s: Segment, unit: str) -> None:
        name, title = f"Jh{k + 1}", f"rotor and gear inertia of joint {k + 1}"
        place = slots.slot(k, slots.HUB_INERTIA)
        if s.joint_compliance is None or s.hub_inertia == 0.0:
            self._add_nonnegative(name, s.hub_inertia, unit, (place,), title, 0.01)
        else:
            parameter = self._positive(name, s.hub_inertia, unit, title)
            self._add(parameter, _AtLeast(place, LEAST_MOTOR * s.hub_inertia))

    def _add_rotor(self, k: int, s: Segment) -> None:
        """Of a motor without a gear; at the first joint it counts as the hub does."""
        if self.arm.carries_motor(k):
            title = f"rotor inertia of joint {k + 1}, without a gear"
            place = (slots.slot(k, slots.ROTOR_INERTIA),)
            self._add_nonnegative(f"Jr{k + 1}", s.rotor_inertia, "kg m²", place, title, 0.01)

    def _add_compliances(self) -> None:
        """Of elastic joints and of an elastic base; a rigid one has none to estimate."""
        for k, s in enumerate(self.arm.segments):
            if s.joint_compliance is not None:
                kind = joint(s.joint)
                unit = f"{kind.coordinate_unit}/({kind.effort_unit})"
                title = f"compliance of joint {k + 1}"
                place = slots.slot(k, slots.TWIST_STIFFNESS)
                self._add_compliance(f"c{k + 1}", s.joint_compliance, unit, place, title)
        if self.arm.base_compliance is not None:
            place = slots.base_slot(self.arm.joints)
            self._add_compliance("cb", self.arm.base_compliance, "m/N", place, "base compliance")

    def _add_compliance(self, name: str, value: float, unit: str, place: int, title: str) -> None:
        lower, upper = value / COMPLIANCE_BOUND, value * COMPLIANCE_BOUND
        sign = symbol(name)
        parameter = Parameter(name, value, unit, lower, upper, sign, title, scale=value)
        self._add(parameter, _Inverse(place))

    def _add_shared(self) -> None:
        """epsilon, d and EI of all bending segments at once, where they are equal."""
        bending = tuple(k for k, s in enumerate(self.arm.segments) if s.modes)
        stiffness = {self.arm.segments[k].bending_stiffness for k in bending}
        if len(stiffness) == 1:
            places = tuple(slots.slot(k, slots.STIFFNESS) for k in bending)
            self._add_positive("EI", stiffness.pop(), "N m²", places, "bending stiffness")
        with_section = tuple(k for k, s in enumerate(self.arm.segments) if s.has_section)
        sections = {
            (self.arm.segments[k].young_modulus, self.arm.segments[k].width) for k in with_section
        }
        if len(sections) == 1:
            modulus, width = sections.pop()
            assert modulus is not None and width is not None
            self._add_section("epsilon", modulus, "Pa", 0, with_section, "Young modulus")
            self._add_section("d", width, "m", 1, with_section, "width of the square section")

    def _add(self, parameter: Parameter, writer: Writer) -> None:
        self.entries[parameter.name] = _Entry(parameter, writer)

    def _positive(self, name: str, value: float, unit: str, title: str) -> Parameter:
        value = float(value)
        lower, upper = value / RELATIVE_BOUND, value * RELATIVE_BOUND
        return Parameter(name, value, unit, lower, upper, symbol(name), title, scale=value)

    def _add_positive(
        self, name: str, value: float, unit: str, places: tuple[int, ...], title: str
    ) -> None:
        self._add(self._positive(name, value, unit, title), _Direct(places))

    def _add_section(
        self, name: str, value: float, unit: str, row: int, segments: tuple[int, ...], title: str
    ) -> None:
        self._add(self._positive(name, value, unit, title), _Section(row, segments))

    def _add_nonnegative(
        self,
        name: str,
        value: float,
        unit: str,
        places: tuple[int, ...],
        title: str,
        typical: float,
    ) -> None:
        scale = value or typical
        upper = 100.0 * scale
        parameter = Parameter(name, value, unit, 0.0, upper, symbol(name), title, scale=scale)
        self._add(parameter, _Direct(places))

    def _add_signed(
        self, name: str, value: float, unit: str, places: tuple[int, ...], title: str
    ) -> None:
        bound = max(GRAVITY_BOUND, 2.0 * abs(value))
        parameter = Parameter(name, value, unit, -bound, bound, symbol(name), title, scale=1.0)
        self._add(parameter, _Direct(places))


_GREEK = {"epsilon": r"\varepsilon", "tau": r"\tau", "lambda": r"\lambda", "EI": "EI"}
_LETTERS = {name: (name[0], name[1]) for name in ("mt", "Jt", "Jh", "Jr", "kt")}


def symbol(name: str) -> str:
    """A parameter's name as LaTeX: 'EI1' -> 'EI_{1}', 'Jh2' -> 'J_{h2}'."""
    stem = name.rstrip("0123456789")
    index = name[len(stem) :]
    letter, sub = _LETTERS.get(stem, (_GREEK.get(stem, stem), ""))
    return f"{letter}_{{{sub}{index}}}" if sub or index else letter
