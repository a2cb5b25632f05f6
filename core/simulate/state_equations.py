"""The model in statements, from the same text and numbers that are compiled and simulated.

The arm's statements are those of its generated module, a force's those of its law; drive, ports and
solution of M q'' = f are written out around them, without the products with zero.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..arm.arm import Arm, Structure
from ..arm.compiled import statements_of
from ..arm.joints import joint
from ..arm.solvers import solve_positive
from ..drives.law import law_arrays
from ..errors import InputError
from ..forces.element import Element
from ..forces.generate import plain_text
from ..model import Model, Numbers
from ..recording.channels import channel_kind, is_channel, joint_of
from ..results.state_equations import Quantity, StateEquations, per_second
from ..sensors import sensors
from ..sensors.camera import Camera
from ..sensors.motor_torque import MotorTorque
from ..sensors.sensor import Sensor
from ..trajectory import Trajectory

_ENTRY = re.compile(r"\b([A-Za-z]+)\[(\d+)(?:, (\d+))?\]")
_LOCAL = re.compile(r"\b([sc]\d+)\b")
ZERO_TEXTS = ("0.0", "-0.0")

Texts = np.ndarray
"""Of strings: what stands in a statement for each number of an array."""


def state_equations(model: Model, values: Mapping[str, float]) -> StateEquations | None:
    """x' and y of a model at parameter values (SI), drive and forces included.

    None where the model has no drive that gives the torque of every joint: some follow their
    recorded positions.
    """
    if not model.drive.torque_known or model.drive.torque_unknown:
        return None
    known = {name: value for name, value in values.items() if name in model.parameters}
    numbers = model.numbers(known)
    seen = _linear_sensors(model, numbers)
    arrays = _arrays(model, numbers, seen)
    texts, parameters = _with_parameters(
        model, known, arrays, lambda changed: _arrays(model, model.numbers(changed), seen)
    )
    writer = _Writer(model, numbers, texts)
    arm = model.arm
    measured = [channel for sensor in seen for channel in sensor.channels(arm)]
    measured += [*Camera().channels(arm), *MotorTorque().channels(arm)]
    return StateEquations(
        states=_states(model, numbers),
        coordinates=arm.coordinates,
        inputs=tuple(Quantity(name, _unit(name, arm)) for name in _inputs(model, numbers)),
        outputs=tuple(Quantity(channel.name, channel.unit) for channel in measured),
        parameters=parameters,
        statements=tuple(_once(writer.statements())),
    )


def _once(statements: Sequence[str]) -> list[str]:
    """Without names that are given the same value again: tip and dynamics load the same ones."""
    known: set[str] = set()
    kept = []
    for line in statements:
        name = line.partition(" = ")[0]
        if "[" in name or name not in known:
            kept.append(line)
        known.add(name)
    return kept


def _inputs(model: Model, numbers: Numbers) -> tuple[str, ...]:
    return (*numbers.inputs, *model.drive.reference_channels(model.arm))


def _unit(name: str, arm: Arm) -> str:
    """SI unit of a signal; the second of its family on a slide."""
    if not is_channel(name):
        return ""
    units, k = channel_kind(name).units, joint_of(name)
    return units[-1 if k is not None and _slides(arm, k) else 0]


def _slides(arm: Arm, k: int) -> bool:
    return joint(arm.segments[k].joint).coordinate_unit == "m"


def _states(model: Model, numbers: Numbers) -> tuple[Quantity, ...]:
    arm, own = model.arm, numbers.law.states
    places = [joint(s.joint).coordinate_unit for s in arm.segments]
    shapes = ["1/m" if i == 0 else f"1/m{'²³'[i - 1]}" for m in arm.modes for i in range(m)]
    twists = [unit for unit, elastic in zip(places, arm.elastic, strict=True) if elastic]
    base = ["m", "m"] if arm.base_compliance is not None else []
    units = [*places, *shapes, *twists, *base, *(["rad"] if arm.pedestal is not None else [])]
    names = arm.coordinate_names
    count = sum(len(e.law.states) for e in numbers.elements)
    return (
        *map(Quantity, names, units),
        *map(Quantity, [f"d{name}" for name in names], map(per_second, units)),
        *(Quantity(f"s{i + 1}", "", title="state of the drive") for i in range(own)),
        *(Quantity(f"w{i + 1}", "", title="state of a force") for i in range(count)),
    )


def _linear_sensors(model: Model, numbers: Numbers) -> list[Sensor]:
    """Those whose rows are what they read of any motion, as random states show."""
    arm, samples = model.arm, 3
    rng = np.random.default_rng(0)
    q, v = rng.uniform(-1.0, 1.0, (2, samples, arm.coordinates))
    torque = rng.uniform(-1.0, 1.0, (samples, arm.joints))
    motion = Trajectory(arm, model.compiled, numbers.p, np.arange(samples) * 1.0, q, v, torque)
    found = []
    for sensor in sensors().values():
        if not sensor.defined_on(arm) or not sensor.is_stated(arm):
            continue
        rows = sensor.rows(arm, numbers.p, numbers.law)
        if rows is not None and len(rows.Q):
            read = sensor.measure(motion)
            if np.allclose(read, q @ rows.Q.T + v @ rows.V.T, rtol=1e-9):
                found.append(sensor)
    return found


def _arrays(model: Model, numbers: Numbers, seen: Sequence[Sensor]) -> list[np.ndarray]:
    """All numbers that stand in the statements: of arm, drive, sensors and forces."""
    n, law = model.arm.coordinates, numbers.law
    rows = [sensor.rows(model.arm, numbers.p, law) for sensor in seen]
    read = [np.vstack([np.hstack([r.Q, r.V]) for r in rows if r is not None])]
    forces = [a for e in _ordered(numbers) for a in (e.rows(n), np.array(e.values, dtype=float))]
    return [numbers.p, *law_arrays(law), *read, *forces]


def _ordered(numbers: Numbers) -> list[Element]:
    """In the order of their states in a simulation."""
    return sorted(numbers.elements, key=lambda element: element.law.bristle)


FORMS: tuple[tuple[str, Callable[[float], float]], ...] = (
    ("k[{}]", lambda value: value),
    ("(1.0/k[{}])", lambda value: 1.0 / value),
)
"""How a parameter may stand in the statements, times a number: as the inertia that a mass spread
evenly has, or a compliance as the stiffness that it is."""


def _with_parameters(
    model: Model, known: Mapping[str, float], arrays: Sequence[np.ndarray],
    remade: Callable[[Mapping[str, float]], list[np.ndarray]],
) -> tuple[list[Texts], tuple[Quantity, ...]]:  # fmt: skip
    """What stands for each number, and the parameters that do: those which, moved, move no number
    that matters but in proportion to them."""
    flat = np.concatenate(arrays, axis=None)
    texts = np.array([repr(float(x)) for x in flat], dtype=object)
    free, matters = np.ones(len(flat), dtype=bool), _in_use(model.arm, arrays)
    found: list[Quantity] = []
    for item in model.parameters.values():
        now = known.get(item.name, item.value)
        moved = 1.25 * now or item.scale
        try:
            changed = np.concatenate(remade({**known, item.name: moved}), axis=None)
        except (InputError, ValueError, ArithmeticError):
            continue
        if len(changed) != len(flat):
            continue
        places = np.flatnonzero((changed != flat) & matters)
        for form, value_of in FORMS if len(places) and free[places].all() else ():
            shares = changed[places] / value_of(moved)
            if np.allclose(
                shares * value_of(now) if now else 0.0, flat[places], rtol=1e-12, atol=0
            ):
                texts[places] = [_scaled(s, form.format(len(found))) for s in shares]
                free[places] = False
                found.append(Quantity(item.name, item.unit, now, item.title))
                break
    starts = np.cumsum([a.size for a in arrays])[:-1]
    parts = [t.reshape(a.shape) for t, a in zip(np.split(texts, starts), arrays, strict=True)]
    return parts, tuple(found)


def _in_use(arm: Arm, arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Bool of each number: whether the statements use it. The arm's stand first; of a bending
    segment some have no place."""
    used = np.ones(sum(a.size for a in arrays), dtype=bool)
    lines = [s for name in ("tip", "dynamics") for s in statements_of(Structure.of(arm), name)]
    wanted = {int(i) for line in lines for array, i, _ in _ENTRY.findall(line) if array == "p"}
    used[: arrays[0].size] = [i in wanted for i in range(arrays[0].size)]
    return used


