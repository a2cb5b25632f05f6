"""One recording among those of its scenario, with what several checks need of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from core.check.bending import Shape
from core.check.finding import Finding, Picture
from core.check.geometry import Misfit, agrees, geometric_misfits, mended
from core.check.lagged import LOOP, Relation
from core.check.late import Judged, judge, link_fit
from core.check.measured import Measured
from core.check.relations import relations
from core.check.suspects import CLEAR, Suspect, late_channels, suspects
from core.recording.channels import channel_kind
from core.written import parse_header

MOST_POINTS = 600
"""Of a picture; a column on a screen is not wider."""


@dataclass(frozen=True)
class Case:
    """What a check looks at."""

    recording: Measured
    others: Sequence[Case] = field(default=(), repr=False, compare=False)
    """The scenario's other recordings."""

    @cached_property
    def misfits(self) -> tuple[Misfit, ...]:
        """What contradicts the arm's geometry, with the factor or shift that mends it.

        Where several causes mend the geometry, the dynamics decides among them.
        """
        causes = geometric_misfits(self.recording)
        if not causes or self._dynamics_explains():
            return ()
        if len(causes) == 1:
            return causes
        scored = [
            (_disagreement(relations(mended(self.recording, c), quick=True)), c) for c in causes
        ]
        return (min(scored, key=lambda one: one[0])[1],)

    def _dynamics_explains(self) -> bool:
        """Whether one factor that the dynamics asks for mends the geometry too."""
        found = suspects(relations(self.recording), [other.relations for other in self.others])
        wrong = [one for one in found if one.factor != 1.0]
        if len(wrong) != 1 or wrong[0].channel.endswith("_ref"):
            return False
        cause = Misfit((wrong[0].channel,), wrong[0].factor, 0.0, False, 0.0, 0.0)
        return agrees(mended(self.recording, cause))

    @cached_property
    def mended(self) -> Measured:
        """The recording as the geometry wants it."""
        found = self.recording
        for one in self.misfits:
            found = mended(found, one)
        return found

    @cached_property
    def shape(self) -> Shape | None:
        """The links as this recording shows them, each channel taken as it is; None where nothing
        that is measured shows them."""
        fit = link_fit(self.mended)
        return None if fit is None else fit.shape_alone

    @cached_property
    def judged(self) -> Judged | None:
        """Which channel is late, whatever the stiffness; None where that cannot be said."""
        fit = link_fit(self.mended)
        if fit is None:
            return None
        return judge(fit, [o.shape for o in self.others if o.shape is not None])

    @cached_property
    def stiffness(self) -> dict[str, float]:
        """EI of the segments as the recordings show it, the middle one of all; empty where none
        does, and the scenario's counts."""
        found = [one for one in (self.shape, *(o.shape for o in self.others)) if one is not None]
        model = self.recording.model
        if not found or model is None:
            return {}
        factors = np.exp(np.median([np.log(one.stiffness) for one in found], axis=0))
        bending = [k for k, modes in enumerate(model.arm.modes) if modes]
        named = {f"EI{k + 1}": f for k, f in zip(bending, factors, strict=True)}
        return {n: model.parameters[n].value * f for n, f in named.items() if n in model.parameters}

    @cached_property
    def relations(self) -> tuple[Relation, ...]:
        """What the channels say of each other, once the geometry is right."""
        stated = relations(self.mended, shape=self.shape)
        if not self.stiffness:
            return stated
        fitted = relations(self.mended, values=self.stiffness, shape=self.shape)
        # A loop that explains little with any stiffness lacks something else, which a fit hides.
        return fitted if _explained(fitted) > max(_explained(stated), CLEAR) else stated

    @cached_property
    def suspects(self) -> tuple[Suspect, ...]:
        """The channels that disagree with all others by a factor or a delay."""
        own, others = self.relations, [other.relations for other in self.others]
        if self.judged is None:
            return suspects(own, others)
        found = suspects([r.timeless for r in own], [[r.timeless for r in o] for o in others])
        return (*found, *late_channels(self.judged, self.recording.step))

    def finding(
        self, fault: str, channel: str, size: float, unit: str, evidence: str,
        mend: str | None = None, expected: np.ndarray | None = None,
    ) -> Finding:  # fmt: skip
        """A finding about a channel of this recording, with its picture."""
        evidence = evidence if evidence.endswith(".") else f"{evidence}."
        picture = self._picture(channel, expected)
        name = self.recording.name
        return Finding(fault, name, channel, float(size), unit, evidence, mend, picture)

    def column(self, channel: str, **settings: object) -> str | None:
        """`columns = {z1 = {name = "z1 [mm]"}}`; None where no file holds the channel."""
        header = self.recording.headers.get(channel)
        if header is None:
            return None
        unit = settings.pop("unit", "")
        name = parse_header(header)[0]
        named = f"{name} [{unit}]" if unit else header
        rest = "".join(f", {key} = {value}" for key, value in settings.items())
        return f'columns = {{ {channel} = {{ name = "{named}"{rest} }} }}'

    def _picture(self, channel: str, expected: np.ndarray | None) -> Picture | None:
        if channel not in self.recording.channels:
            return None
        thin = slice(None, None, max(self.recording.rows // MOST_POINTS, 1))
        unit = channel_kind(channel).units[0]
        shown = self.recording.channels[channel][thin]
        return Picture(self.recording.time[thin], shown, expected, unit)


def _explained(found: Sequence[Relation]) -> float:
    """Share of the encoders' variance that the scenario's loop explains, the mean of all."""
    shares = [r.explained for r in found if r.tolerance == LOOP and r.output.startswith("theta")]
    return float(np.mean(shares)) if shares else 0.0


def _disagreement(found: Sequence[Relation]) -> float:
    """How far the relations are from gains of one, all together."""
    loops = [one for one in found if np.isfinite(one.tolerance)]
    if not loops:
        return 0.0
    each = [
        min(abs(np.log(abs(one.gain))), 3.0) + 3.0 * (one.gain < 0) + 2.0 * (1.0 - one.explained)
        for one in loops
    ]
    return float(np.mean(each))
