"""The parameters of an arm by name, and how their values enter the vector p."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from ..arm import slots
from ..arm.arm import Arm
from ..arm.joints import joint
from ..arm.segment import Segment
from ..parameters import Parameter

GRAVITY_BOUND = 20.0
"""m/s^2: no rig on Earth needs more in one component."""

RELATIVE_BOUND = 10.0
"""Positive parameters may move by this factor when the user states no bounds."""


COMPLIANCE_BOUND = 1e3
"""Springs of joints and bases differ by orders of magnitude between rigs."""

LEAST_COMPLIANCE = 1e-9
"""rad/(N m), m/N: as good as rigid; an infinite stiffness could not be simulated."""

LEAST_MOTOR = 1e-2
"""Share of the stated hub inertia: the motor of an elastic joint needs an inertia above zero."""


def _direct(places: Sequence[int], p: np.ndarray, section: np.ndarray, value: np.ndarray) -> None:
    """Writes one value into fixed places of p."""
    p[:, places] = value[:, None]


def _at_least(
    place: int, least: float, p: np.ndarray, section: np.ndarray, value: np.ndarray
) -> None:
    """Writes one value, or the smallest that makes sense, into one place of p."""
    p[:, place] = np.maximum(value, least)


def _inverse(place: int, p: np.ndarray, section: np.ndarray, value: np.ndarray) -> None:
    """Writes the stiffness of a stated compliance into one place of p."""
    p[:, place] = 1.0 / np.maximum(value, LEAST_COMPLIANCE)


def _of_section(
    row: int, segments: Sequence[int], p: np.ndarray, section: np.ndarray, value: np.ndarray
) -> None:
    """Writes a modulus (row 0) or a width (row 1) of some segments; EI follows."""
    section[:, row, segments] = value[:, None]
    for k in segments:
        stiffness = section[:, 0, k] * section[:, 1, k] ** 4 / 12.0
        p[:, slots.slot(k, slots.STIFFNESS)] = stiffness


_Write = Callable[[np.ndarray, np.ndarray, np.ndarray], None]
"""From values (S,) into p (S, np), and into moduli and widths (S, 2, segments)."""


class _Entry(NamedTuple):
    parameter: Parameter
    write: _Write


class ArmCatalogue:
    """All parameters of an arm: `entries[name].parameter`, and `vectors` to compute p."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.base = slots.arm_vector(arm)
        segments = arm.segments
        self._section = np.array(
            [[s.young_modulus or np.nan for s in segments], [s.width or np.nan for s in segments]]
        )
        self._centred = [k for k, s in enumerate(segments) if s.centre_of_mass is None]
        self._uniform = [k for k, s in enumerate(segments) if s.inertia is None]
        self.entries: dict[str, _Entry] = {}
        for k, s in enumerate(arm.segments):
            self._add_segment(k, s)
        self._add_compliances()
        self._add_shared()
        for i, value in enumerate(arm.gravity):
            most = max(GRAVITY_BOUND, 2.0 * abs(value))
            write = partial(_direct, (slots.gravity_slot(arm.joints, i),))
            title = f"gravity component {i + 1}"
            self._add(f"g{i + 1}", value, "m/s²", title, write, (-most, most), 1.0)

    @property
    def parameters(self) -> dict[str, Parameter]:
        """The arm's parameters by name, each with its unit."""
        return {name: entry.parameter for name, entry in self.entries.items()}

    def vectors(self, names: Sequence[str], values: np.ndarray) -> np.ndarray:
        """p (S, 13 N + 5) for S vectors of `values` (S, names); the rest as in the arm."""
        p, section = (np.repeat(x[None], len(values), axis=0) for x in (self.base, self._section))
        for i, name in enumerate(names):
            self.entries[name].write(p, section, values[:, i])
        self._spread_evenly(p, names)
        return p

    def _spread_evenly(self, p: np.ndarray, names: Sequence[str]) -> None:
        """Lets centres and inertias that are neither stated nor among the names follow length and
        mass."""
        each = (len(p), len(self.arm.segments), slots.PER_SEGMENT)
        rows = p[:, : each[1] * each[2]].reshape(each)
        centred = [k for k in self._centred if f"xc{k + 1}" not in names]
        uniform = [k for k in self._uniform if f"Jc{k + 1}" not in names]
        rows[:, centred, slots.CENTRE_ALONG] = rows[:, centred, slots.LENGTH] / 2.0
        inertia = rows[:, :, slots.MASS] * rows[:, :, slots.LENGTH] ** 2 / 12.0
        rows[:, uniform, slots.INERTIA] = inertia[:, uniform]

    def _add_segment(self, k: int, s: Segment) -> None:
        n = k + 1

        def into(which: int) -> _Write:
            return partial(_direct, (slots.slot(k, which),))

        self._add_positive(f"l{n}", s.length, "m", f"length of segment {n}", into(slots.LENGTH))
        self._add_positive(f"m{n}", s.mass, "kg", f"mass of segment {n}", into(slots.MASS))
        if s.modes:
            title = f"bending stiffness of segment {n}"
            write = into(slots.STIFFNESS)
            self._add_positive(f"EI{n}", s.bending_stiffness, "N m²", title, write)
            title, write = f"damping time of segment {n}", into(slots.DAMPING_TIME)
            self._add_nonnegative(f"tau{n}", s.damping_time, "s", title, write, 1e-3)
        else:
            self._add_distribution(n, s, into)
        if s.has_section:
            self._add_section(str(n), (k,), f"Young modulus {n}", f"section width {n}")
        title, write = f"mass at the tip of {n}", into(slots.TIP_MASS)
        self._add_nonnegative(f"mt{n}", s.tip_mass, "kg", title, write, 0.1)
        title, write = f"inertia at the tip of {n}", into(slots.TIP_INERTIA)
        self._add_nonnegative(f"Jt{n}", s.tip_inertia, "kg m²", title, write, 0.01)
        unit, title = joint(s.joint).inertia_unit, f"rotor and gear inertia of joint {n}"
        if s.joint_compliance is None or s.hub_inertia == 0.0:
            write = into(slots.HUB_INERTIA)
            self._add_nonnegative(f"Jh{n}", s.hub_inertia, unit, title, write, 0.01)
        else:
            place = slots.slot(k, slots.HUB_INERTIA)
            write = partial(_at_least, place, LEAST_MOTOR * s.hub_inertia)
            self._add_positive(f"Jh{n}", s.hub_inertia, unit, title, write)
        if self.arm.carries_motor(k):  # at the first joint it counts as the hub does
            title, write = f"rotor inertia of joint {n}, without a gear", into(slots.ROTOR_INERTIA)
            self._add_nonnegative(f"Jr{n}", s.rotor_inertia, "kg m²", title, write, 0.01)

    def _add_distribution(self, n: int, s: Segment, into: Callable[[int], _Write]) -> None:
        """Centre of mass and inertia of a rigid segment."""
        ways = ("x", "along", slots.CENTRE_ALONG), ("y", "across", slots.CENTRE_ACROSS)
        for (letter, way, which), value in zip(ways, s.centre, strict=True):
            most = max(s.length, 2.0 * abs(value))
            title = f"centre of mass of segment {n}, {way}"
            self._add(
                f"{letter}c{n}",
                value,
                "m",
                title,
                into(which),
                (-most, most),
                abs(value) or s.length,
            )
        title, write = f"inertia of segment {n} about its centre of mass", into(slots.INERTIA)
        self._add_positive(f"Jc{n}", s.central_inertia, "kg m²", title, write)

    def _add_compliances(self) -> None:
        """Of elastic joints, an elastic base and a pedestal; a rigid one has none to estimate."""
        for k, s in enumerate(self.arm.segments):
            if s.joint_compliance is not None:
                unit = joint(s.joint).compliance_unit
                write = partial(_inverse, slots.slot(k, slots.TWIST_STIFFNESS))
                title = f"compliance of joint {k + 1}"
                bound = COMPLIANCE_BOUND
                self._add_positive(f"c{k + 1}", s.joint_compliance, unit, title, write, bound)
        soft = self.arm.base_compliance
        if soft is not None:
            write = partial(_inverse, slots.base_slot(self.arm.joints))
            self._add_positive("cb", soft, "m/N", "base compliance", write, COMPLIANCE_BOUND)
        if (pedestal := self.arm.pedestal) is not None:
            spring, inertia = slots.pedestal_slots(self.arm.joints)
            title, write = "compliance of the pedestal", partial(_inverse, spring)
            bound = COMPLIANCE_BOUND
            self._add_positive("cp", pedestal.compliance, "rad/(N m)", title, write, bound)
            title, place = "inertia of the pedestal", (inertia,)
            write = partial(_direct, place)
            self._add_positive("Jp", pedestal.inertia, "kg m²", title, write, bound)

    def _add_shared(self) -> None:
        """epsilon, d and EI of all bending segments at once, where they are equal."""
        segments = self.arm.segments
        bending = tuple(k for k, s in enumerate(segments) if s.modes)
        stiffness = {segments[k].bending_stiffness for k in bending}
        if len(stiffness) == 1:
            write = partial(_direct, tuple(slots.slot(k, slots.STIFFNESS) for k in bending))
            self._add_positive("EI", stiffness.pop(), "N m²", "bending stiffness", write)
        alike = tuple(k for k, s in enumerate(segments) if s.has_section)
        if len({(segments[k].young_modulus, segments[k].width) for k in alike}) == 1:
            self._add_section("", alike, "Young modulus", "width of the square section")

    def _add_section(self, index: str, segments: tuple[int, ...], modulus: str, width: str) -> None:
        """epsilon and d of segments that have the same."""
        s = self.arm.segments[segments[0]]
        assert s.young_modulus is not None and s.width is not None
        write = partial(_of_section, 0, segments), partial(_of_section, 1, segments)
        self._add_positive(f"epsilon{index}", s.young_modulus, "Pa", modulus, write[0])
        self._add_positive(f"d{index}", s.width, "m", width, write[1])

    def _add(
        self, name: str, value: float, unit: str, title: str, write: _Write,
        bounds: tuple[float, float], scale: float,
    ) -> None:  # fmt: skip
        parameter = Parameter(name, value, unit, *bounds, symbol(name), title, scale=scale)
        self.entries[name] = _Entry(parameter, write)

    def _add_positive(
        self, name: str, value: float, unit: str, title: str, write: _Write,
        bound: float = RELATIVE_BOUND,
    ) -> None:  # fmt: skip
        bounds = float(value) / bound, float(value) * bound
        self._add(name, float(value), unit, title, write, bounds, float(value))

    def _add_nonnegative(
        self, name: str, value: float, unit: str, title: str, write: _Write, typical: float
    ) -> None:
        scale = value or typical
        self._add(name, value, unit, title, write, (0.0, 100.0 * scale), scale)


@lru_cache(maxsize=64)
def arm_parameters(arm: Arm) -> Mapping[str, Parameter]:
    """All parameters of an arm by name, each with its unit."""
    return ArmCatalogue(arm).parameters


_GREEK = {"epsilon": r"\varepsilon", "tau": r"\tau", "lambda": r"\lambda"}


def symbol(name: str) -> str:
    """A parameter's name as LaTeX, the second of two small letters below the first: 'EI1' ->
    'EI_{1}', 'Jh2' -> 'J_{h2}', 'td' -> 't_{d}'."""
    stem = name.rstrip("0123456789")
    index = name[len(stem) :]
    below = stem[1:] if len(stem) == 2 and stem[1].islower() else ""
    letter = _GREEK.get(stem, stem.removesuffix(below))
    return f"{letter}_{{{below}{index}}}" if below or index else letter
