"""What a scenario may say: one frozen table of settings per TOML table."""

from __future__ import annotations

from collections import Counter
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)

from core.arm.build import ArmSpec
from core.recording.channels import channel_names, is_channel
from core.recording.load import file_stem
from core.recording.spec import (
    Channel,
    Interval,
    NonNegative,
    Positive,
    Real,
    RecordingSpec,
    Settings,
    Switch,
    Whole,
    Words,
)
from core.recording.velocity import ZeroPhaseLowPass
from core.scenario.rig_limits import LimitsSpec
from core.sensors import sensors
from core.sentences import did_you_mean, listed, quoted
from core.validation import gathered

MOST_RECORDINGS = 500
"""Of a scenario: the longest campaigns of a rig have a tenth of that."""
MOST_SAMPLES = 1_000_000
"""Simulated in one scenario: twenty minutes at 1 kHz."""
MOST_OWN = 20
"""Formulas of a scenario; each is derived and compiled, which takes a second at its first use."""


def _known_output(kind: str) -> str:
    if kind not in sensors():
        known = listed([repr(name) for name in sorted(sensors())], "or")
        raise ValueError(f"is {quoted(kind)}; it must be {known}.")
    return kind


Output = Annotated[str, AfterValidator(_known_output)]
"""The id of a sensor."""


class DriveSpec(Settings):
    """`[drive]`: the kind, and whatever that kind of drive wants to know."""

    kind: Words = "velocity_loop"
    """Id of a drive."""
    options: dict[str, Any] = Field(default_factory=dict)
    """In the file these stand in `[drive]` itself, beside `kind`."""

    @model_validator(mode="before")
    @classmethod
    def _gather_options(cls, data: Any) -> Any:
        return gathered(data, lambda key: key not in cls.model_fields, "options")

    @model_serializer
    def _flat(self) -> dict[str, Any]:
        return {"kind": self.kind, **self.options}


class PriorSpec(Settings):
    """What is believed of a parameter beforehand: a value (else its start) and a deviation."""

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
    """A parameter of an own effect, which nobody else can give a start or a unit."""

    start: Real
    """In `unit`."""
    unit: str = ""
    """SI, for display."""


class EffectSpec(Settings):
    """One entry of `[model] effects`: its id and, beside it, what is said of its parameters."""

    model_config = ConfigDict(frozen=True, extra="allow")
    __pydantic_extra__: dict[
        str, Annotated[EffectParameterSpec, BeforeValidator(_start_as_table)]
    ] = Field(init=False)

    id: Words
    """Of an effect in the catalogue; its parameters stand beside it, as a number (the start) or as
    a table."""

    @property
    def parameters(self) -> dict[str, EffectParameterSpec]:
        """What is said of each parameter, by its name."""
        return dict(self.__pydantic_extra__)

    @classmethod
    def known_settings(cls) -> list[str]:
        """What may stand in the table of a parameter; beside the id any name may."""
        return list(EffectParameterSpec.model_fields)


