"""Why an effect is not added, why a model cannot be judged, and the experiment that would decide
between two effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum


@dataclass(frozen=True)
class PlannedExperiment:
    """An experiment that was not made yet, and how well it would distinguish two effects."""

    simulate: Mapping[str, object]
    """Its settings, as `simulate` of a scenario's recording."""
    unit: str
    """Of its amplitude."""
    score: float
    """Expected rise of the squared error, in floors, when the wrong effect is refitted; the
    smaller of the two ways round."""
    between: tuple[str, str]
    """Titles of the two effects."""


class Reason(StrEnum):
    """Why an effect that explains enough is not added."""

    AT_BOUND = "at_bound"
    """A size is pressed to the bound of what is plausible."""
    UNSEEN = "unseen"
    """Recordings that no fit has seen become worse."""
    UNSETTLED = "unsettled"
    """With finer steps the model is worse with it."""
    INDISTINCT = "indistinct"
    """Its size is within its deviation of no effect."""
    WITHIN_LAWS = "within_laws"
    """The error is as small as the idealised laws of the model may miss, and it explains a part."""
    SMALL_SHARE = "small_share"
    """It is certain and relevant, and explains too small a part of what is left."""


@dataclass(frozen=True)
class Objection:
    """What speaks against an effect, with the figures that say so."""

    reason: Reason
    parameter: str = ""
    """Title of what stands at a bound."""
    bound: float = float("nan")
    unit: str = ""
    unseen: tuple[float, float] = (float("nan"), float("nan"))
    """rms on recordings that no fit has seen without and with it, in floors."""
    share: float = float("nan")
    """Of the error above the noise floor that it explains."""
    p_value: float = float("nan")
    delta_bic: float = float("nan")
    """Fall of the extended BIC, which the choice among all candidates has lowered."""


class DoubtReason(StrEnum):
    """Why a model whose error is at the noise floor cannot be judged."""

    REFUTED_NOISE = "refuted_noise"
    """The noise was estimated, and the model leaves clearly less: the noise is not known."""
    FLOOR_ABOVE_SPREAD = "floor_above_spread"
    """The noise floor is above all that the channel shows."""
    UNSEEN = "unseen"
    """Recordings that no fit has seen have an error far above the noise floor."""


@dataclass(frozen=True)
class Doubt:
    """Why one channel does not show whether something is missing."""

    reason: DoubtReason
    channel: str
    unit: str
    """SI, of both numbers."""
    floor: float
    """The channel's noise floor; where its noise was refuted, the estimate."""
    beside: float
    """What contradicts it: the error of the model, the spread of the channel, or the error on
    recordings that no fit has seen."""
