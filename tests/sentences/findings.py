"""A finished search whose words are read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from flexgui.core.effects import catalogue
from flexgui.core.results import (
    MISSING,
    NOTHING,
    ChannelError,
    Diagnosis,
    DiagnosisRound,
    Estimate,
    LadderStep,
    RankedEffect,
    Remains,
)
from flexgui.sentences.verdict import verdict_paragraphs

FRICTION, VISCOUS, PAYLOAD = "coulomb_friction", "viscous_friction", "tip_payload"
TITLE = "Coulomb friction of joint 1"
SPACE = "\N{NO-BREAK SPACE}"


def estimate(
    name: str = "fc1", value: float = 1.2011, std: float = 0.0012, **more: bool
) -> Estimate:
    return Estimate(name, value, std, "N m", True, "f_{c1}", title=TITLE, **more)


def ranked(kind: str, fall: float | None, bic: float | None, *confused: str) -> RankedEffect:
    return RankedEffect(kind, catalogue()[kind].title, 50.0, 1e-40, 70.0, fall, bic, confused)


def step(
    added: str | None, cost: float, tip: float | None, sizes: tuple[Estimate, ...] = (),
    validation: float = np.nan,
) -> LadderStep:  # fmt: skip
    title = catalogue()[added].title if added else "The model as given"
    errors = (ChannelError("z1", "m", 3e-5 * np.sqrt(cost), 3e-5, validation),)
    return LadderStep(added, title, sizes, errors, tip, cost)


def left(rms: float, line: tuple[str, float] | None = None) -> Remains:
    return Remains(rms, {"theta1": 0.97, "z1": rms}, line)


GIVEN, AFTER = step(None, 361.0, 1.96e-4), step(FRICTION, 1.0, 4.29e-5, (estimate(),))
RIVALS = (ranked(FRICTION, 99.4, 5000.0), ranked(VISCOUS, 46.0, 900.0), ranked(PAYLOAD, None, None))

FOUND = Diagnosis(
    MISSING, NOTHING,
    rounds=(DiagnosisRound(RIVALS, FRICTION), DiagnosisRound(RIVALS[1:], None)),
    steps=(GIVEN, AFTER), not_applicable={}, error_given=left(19.0), error_left=left(1.0),
    kept=(FRICTION,), limit=2, origins={"fc1": FRICTION},
)  # fmt: skip


def text(found: Diagnosis) -> str:
    return " ".join(verdict_paragraphs(found)).replace(SPACE, " ")


def as_page(parts: Mapping[str, Iterable[str]]) -> str:
    """A heading and paragraphs for each part, without the spaces that keep numbers together."""
    blocks = ["\n\n".join([f"## {name}", *paragraphs]) for name, paragraphs in parts.items()]
    return "\n\n".join(blocks).replace(SPACE, " ") + "\n"
