"""What a scenario says of the rig: its drive, its sensors, what is in its model, and its limits."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from ..arm.mount import Mount
from ..recording.spec import Interval, NonNegative, Positive, Real, Settings, Switch, Words
from ..sensors import mounted_channels, sensors
from ..validation import gathered

MOST_OWN = 20
"""Formulas of a scenario; deriving and compiling one takes a second at its first use."""


class DriveSpec(Settings):
    """`[drive]`: the kind of drive and its settings."""

    kind: Words = "velocity_loop"
    """Id of a drive."""
    options: dict[str, Any] = Field(default_factory=dict)
    """In the file they are keys of `[drive]` itself, beside `kind`."""

    @model_validator(mode="before")
    @classmethod
    def _gather_options(cls, data: Any) -> Any:
        return gathered(data, lambda key: key not in cls.model_fields, "options")

    @model_serializer
    def _flat(self) -> dict[str, Any]:
        return {"kind": self.kind, **self.options}


class PriorSpec(Settings):
    """Prior knowledge of a parameter: a value (else its start) and a standard deviation."""

    std: Positive
    """Standard deviation, in the parameter's SI unit."""
    value: Real | None = None
    """None: its start."""


def _std_as_prior(value: Any) -> Any:
    return {"std": value} if isinstance(value, int | float) else value


def _start_as_table(value: Any) -> Any:
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    return {"start": value} if plain else value


Prior = Annotated[PriorSpec, BeforeValidator(_std_as_prior)]


class EffectParameterSpec(Settings):
    """A parameter of an effect: where it starts, and whether it is estimated."""

    start: Real | None = None
    """None: a plausible size."""
    vary: Switch = True
    """Whether it is estimated."""
    lower: Real | None = None
    """None: that of the catalogue."""
    upper: Real | None = None
    """None: that of the catalogue."""
    prior: Prior | None = None
    """A table with std and value, or the std alone."""

    @model_validator(mode="after")
    def _start_within_bounds(self) -> EffectParameterSpec:
        low, high = self.lower, self.upper
        if low is not None and high is not None and low >= high:
            raise ValueError(f"has the bounds [{low:g}, {high:g}]; the lower must be less.")
        below = self.start is not None and low is not None and self.start < low
        above = self.start is not None and high is not None and self.start > high
        if below or above:
            raise ValueError(
                f"starts at {self.start:g}, outside its bounds; move the start or the bounds."
            )
        return self


class OwnParameterSpec(EffectParameterSpec):
    """A parameter of an own effect; it needs a start."""

    start: Real
    """In `unit`."""
    unit: str = ""
    """SI, for display."""


class EffectSpec(Settings):
    """One entry of `[model] effects`: its id and, beside it, its parameters."""

    model_config = ConfigDict(frozen=True, extra="allow")
    __pydantic_extra__: dict[
        str, Annotated[EffectParameterSpec, BeforeValidator(_start_as_table)]
    ] = Field(init=False)

    id: Words
    """Of an effect in the catalogue. Its parameters are keys beside it: a number (the start) or a
    table."""

    @property
    def parameters(self) -> dict[str, EffectParameterSpec]:
        """Name of a parameter -> its settings."""
        return dict(self.__pydantic_extra__)

    @classmethod
    def known_settings(cls) -> list[str]:
        """Keys of a parameter's table; beside the id any key is allowed."""
        return list(EffectParameterSpec.model_fields)


class OwnSpec(Settings):
    """One `[[model.own]]`: a formula for a joint torque, a tip force or a sensor's reading."""

    target: Words
    """joint1, joint2, ... in N m (N on a slide); tip1, tip2: a component in N; or a sensor's
    channel, such as z1, in its unit."""
    formula: Words
    """Of the states theta1, dtheta1, delta1 (m), ddelta1, ..., the drives' torques u1, ..., the
    time t in s, the recorded input1, input2, input3, and the parameters. In a channel: of the
    channels of its sensor, t and the parameters."""
    parameters: dict[str, Annotated[OwnParameterSpec, BeforeValidator(_start_as_table)]] = Field(
        default_factory=dict
    )
    """Name -> a start, or a table."""
    id: Words | None = None
    """None: own_1, own_2, ..."""
    title: Words | None = None
    """For display."""


class ModelSpec(Settings):
    """`[model]`: its level, the effects in it, and effects that the user wrote."""

    level: Literal["auto", "lpv", "nonlinear"] = "auto"
    """auto: the linear model where it is as accurate as the full equations on the recordings'
    motions, else the full equations."""
    effects: Annotated[tuple[EffectSpec, ...], Field(max_length=50)] = ()
    """Each with an id and its parameters; 50 at most."""
    own: Annotated[tuple[OwnSpec, ...], Field(max_length=MOST_OWN)] = ()
    """Effects as formulas."""


