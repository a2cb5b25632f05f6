"""The settings of a scenario: one frozen class per TOML table."""

from __future__ import annotations

from collections import Counter
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    field_validator,
    model_validator,
)

from ..arm.build import ArmSpec
from ..recording.channels import channel_names, is_channel
from ..recording.load import file_stem
from ..recording.spec import (
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
from ..recording.velocity import ZeroPhaseLowPass
from ..scenario.rig_spec import DriveSpec, LimitsSpec, ModelSpec, Prior, RigSpec, SensorsSpec
from ..sensors import sensors
from ..sentences import did_you_mean, listed, quoted

MOST_RECORDINGS = 500
"""Of a scenario: the longest campaigns of a rig have a tenth of that."""
MOST_SIMULATED = 1_000_000
"""Simulated in one scenario: twenty minutes at 1 kHz."""


def _known_output(kind: str) -> str:
    if kind not in sensors():
        kinds = listed([repr(name) for name in sorted(sensors())], "or")
        raise ValueError(f"is {quoted(kind)}; it must be {kinds}.")
    return kind


Output = Annotated[str, AfterValidator(_known_output)]
"""The id of a sensor."""


def _one_as_list(value: Any) -> Any:
    return (value,) if isinstance(value, str) else value


class IdentifySpec(Settings):
    """`[identify]`: which parameters, from which output, how."""

    method: Literal["glocal", "local"] = "glocal"
    """glocal: one fit over all recordings; local: one per recording."""
    parameters: tuple[Words, ...] = ()
    """Names of the estimated parameters."""
    output: Annotated[tuple[Output, ...] | None, BeforeValidator(_one_as_list)] = None
    """Ids of the compared sensors; None: chosen from level and recordings."""
    filter: ZeroPhaseLowPass | Literal[False] | None = None
    """Low-pass of measurement and model. If torques along recorded motions are compared, the
    default cuts off where the encoders' motion falls below their noise; false: no filter."""
    output_filter: ZeroPhaseLowPass | None = None
    """A further low-pass of the compared outputs, measured and modelled."""
    decimate: Annotated[Whole, Field(ge=1)] = 1
    """After filtering, keep every n-th sample."""
    bounds: dict[str, Interval] = Field(default_factory=dict)
    """Parameter -> [lower, upper], SI."""
    prior: dict[str, Prior] = Field(default_factory=dict)
    """Parameter -> a table with std and value, or the std alone, SI."""
    per_recording: tuple[Words, ...] = ()
    """Parameters with a value of their own in each recording."""
    start: dict[str, Real] = Field(default_factory=dict)
    """Parameter -> start value, SI; a parameter that is not estimated keeps it."""
    initial_state: Switch | None = None
    """Whether each recording's initial state is estimated; None: of a recording from a file, unless
    it shows that the arm rests."""
    offsets: tuple[Channel, ...] = ()
    """Channels whose constant offset is estimated for each recording."""
    servo_hz: Positive | None = None
    """Hz, bandwidth of the virtual servo that moves the joints along the encoders; None: 60 where
    one is needed."""
    torques_logged: Literal["held", "at_instant"] | None = None
    """How recorded torques were logged: held until the next sample, or of their instant, as by a
    loop that runs faster than the recording; None: whichever leaves less error."""
    seed: Whole = 1
    """Of the random numbers of the first population."""
    population: Annotated[Whole, Field(ge=5, le=10_000)] = 30
    """Members of the differential evolution."""
    generations: Annotated[Whole, Field(le=1_000_000)] = 60
    """0: refinement only. Left out, the evolution runs where a whole population is cheap."""
    weights: dict[str, Positive] = Field(default_factory=dict)
    """Channel -> weight of its residual relative to the others'."""
    refine: Switch = True
    """Whether a local optimisation follows the evolution."""

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
    """`[diagnose]`: how many missing effects to add at most, and the candidates."""

    max_effects: Whole = 0
    """Largest number of added effects; 0: what is missing is proposed, not added."""
    candidates: tuple[Words, ...] | None = None
    """Ids of effects; None: all that the rig can show."""
    fidelity: NonNegative = 0.001
    """Relative modelling tolerance: a share of each channel's spread."""
    output: Annotated[tuple[Output, ...] | None, BeforeValidator(_one_as_list)] = None
    """Outputs of the diagnosis; None: those of `[identify]`."""
    per_recording: tuple[Words, ...] = ()
    """Ids of effects whose parameters belong to a rig: estimated again on validation data."""
    propose: Switch = True
    """Whether laws that nobody listed are asked for where more than noise is left."""


class CompareSpec(Settings):
    """One `[[compare]]`: another model on the same recordings."""

    title: Words
    """Of the row in the table."""
    arm: ArmSpec | None = None
    """Differences from the scenario's arm, or another arm (preset)."""
    identify: Switch = True
    """Whether it is fitted; if false, its stated values are used."""
    parameters: tuple[Words, ...] | None = None
    """Its estimated parameters; None: those of `[identify]`."""
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
    rig: RigSpec = RigSpec()
    recordings: Annotated[tuple[RecordingSpec, ...], Field(max_length=MOST_RECORDINGS)] = ()
    """Files or simulations; 500 at most."""
    identify: IdentifySpec = IdentifySpec()
    diagnose: DiagnoseSpec = DiagnoseSpec()
    compare: Annotated[tuple[CompareSpec, ...], Field(max_length=20)] = ()
    """Other models on the same recordings; 20 at most."""
    limits: LimitsSpec = LimitsSpec()

    @field_validator("recordings")
    @classmethod
    def _few_samples(cls, specs: tuple[RecordingSpec, ...]) -> tuple[RecordingSpec, ...]:
        samples = sum(spec.simulate.samples for spec in specs if spec.simulate is not None)
        if samples > MOST_SIMULATED:
            raise ValueError(
                f"ask for {samples:,} simulated samples in total; at most {MOST_SIMULATED:,} are "
                f"allowed."
            )
        return specs

    @field_validator("recordings")
    @classmethod
    def _name_recordings(cls, specs: tuple[RecordingSpec, ...]) -> tuple[RecordingSpec, ...]:
        """Every recording has a name of its own; where none is given it gets one."""
        taken = [spec.name for spec in specs if spec.name]
        doubled = sorted(name for name, count in Counter(taken).items() if count > 1)
        if doubled:
            raise ValueError(f"has two entries named {doubled[0]!r}; give each its own name.")
        named = []
        simulated = 0
        for spec in specs:
            simulated += spec.simulate is not None
            stem = file_stem(spec.file) if spec.file else f"simulated-{simulated}"
            name = spec.name or _free_name(stem, taken)
            taken.append(name)
            named.append(spec.model_copy(update={"name": name}))
        return tuple(named)


def _free_name(stem: str, taken: list[str]) -> str:
    number, name = 1, stem
    while name in taken:
        number += 1
        name = f"{stem}-{number}"
    return name
