"""A law that is proposed for what no listed effect explains."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..results.criteria import ErrorProducts
from ..results.identification import Estimate
from ..results.objection import Objection, PlannedExperiment

WITHIN_NOISE, NO_CARRIER, NO_LAW = "within_noise", "no_carrier", "no_law"
"""Why nothing is proposed: nothing is left to explain, no variable carries the rest, or every law
that was tried fails a test."""


@dataclass(frozen=True)
class Carrier:
    """A variable, and how much of an error a smooth function of it explains."""

    target: str
    """Where the function acts: as the target of an own formula."""
    target_title: str
    variable: str
    """Its word in a formula."""
    title: str
    """Such as 'position of joint 2'."""
    unit: str
    factor: str
    """What the function is multiplied by, such as 'times the speed'; empty: nothing."""
    share: float
    """Of the squared error above noise that it explains on parts of the recordings that its values
    were not fitted to."""
    places: np.ndarray
    """(K,) of the variable, in `unit`"""
    values: np.ndarray
    """(K,) of the function there, in `value_unit`"""
    deviations: np.ndarray
    """(K,) standard deviations of the values"""
    value_unit: str


@dataclass(frozen=True)
class LawTerm:
    """One function of one variable in a law."""

    carrier: Carrier
    places: np.ndarray
    """(n,) of the carrier's variable"""
    values: np.ndarray
    """(n,) of the function there, in the carrier's `value_unit`"""


@dataclass(frozen=True)
class ProposedLaw:
    """A law that passed every test an effect passes."""

    title: str
    """Its name in words."""
    target: str
    """Where it acts, as in `[[model.own]]`: 'joint1', 'tip', 'deflection1', ..."""
    formula: str
    """In the language of own formulas."""
    latex: str
    """The formula, for display."""
    parameters: tuple[Estimate, ...]
    """Its values."""
    terms: tuple[LawTerm, ...]
    """One, or two that are added."""
    explained: float
    """Share (0 to 1) of the squared error above noise."""
    rms: tuple[float, float]
    """Before and after, in noise floors."""
    unseen_rms: tuple[float, float] = (float("nan"), float("nan"))
    """The same on validation recordings; NaN without any."""
    delta_bic: float = float("nan")
    """Fall of the Bayesian information criterion by it; positive speaks for the law."""
    relative: str = ""
    """Title of the listed effect that it is most like; empty: none was ranked."""
    likeness: float = float("nan")
    """Cosine between what both predict."""
    left: ErrorProducts | None = field(default=None, compare=False)
    """Errors of the model with it, for BIC."""

    @property
    def carrier(self) -> Carrier:
        """What its first term depends on."""
        return self.terms[0].carrier

    @property
    def settings(self) -> dict[str, object]:
        """The law as an entry of `[[model.own]]`, without an id."""
        parameters = {
            e.name: {"start": e.value, "unit": e.unit}
            | {k: x for k, x in (("lower", e.lower), ("upper", e.upper)) if np.isfinite(x)}
            for e in self.parameters
        }
        return {
            "title": self.title, "target": self.target, "formula": self.formula,
            "parameters": parameters,
        }  # fmt: skip


@dataclass(frozen=True)
class Event:
    """A force that acts in one stretch of a recording, and at no other time."""

    recording: str
    start: float
    stop: float
    """s, in the recording's time"""
    target: str
    """Where it acts: 'joint1', ..., 'tip'."""
    target_title: str
    force: tuple[float, ...]
    """Its mean in between, in `unit`: at the tip along z1 and z2."""
    unit: str
    rest: tuple[tuple[float, float], ...] = ()
    """s: what is left of the recording without it, before and after."""


@dataclass(frozen=True)
class Proposal:
    """What a search for laws found."""

    carriers: tuple[Carrier, ...] = ()
    """Variables that the rest depends on, best first."""
    laws: tuple[ProposedLaw, ...] = ()
    """Best first; empty where nothing is proposed."""
    reason: str = ""
    """Why nothing is proposed: 'within_noise', 'no_carrier' or 'no_law'; empty: something is."""
    refused: tuple[tuple[str, Objection], ...] = ()
    """(title, why) of laws that explain enough and fail a test."""
    experiments: tuple[PlannedExperiment, ...] = ()
    """Where two laws remain: what to measure next to decide, best first."""
    needless: tuple[str, ...] = ()
    """Titles of the effects that were found before and are not needed beside the first law."""
    events: tuple[Event, ...] = ()
    """Where a stretch of each recording causes the error: what acts there."""
    alike: int = 0
    """How many of the carriers after the first explain as much: these recordings cannot tell them
    apart."""
    seconds: float = float("nan")
    """s, that the search took."""
    stopped: bool = False
    """Whether it was stopped before its end."""
