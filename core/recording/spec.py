"""The settings of one recording: its file or simulation, and how to read it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from .. import validation
from ..recording.channels import channel_names, is_channel
from ..recording.recording import CameraPose, LoggerFilter
from ..sentences import did_you_mean
from ..validation import Bounded

# Strict: a number in quotes or `true` where a number belongs is a slip, not a number.
Real = Annotated[Bounded, Field(strict=True)]
Positive = Annotated[validation.Positive, Field(strict=True)]
NonNegative = Annotated[validation.NonNegative, Field(strict=True)]
Whole = Annotated[int, Field(strict=True, ge=0, lt=2**32)]
Switch = Annotated[bool, Field(strict=True)]
Words = Annotated[str, Field(min_length=1)]


class Settings(BaseModel):
    """A frozen table of settings; unknown keys are an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def _rising(pair: tuple[float, float]) -> tuple[float, float]:
    if not pair[0] < pair[1]:
        raise ValueError(f"is [{pair[0]:g}, {pair[1]:g}]; the first must be less than the second.")
    return pair


def _channel(name: str) -> str:
    if not is_channel(name):
        raise ValueError(f"names no channel; {did_you_mean(name, channel_names())}")
    return name


Interval = Annotated[tuple[Real, Real], AfterValidator(_rising)]
"""[low, high] with low < high."""
Channel = Annotated[str, AfterValidator(_channel)]


UNKNOWN = "unknown"
"""A gain that is estimated."""


class ColumnSpec(Settings):
    """The column of the file that holds a channel: SI value = gain sign value in SI."""

    name: Words
    """The file's name, which may end in a unit: `q1 [deg]`."""
    gain: Real | Literal["unknown"] = 1.0
    """Factor on the file's value; "unknown": it is estimated, whatever unit the file states."""
    sign: Literal[1, -1] = 1
    """-1 where the rig's positive direction is the opposite one."""

    @property
    def factor(self) -> float:
        """The factor of a column: gain and sign."""
        return self.sign * (self.gain if isinstance(self.gain, float) else 1.0)


def _column(value: Any) -> Any:
    return {"name": value} if isinstance(value, str) else value


class CameraSpec(Settings):
    """The camera's pose: z = origin + R(angle) scale z_camera, and its delay in s."""

    origin: tuple[Real, Real] = (0.0, 0.0)
    """m"""
    angle: Real = 0.0
    """rad"""
    scale: Positive = 1.0
    """m per unit of the camera"""
    delay: Real = 0.0
    """s"""

    def pose(self) -> CameraPose:
        """The camera's pose, scale and delay."""
        return CameraPose(self.origin, self.angle, self.scale, self.delay)


class LoggerFilterSpec(Settings):
    """The second-order low-pass that the rig's logger applied, in rad/s."""

    frequency: Positive
    """rad/s"""
    damping: Positive
    """Damping ratio, 1"""

    def filter(self) -> LoggerFilter:
        """The filter that the rig applied."""
        return LoggerFilter(self.frequency, self.damping)


class GapsSpec(Settings):
    """How empty cells of encoders, references and torques are filled; without it they are an
    error."""

    how: Literal["interpolate", "mask", "cut"]
    """interpolate: fill linearly, hold inputs; mask: fill likewise, but exclude from the fit; cut:
    keep the longest part of complete rows."""
    longest: Positive = 0.02
    """s, longest gap that is filled; a longer one is an error. A bending link vibrates with a
    period of about 0.1 s: a fifth of that hides no vibration."""


class ResampleSpec(Settings):
    """Even timestamps for uneven rows, or a lower rate for a fast log; without it uneven rows are
    an error."""

    how: Literal["interpolate", "count"] = "interpolate"
    """interpolate: trust the timestamps (encoders by a cubic spline, inputs held and averaged over
    each step); count: ignore timestamps, the rows were sampled evenly."""
    rate: Positive | None = None
    """Hz; None: the rate of the densest channel. To a lower rate the recording is decimated behind
    a symmetric low-pass, without aliasing."""


LONGEST_SIMULATION = 3600.0
"""s of one simulated recording."""
Duration = Annotated[float, Field(strict=True, gt=0, le=LONGEST_SIMULATION, allow_inf_nan=False)]
MOST_SAMPLES = 500_000
"""Of one simulated recording: eight minutes at 1 kHz, which take twenty seconds to simulate."""
Place = Annotated[float, Field(strict=True, ge=-1e3, le=1e3, allow_inf_nan=False)]
"""rad or m: more than a hundred turns are a slip."""


