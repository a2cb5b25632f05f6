"""What a scenario says about one recording: where it is or how to simulate it, how to read it."""

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
    """A table of settings: frozen, and with no key that is not known."""

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


class ColumnSpec(Settings):
    """The column of the file that holds a channel: SI value = gain sign value in SI."""

    name: Words
    """The file's name, which may end in a unit: `q1 [deg]`."""
    gain: Real = 1.0
    """Factor on the file's value."""
    sign: Literal[1, -1] = 1
    """-1 where the rig counts the other way."""

    @property
    def factor(self) -> float:
        """What a column is multiplied by: gain and sign."""
        return self.gain * self.sign


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
    """What happens to empty cells of encoders, references and torques; without it they are
    refused."""

    how: Literal["interpolate", "mask", "cut"]
    """interpolate: straight lines, while inputs are held; mask: the same, and the samples do not
    count; cut: the longest stretch of complete rows is kept."""
    longest: Positive = 0.02
    """s, of a gap that is bridged; a longer one is refused. A bending link swings once in a tenth
    of a second: a fifth of that hides no swing."""


class ResampleSpec(Settings):
    """An even clock for rows that are not even in time, or a lower rate for a fast log; without it
    uneven rows are refused."""

    how: Literal["interpolate", "count"] = "interpolate"
    """interpolate: values belong to their time stamps, encoders pass through a cubic spline, inputs
    are held and averaged over each step; count: the rows were taken evenly and only their stamps
    scatter."""
    rate: Positive | None = None
    """Hz; that of the densest channel where not stated. Below it the recording is thinned behind a
    symmetric low-pass, so that nothing is folded."""


LONGEST = 3600.0
"""s of one simulated recording."""
Duration = Annotated[float, Field(strict=True, gt=0, le=LONGEST, allow_inf_nan=False)]
MOST_SAMPLES = 500_000
"""Of one simulated recording: eight minutes at 1 kHz, which take twenty seconds to simulate."""
Place = Annotated[float, Field(strict=True, ge=-1e3, le=1e3, allow_inf_nan=False)]
"""rad or m: more than a hundred turns are a slip."""


class SimulateSpec(Settings):
    """How to make a recording by simulation."""

    theta2: Place | None = None
    """rad, the working point; the other joints start at zero."""
    theta: tuple[Place, ...] | None = None
    """rad or m, all joints; instead of theta2."""
    seconds: Duration = 3.0
    """s"""
    snr_db: Annotated[float, Field(strict=True, ge=-100, le=300, allow_inf_nan=False)] | None = None
    """dB, of the camera's channels; None: only what `[sensors]` states. Doubles have 313 dB between
    one and its last digit."""
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
    """Of the simulation."""
    sweep: tuple[Place, Place] | None = None
    """rad, from where to where theta2 moves over the whole recording."""
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
                f"each); it may have {MOST_SAMPLES:,}."
            )
        return self


class RecordingSpec(Settings):
    """One `[[recordings]]` of a scenario."""

    name: str = ""
    """Filled in by the scenario where it is empty: the file's stem, or simulated-N."""
    file: Words | None = None
    """Table, relative to the scenario or to the data folder: .csv, .csv.gz, .parquet or .mat."""
    simulate: SimulateSpec | None = None
    """Instead of a file."""
    role: Literal["estimate", "validate"] = "estimate"
    """Whether it is fitted or only compared."""
    columns: dict[Channel, Annotated[ColumnSpec, BeforeValidator(_column)]] = Field(
        default_factory=dict
    )
    """Channel -> the file's column, `"q1 [deg]"` or a table."""
    window: Interval | None = None
    """s, in the file's time: rows outside it are left out."""
    gaps: GapsSpec | None = None
    """What happens to empty cells of columns that need a number in every row."""
    resample: ResampleSpec | None = None
    """What happens to rows that are not even in time, and the rate that is kept."""
    time_shift: Real = 0.0
    """s: a camera sample written at t belongs to t - time_shift."""
    camera: CameraSpec = CameraSpec()
    """Its pose and delay in this recording."""
    hidden: dict[str, dict[str, Any]] = Field(default_factory=dict)
    """Effects of a simulated recording that the model does not contain."""
    mask: dict[Channel, tuple[Interval, ...]] = Field(default_factory=dict)
    """s, stretches of a channel that do not count."""
    logger_filter: dict[Channel, LoggerFilterSpec] = Field(default_factory=dict)
    """Channel -> the low-pass that the rig applied to it; the model's output passes the same."""
    theta2: Real | None = None
    """rad, the working point of a recording made at one."""
    played: Words | None = None
    """Table of the references that were played, as `flexgui plan` wrote it: the recording is cut
    to them, and has them where its logger wrote none and started with the playing."""

    @model_validator(mode="before")
    @classmethod
    def _lift_hidden(cls, data: Any) -> Any:
        """`simulate = {..., hidden = {...}}` says the same as `hidden` beside it."""
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
        """All that it reads: none of them is trusted where the scenario is not."""
        return tuple(name for name in (self.file, self.played) if name is not None)

    @model_validator(mode="after")
    def _check_together(self) -> RecordingSpec:
        if (self.file is None) == (self.simulate is None):
            raise ValueError("needs either file or simulate, and not both.")
        if self.hidden and self.file is not None:
            raise ValueError("gives hidden effects; only a simulated recording can have them.")
        if self.played is not None and self.file is None:
            raise ValueError("gives played without file; what was simulated was not played.")
        return self