def _scaled(share: float, text: str) -> str:
    return text if np.isclose(share, 1.0, rtol=1e-12, atol=0.0) else f"({float(share)!r}*{text})"


def _sum(coefficients: Sequence[str], symbols: Sequence[str], sign: str = "") -> list[str]:
    """The terms of a product of two vectors, those with zero left out."""
    pairs = zip(coefficients, symbols, strict=True)
    return [f"{sign}{c}*{symbol}" for c, symbol in pairs if c not in ZERO_TEXTS]


def _total(*terms: list[str]) -> str:
    return " + ".join(sum(terms, [])) or "0.0"


class _Writer:
    """Writes the statements of one model; arrays are x, r, k, M, f, z and J."""

    def __init__(self, model: Model, numbers: Numbers, texts: Sequence[Texts]) -> None:
        self.model, self.numbers, self.n = model, numbers, model.arm.coordinates
        self.joints = model.arm.joints
        p, *self.law = texts[:10]
        self.read, *self.forces = texts[10:]
        n, ns = self.n, numbers.law.states
        self.q = [f"x[{i}]" for i in range(n)]
        self.v = [f"x[{n + i}]" for i in range(n)]
        self.arrays = {"q": self.q, "v": self.v, "p": list(p)}
        self.s = [f"x[{2 * n + i}]" for i in range(ns)]
        first = len(numbers.inputs)
        self.r = [f"r[{first + i}]" for i in range(numbers.law.references)]
        self.first_w = 2 * n + ns

    def statements(self) -> list[str]:
        """All of them, in their order."""
        structure = Structure.of(self.model.arm)
        lines = [self._arm(line) for line in statements_of(structure, "tip")]
        lines += self._drive()
        lines += [self._arm(line) for line in statements_of(structure, "dynamics")]
        lines += [f"f[{i}] += u_{i}" for i in range(self.joints)]
        lines += self._elements()
        for line in solve_positive(self.n):
            lines.append(re.sub(r"\bb\[", "f[", re.sub(r"\bA\[", "M[", line)))
        lines += [f"rates[{i}] = {v}" for i, v in enumerate(self.v)]
        lines += [f"rates[{self.n + i}] = f[{i}]" for i in range(self.n)]
        outputs = [_total(_sum(row, [*self.q, *self.v])) for row in self.read]
        outputs += ["z[0]", "z[1]", *(f"u_{i}" for i in range(self.joints))]
        return lines + [f"y[{i}] = {text}" for i, text in enumerate(outputs)]

    def _arm(self, line: str) -> str:
        """A statement of the arm with the entries of its arrays."""

        def place(match: re.Match[str]) -> str:
            array, i, j = match[1], int(match[2]), match[3]
            if j is not None:
                return f"{array}[{i * self.n + int(j)}]"
            return self.arrays[array][i] if array in self.arrays else match[0]

        return _ENTRY.sub(place, line)

    def _drive(self) -> list[str]:
        R, P, V, S, Fs, Fq, Fv, Fr, _ = self.law
        lines = []
        for i, limit in enumerate(self.numbers.law.limit):
            asked = _total(
                _sum(R[i], self.r), _sum(P[i], self.q, "-"), _sum(V[i], self.v, "-"),
                _sum(S[i], self.s, "-"),
            )  # fmt: skip
            most = self.law[8][i]
            lines.append(f"asked_{i} = {asked}")
            cut = f"min(max(asked_{i}, -({most})), {most})" if np.isfinite(limit) else f"asked_{i}"
            lines.append(f"u_{i} = {cut}")
        for i in range(len(self.s)):
            rate = _total(
                _sum(Fs[i], self.s), _sum(Fq[i], self.q), _sum(Fv[i], self.v), _sum(Fr[i], self.r)
            )
            lines.append(f"rates[{2 * self.n + i}] = {rate}")
        return lines

    def _elements(self) -> list[str]:
        lines, state = [], self.first_w
        for at, element in enumerate(_ordered(self.numbers)):
            rows, values = self.forces[2 * at : 2 * at + 2]
            lines += self._element(f"e{at}_", element, rows, values, state)
            state += len(element.law.states)
        return lines

    def _element(
        self, prefix: str, element: Element, rows: Texts, values: Texts, state: int
    ) -> list[str]:
        """The ports of one force, its law, and what it does to the arm."""
        ports, n = len(element.law.x), self.n
        rows, places = rows.copy(), [_total(_sum(row, self.q)) for row in rows]
        if element.at_tip:
            rows[:2] = np.array([f"J[{i}]" for i in range(2 * n)], dtype=object).reshape(2, n)
            places[:2] = ["z[0]", "z[1]"]
        written = [f"u_{k}" for k in element.loads]
        written += [f"r[{self.numbers.inputs.index(name)}]" for name in element.inputs]
        forces = [f"{prefix}f{i}" for i in range(ports)]
        rates = {3 * ports + i: f"rates[{state + i}]" for i in range(len(element.law.states))}
        entries = {
            "x": places,
            "v": [_total(_sum(row, self.v)) for row in rows],
            "w": [f"x[{state + i}]" for i in range(len(element.law.states))],
            "e": [*values[: len(values) - len(written)], *written],
            "out": [rates.get(i, f"{prefix}o{i}") for i in range(element.law.size)],
        }
        entries["out"][:ports] = forces
        body = plain_text(element.law).partition("def element(x, v, w, e, out):\n")[2]
        lines = [
            _ENTRY.sub(
                lambda match: entries[match[1]][int(match[2])], _LOCAL.sub(rf"{prefix}\1", line)
            )
            for line in map(str.strip, body.splitlines())
        ]
        pushes = [
            f"f[{j}] += {term}"
            for row, force in zip(rows, forces, strict=True)
            for j in range(n)
            for term in _sum(row[j : j + 1], [force])
        ]
        return lines + pushes