class SimulateSpec(Settings):
    """How a recording is simulated."""

    theta2: Place | None = None
    """rad, the working point; the other joints start at zero."""
    theta: tuple[Place, ...] | None = None
    """rad or m, all joints; instead of theta2."""
    seconds: Duration = 3.0
    """s"""
    snr_db: Annotated[float, Field(strict=True, ge=-100, le=300, allow_inf_nan=False)] | None = None
    """dB, of the camera's channels; None: only the noise of `[sensors]`."""
    seed: Whole = 1
    """Of excitation and noise."""
    excitation: Words = "prbs_balanced"
    """Id of an excitation."""
    amplitude: Annotated[float, Field(strict=True, gt=0, le=1e6, allow_inf_nan=False)] = 0.3
    """rad/s, rad or N m; the strongest robots have 1e4 N m."""
    hold: Duration = 0.02
    """s, how long the excitation keeps a level."""
    sample_time: Annotated[float, Field(strict=True, ge=1e-6, le=10, allow_inf_nan=False)] = 1e-3
    """s; the fastest loggers of rigs have 1e-6."""
    level: Literal["nonlinear", "lpv"] = "nonlinear"
    """Level of the simulated model."""
    sweep: tuple[Place, Place] | None = None
    """rad, first and last value of theta2, which moves over the whole recording."""
    options: dict[str, Any] = Field(default_factory=dict)
    """Further settings of the excitation."""

    @property
    def samples(self) -> int:
        """Of the recording."""
        return int(round(self.seconds / self.sample_time))

    @model_validator(mode="after")
    def _check_together(self) -> SimulateSpec:
        if self.theta is not None and self.theta2 is not None:
            raise ValueError("gives both theta and theta2; give one of them.")
        if self.seconds < 10 * self.sample_time:
            raise ValueError(
                f"asks for {self.seconds:g} s at a sample time of {self.sample_time:g} s; "
                f"that is fewer than 10 samples."
            )
        if self.samples > MOST_SAMPLES:
            raise ValueError(
                f"asks for {self.samples:,} samples ({self.seconds:g} s at {self.sample_time:g} s "
                f"each); at most {MOST_SAMPLES:,} are allowed."
            )
        return self


class RecordingSpec(Settings):
    """One `[[recordings]]` of a scenario."""

    name: str = ""
    """Where empty: the file's stem, or simulated-N."""
    file: Words | None = None
    """Table, relative to the scenario or to the data folder: .csv, .csv.gz, .parquet or .mat."""
    simulate: SimulateSpec | None = None
    """Instead of a file."""
    role: Literal["estimate", "validate"] = "estimate"
    """estimate: fitted; validate: only compared."""
    columns: dict[Channel, Annotated[ColumnSpec, BeforeValidator(_column)]] = Field(
        default_factory=dict
    )
    """Channel -> the file's column, `"q1 [deg]"` or a table."""
    window: Interval | None = None
    """s, in the file's time: rows outside it are left out."""
    gaps: GapsSpec | None = None
    """How empty cells are filled in columns that need a number in every row."""
    resample: ResampleSpec | None = None
    """How unevenly sampled rows are resampled, and the rate."""
    time_shift: Real = 0.0
    """s: a camera sample written at t belongs to t - time_shift."""
    camera: CameraSpec = CameraSpec()
    """Its pose and delay in this recording."""
    hidden: dict[str, dict[str, Any]] = Field(default_factory=dict)
    """Effects of a simulated recording that are not in the model."""
    mask: dict[Channel, tuple[Interval, ...]] = Field(default_factory=dict)
    """s, intervals of a channel that are excluded from the fit."""
    logger_filter: dict[Channel, LoggerFilterSpec] = Field(default_factory=dict)
    """Channel -> the low-pass that the rig applied; the model's output passes the same filter."""
    dismissed: tuple[Words, ...] = ()
    """Findings of the check that are right as they are, such as "z1: delay"."""
    theta2: Real | None = None
    """rad, the working point, if the recording was made at one."""
    played: Words | None = None
    """File with the planned references, written by `flexgui plan`. The recording is cut to them. If
    it has no references, these are used from its first sample on."""

    @model_validator(mode="before")
    @classmethod
    def _lift_hidden(cls, data: Any) -> Any:
        """`simulate = {..., hidden = {...}}` means the same as `hidden` beside it."""
        if not isinstance(data, dict) or not isinstance(data.get("simulate"), dict):
            return data
        if "hidden" not in data["simulate"]:
            return data
        if "hidden" in data:
            raise ValueError("gives hidden twice; give it once.")
        simulate = {k: v for k, v in data["simulate"].items() if k != "hidden"}
        return {**data, "simulate": simulate, "hidden": data["simulate"]["hidden"]}

    @property
    def files(self) -> tuple[str, ...]:
        """All files that it reads; a scenario that is not trusted makes none of them trusted."""
        return tuple(name for name in (self.file, self.played) if name is not None)

    @property
    def unknown_gains(self) -> tuple[str, ...]:
        """Channels whose gain is to be estimated."""
        return tuple(name for name, column in self.columns.items() if column.gain == UNKNOWN)

    @property
    def logger_filters(self) -> dict[str, LoggerFilter]:
        """Channel -> the low-pass that it has passed in the rig."""
        return {name: settings.filter() for name, settings in self.logger_filter.items()}

    @property
    def camera_in_base_frame(self) -> CameraPose:
        """The camera's pose once its columns are in the base's frame: its delay is left."""
        return CameraPose(delay=self.camera.delay)

    @model_validator(mode="after")
    def _check_together(self) -> RecordingSpec:
        if (self.file is None) == (self.simulate is None):
            raise ValueError("needs either file or simulate, and not both.")
        if self.hidden and self.file is not None:
            raise ValueError("gives hidden effects; only a simulated recording can have them.")
        if self.played is not None and self.file is None:
            raise ValueError("gives played without file; a simulated recording was not played.")
        return self