class OwnSpec(Settings):
    """One `[[model.own]]`: a formula that pushes a joint or the tip."""

    target: Words
    """joint1, joint2, ... in N m (N on a slide), or tip1, tip2: a component in N."""
    formula: Words
    """Of the states theta1, dtheta1, delta1 (m), ddelta1, ... and the parameters."""
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
    """auto: the linear model where it is as good as the full equations on the recordings' motions,
    else the full equations."""
    effects: Annotated[tuple[EffectSpec, ...], Field(max_length=50)] = ()
    """Each with an id and its parameters; fifty at most, twice what the catalogue has."""
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
    """Of sensors beyond these, under the setting that the sensor's class names; in the file they
    stand beside the others."""

    @model_validator(mode="before")
    @classmethod
    def _gather_further(cls, data: Any) -> Any:
        named = {one.noise for one in sensors().values()} - {"", *cls.model_fields}
        return gathered(data, lambda key: key in named, "further")

    @model_serializer(mode="wrap")
    def _flat(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        table: dict[str, Any] = handler(self)
        return {**table, **table.pop("further", {})}

    @classmethod
    def known_settings(cls) -> list[str]:
        """What may stand in `[sensors]`."""
        named = sorted({one.noise for one in sensors().values()} - {"", *cls.model_fields})
        return [name for name in cls.model_fields if name != "further"] + named

    def noise_of(self, setting: str) -> float | None:
        """The standard deviation that a setting states, SI; None where it states none."""
        if setting in self.further:
            return self.further[setting]
        value: float | None = getattr(self, setting, None) if setting else None
        return value


def _one_as_list(value: Any) -> Any:
    return (value,) if isinstance(value, str) else value


class IdentifySpec(Settings):
    """`[identify]`: which parameters, from which output, how."""

    method: Literal["glocal", "local"] = "glocal"
    """glocal: one fit over all recordings; local: one per recording."""
    parameters: tuple[Words, ...] = ()
    """Names of what is estimated."""
    output: Annotated[tuple[Output, ...] | None, BeforeValidator(_one_as_list)] = None
    """Ids of the sensors that are compared; None: what suits level and recordings."""
    filter: ZeroPhaseLowPass | Literal[False] | None = None
    """Low-pass of measurement and model alike. Where torques along recorded motions are compared
    and no filter is stated, they pass one at the end of the band in which the encoders show a
    motion above their noise; false: none."""
    output_filter: ZeroPhaseLowPass | None = None
    """A further low-pass of the compared outputs, measured and modelled alike."""
    decimate: Annotated[Whole, Field(ge=1)] = 1
    """Keep one sample of so many, after filtering."""
    bounds: dict[str, Interval] = Field(default_factory=dict)
    """Parameter -> [lower, upper], SI."""
    prior: dict[str, Prior] = Field(default_factory=dict)
    """Parameter -> a table with std and value, or the std alone, SI."""
    per_recording: tuple[Words, ...] = ()
    """Parameters with a value of their own in each recording."""
    start: dict[str, Real] = Field(default_factory=dict)
    """Parameter -> where it starts, SI; one that is not estimated is held there."""
    initial_state: Switch | None = None
    """Whether the state in which each recording begins is estimated too; None: where recordings
    from files begin in motion."""
    offsets: tuple[Channel, ...] = ()
    """Channels whose constant offset is estimated for each recording."""
    servo_hz: Positive | None = None
    """Hz, of the virtual servo that holds the joints on the encoders; None: 60 where one is
    needed."""
    seed: Whole = 1
    """Of the first population."""
    population: Annotated[Whole, Field(ge=5, le=10_000)] = 30
    """Members of the differential evolution."""
    generations: Annotated[Whole, Field(le=1_000_000)] = 60
    """0: refinement only."""
    weights: dict[str, Positive] = Field(default_factory=dict)
    """Channel -> weight of its residual beside the others'."""
    refine: Switch = True
    """Whether a local descent follows the evolution."""

    @field_validator("parameters", "per_recording", "offsets", "output")
    @classmethod
    def _named_once(cls, names: tuple[str, ...] | None) -> tuple[str, ...] | None:
        doubled = sorted(name for name, count in Counter(names or ()).items() if count > 1)
        if doubled:
            raise ValueError(f"lists {doubled[0]!r} twice; list it once.")
        return names

    @field_validator("weights")
    @classmethod
    def _weights_of_channels(cls, weights: dict[str, float]) -> dict[str, float]:
        for name in weights:
            if not is_channel(name):
                raise ValueError(
                    f"names no channel {name!r}; {did_you_mean(name, channel_names())}"
                )
        return weights

    @model_validator(mode="after")
    def _starts_within_bounds(self) -> IdentifySpec:
        for name, start in self.start.items():
            low, high = self.bounds.get(name, (start, start))
            if not low <= start <= high:
                raise ValueError(
                    f"start.{name} is {start:g}, outside its bounds [{low:g}, {high:g}]; "
                    f"move the start or the bounds."
                )
        return self


class DiagnoseSpec(Settings):
    """`[diagnose]`: how many missing effects to look for, and among which."""

    max_effects: Whole = 0
    """0: none."""
    candidates: tuple[Words, ...] | None = None
    """Ids of effects; None: all that the rig can show."""
    fidelity: NonNegative = 0.001
    """Modelling tolerance: the share of a channel's spread that no model has to explain."""
    output: Annotated[tuple[Output, ...] | None, BeforeValidator(_one_as_list)] = None
    """What the diagnosis looks at where that is not what [identify] fits."""
    per_recording: tuple[Words, ...] = ()
    """Ids of effects whose sizes belong to a rig and are estimated anew on validation data."""


class CompareSpec(Settings):
    """One `[[compare]]`: another model on the same recordings."""

    title: Words
    """Of the row in the table."""
    arm: ArmSpec | None = None
    """What differs from the scenario's arm, or an arm of its own (preset)."""
    identify: Switch = True
    """Whether it is fitted; else its stated values count."""
    parameters: tuple[Words, ...] | None = None
    """What is estimated of it; None: as `[identify]` says."""
    drop_logger_filters: Switch = False
    """Whether the recordings' `logger_filter` is left out."""


class Scenario(Settings):
    """A whole scenario."""

    title: Words
    """Of the report."""
    arm: ArmSpec
    drive: DriveSpec = DriveSpec()
    model: ModelSpec = ModelSpec()
    sensors: SensorsSpec = SensorsSpec()
    recordings: Annotated[tuple[RecordingSpec, ...], Field(max_length=MOST_RECORDINGS)] = ()
    """Files or simulations; 500 at most."""
    identify: IdentifySpec = IdentifySpec()
    diagnose: DiagnoseSpec = DiagnoseSpec()
    compare: Annotated[tuple[CompareSpec, ...], Field(max_length=20)] = ()
    """Other models on the same recordings; 20 at most."""
    limits: LimitsSpec = LimitsSpec()

    @field_validator("recordings")
    @classmethod
    def _few_samples(cls, given: tuple[RecordingSpec, ...]) -> tuple[RecordingSpec, ...]:
        samples = sum(spec.simulate.samples for spec in given if spec.simulate is not None)
        if samples > MOST_SAMPLES:
            raise ValueError(
                f"ask for {samples:,} simulated samples in all; they may have {MOST_SAMPLES:,}."
            )
        return given

    @field_validator("recordings")
    @classmethod
    def _name_recordings(cls, given: tuple[RecordingSpec, ...]) -> tuple[RecordingSpec, ...]:
        """Every recording has a name of its own; where none is given it gets one."""
        taken = [spec.name for spec in given if spec.name]
        doubled = sorted(name for name, count in Counter(taken).items() if count > 1)
        if doubled:
            raise ValueError(f"has two entries named {doubled[0]!r}; give each its own name.")
        named = []
        simulated = 0
        for spec in given:
            simulated += spec.simulate is not None
            wish = file_stem(spec.file) if spec.file else f"simulated-{simulated}"
            name = spec.name or _free_name(wish, taken)
            taken.append(name)
            named.append(spec.model_copy(update={"name": name}))
        return tuple(named)


def _free_name(wish: str, taken: list[str]) -> str:
    number, name = 1, wish
    while name in taken:
        number += 1
        name = f"{wish}-{number}"
    return name
