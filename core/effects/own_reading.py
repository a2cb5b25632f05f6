"""What a sensor adds to its own reading, as a formula that the user states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Rig, Values
from ..effects.formula_functions import bristles_in, with_expanded_tables
from ..effects.own import own_effect, targets
from ..effects.own_formula import check_names, effect_parameters, read_formula, size_names
from ..effects.sizes import Sizes
from ..errors import InputError
from ..parameters import Parameter
from ..recording.inputs import TIME
from ..sensors import sensors
from ..sensors.sensor import Sensor
from ..sentences import did_you_mean

ENCODER = "encoder"
PLACE_ITERATIONS = 20
"""Of the iteration for the true place; the law's slope is small, or the reading is no place."""

Change = Callable[..., np.ndarray]


@dataclass(frozen=True, kw_only=True)
class OwnReading(Effect):
    """Added to one channel of a sensor, from what all of its channels would read without it."""

    kind: str
    title: str
    story: str
    formula: str
    target: str
    sensor: str
    channels: tuple[str, ...]
    number: int
    """Of the channel that reads wrong, from 0."""
    change: Change
    own_parameters: tuple[EffectParameter, ...]
    location: str = "sensors"
    acts_at: str = "camera"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return self.own_parameters

    def not_applicable(self, rig: Rig) -> str:
        compared = self.sensor in rig.outputs or (self.sensor == ENCODER and rig.servo)
        return "" if compared else f"{self.target} is not compared."

    def sensed(self, sensor: str, y: np.ndarray, dt: float, values: Values) -> np.ndarray:
        if sensor != self.sensor:
            return y
        read = np.array(y, dtype=float)
        read[:, self.number] += self.added(y, dt, values)
        return read

    def started(self, joints: np.ndarray, values: Values) -> np.ndarray:
        return self.followed(np.atleast_2d(joints), 0.0, values).reshape(np.shape(joints))

    def followed(self, joints: np.ndarray, dt: float, values: Values) -> np.ndarray:
        if self.sensor != ENCODER:
            return joints
        true = np.array(joints, dtype=float)
        for _ in range(PLACE_ITERATIONS):
            true[:, self.number] = joints[:, self.number] - self.added(true, dt, values)
        return true

    def added(self, y: np.ndarray, dt: float, values: Values) -> np.ndarray:
        """(N,) to the channel's reading, from readings y (N, k), `dt` s apart."""
        time = dt * np.arange(len(y))
        numbers = [values[q.parameter.name] for q in self.own_parameters]
        with np.errstate(all="ignore"):
            change = self.change(time, *np.transpose(y), *numbers)
        return np.asarray(np.broadcast_to(change, (len(y),)))


def readings(arm: Arm) -> dict[str, tuple[Sensor, int]]:
    """Channels whose readings a formula may change -> their sensor, and their number in it."""
    primary = [s for s in sensors().values() if s.primary and s.defined_on(arm)]
    return {c.name: (s, i) for s in primary for i, c in enumerate(s.channels(arm))}


def own_law(
    arm: Arm, target: str, formula: str, parameters: tuple[Parameter, ...], kind: str,
    title: str = "", where: str = "[[model.own]]",
) -> Effect:  # fmt: skip
    """The effect of a formula at a joint, at the tip (`own_effect`), or in a sensor's channel.

    InputError, with `where` as the place of the settings, for all that is wrong with it.
    """
    channels = readings(arm)
    if target not in (*targets(arm), *channels):
        hint = did_you_mean(target, (*targets(arm), *channels))
        raise InputError(f"{where} target {target!r} is not known; {hint}")
    make = own_reading if target in channels else own_effect
    return make(arm, target, formula, parameters, kind, title, where)


@lru_cache(maxsize=64)
def own_reading(
    arm: Arm, target: str, formula: str, parameters: tuple[Parameter, ...], kind: str,
    title: str = "", where: str = "[[model.own]]",
) -> OwnReading:  # fmt: skip
    """What is added to a channel, in its unit: a formula of all channels of that sensor as they
    would read without it, and of the time `t`.

    InputError as of `own_effect`.
    """
    sensor, number = readings(arm)[target]
    channels = tuple(c.name for c in sensor.channels(arm))
    names = [item.name for item in parameters]
    check_names(names, where)
    expression = read_formula(formula, (*channels, TIME), names, where)
    if bristles_in(expression):
        raise InputError(f"{where} formula: a sensor's reading has no friction or hysteresis.")
    expression = with_expanded_tables(expression, f"{where} formula")
    symbols = [sp.Symbol(word, real=True) for word in (TIME, *channels, *names)]
    sizes = size_names(expression, symbols[-len(names) :] if names else [], f"{where} formula")
    quantities = effect_parameters(parameters, sizes)
    return OwnReading(
        kind=kind, title=title or f"Own law of the reading {target}",
        story=f"Your formula: added to the reading of {target}, {formula.strip()}.",
        formula=rf"\Delta {_latex(target)} = {sp.latex(expression)}",
        target=target, sensor=sensor.kind, channels=channels, number=number,
        change=sp.lambdify(symbols, expression, modules="numpy"), own_parameters=quantities,
    )  # fmt: skip


def _latex(word: str) -> str:
    return str(sp.latex(sp.Symbol(word)))