class SensorsSpec(Settings):
    """`[sensors]`: standard deviations of the noise, SI; None where not stated."""

    camera_noise: NonNegative | None = None
    """m"""
    encoder_noise: NonNegative | None = None
    """rad or m"""
    deflection_noise: NonNegative | None = None
    """rad"""
    torque_noise: NonNegative | None = None
    """N m or N"""
    rates_noise: NonNegative | None = None
    """rad/s, of ydot"""
    camera_rate: Positive | None = None
    """Hz; the rig's own rate where not stated."""
    further: dict[str, NonNegative] = Field(default_factory=dict)
    """Noise of further sensors, under the key that the sensor's class names; in the file they
    are keys beside the others."""
    mounts: dict[str, Mount] = Field(default_factory=dict)
    """Channel of a link's sensor -> where it sits; in the file a table of the channel's name."""

    @model_validator(mode="before")
    @classmethod
    def _gather_further(cls, data: Any) -> Any:
        named = {sensor.noise for sensor in sensors().values()} - {"", *cls.model_fields}
        with_noise = gathered(data, lambda key: key in named, "further")
        return gathered(with_noise, lambda key: key in mounted_channels(), "mounts")

    @model_serializer(mode="wrap")
    def _flat(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        table: dict[str, Any] = handler(self)
        nested = {**table.pop("further", {}), **table.pop("mounts", {})}
        return {**table, **nested}

    @classmethod
    def known_settings(cls) -> list[str]:
        """Keys of `[sensors]`."""
        named = sorted({sensor.noise for sensor in sensors().values()} - {"", *cls.model_fields})
        plain = [name for name in cls.model_fields if name not in ("further", "mounts")]
        return [*plain, *named, *mounted_channels()]

    def noise_of(self, setting: str) -> float | None:
        """The standard deviation that a setting states, SI; None where it states none."""
        if setting in self.further:
            return self.further[setting]
        value: float | None = getattr(self, setting, None) if setting else None
        return value


def _number_as_list(value: Any) -> Any:
    """One number stands for every joint."""
    return (value,) if isinstance(value, int | float) else value


def _pair_as_list(value: Any) -> Any:
    """One [low, high] stands for every joint."""
    flat = isinstance(value, list | tuple) and value and not isinstance(value[0], list | tuple)
    return (value,) if flat else value


PerJoint = Annotated[tuple[Positive, ...], BeforeValidator(_number_as_list)]
Ranges = Annotated[tuple[Interval, ...], BeforeValidator(_pair_as_list)]


class LimitsSpec(Settings):
    """`[limits]`: the largest values in a planned experiment.

    Each is one value for all joints or a list with one per joint. Default: the largest value of
    the model's motion on the estimation data.
    """

    position: Ranges | None = None
    """rad (m on a slide), [low, high] per joint."""
    speed: PerJoint | None = None
    """rad/s (m/s on a slide), per joint."""
    torque: PerJoint | None = None
    """N m (N on a slide), per joint."""
    reach: tuple[Interval, Interval] | None = None
    """m, [low, high] of z1 and of z2 for the tip; None: not limited beyond the joints."""


class RigSpec(Settings):
    """`[rig]`: prior knowledge of the rig. A diagnosis does not try effects that it excludes, and
    the verdict names them.
    """

    level: Annotated[Switch, Field(title="the rig is level")] = False
    """The arm moves in a level plane: no tilted base plate."""
    rigid_base: Annotated[Switch, Field(title="the base is rigid")] = False
    """The base does not move: no soft base."""
    direct_drive: Annotated[Switch, Field(title="the joints have no gears")] = False
    """No elastic joint, no backlash, no load-dependent friction. A rotor turns with the link that
    carries it."""
    gear_ratio: Annotated[PerJoint | None, Field(title="the joints have gears")] = None
    """Turns of the motor per turn of the joint. If all are above 1, no rotor turns with the link
    that carries it; if all are 1, this equals direct_drive. It converts no signal: drives have
    constants of their own."""
    camera_synchronised: Annotated[Switch, Field(title="the camera is synchronised")] = False
    """Its timestamps are right: no camera delay."""
    gauges_calibrated: Annotated[Switch, Field(title="the strain gauges are calibrated")] = False
    """The scale of their signals is right."""
    encoders_calibrated: Annotated[Switch, Field(title="the encoders are calibrated")] = False
    """Their scale and their zero are right."""

    @model_validator(mode="after")
    def _one_kind_of_drive(self) -> RigSpec:
        if self.direct_drive and max(self.gear_ratio or (1.0,)) > 1.0:
            raise ValueError("states direct_drive and a gear_ratio above 1; remove one.")
        return self

    @classmethod
    def words(cls) -> dict[str, str]:
        """Key of each statement -> its text."""
        return {name: str(field.title) for name, field in cls.model_fields.items()}

    @property
    def statements(self) -> dict[str, str]:
        """The statements that are made: key -> text."""
        ratios = self.gear_ratio or ()
        holds = dict(self) | {
            "direct_drive": self.direct_drive or set(ratios) == {1.0},
            "gear_ratio": bool(ratios) and min(ratios) > 1.0,
        }
        return {name: words for name, words in self.words().items() if holds[name]}
