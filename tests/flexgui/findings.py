"""A diagnosis made up from formulas, and an outcome that holds all that one may hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexgui.core.identify.repeatability import repeatability
from flexgui.core.information_criteria import with_evidence
from flexgui.core.results import (
    ChannelError,
    Diagnosis,
    DiagnosisRound,
    ErrorProducts,
    Estimate,
    JointMotion,
    LadderStep,
    LinearModel,
    Outcome,
    PlannedExperiment,
    RankedEffect,
    RecordingComparison,
)
from tests.sentences.proposals import law, proposal

FLOORS = {"ydot1": 2.4e-3, "ydot2": 2.5e-3}
NASTY = "<script>alert(1)</script> the friction"


FRICTION = Estimate("fc1", 1.2, 0.01, "N m", True, "f_{c1}")


def ranked(kind: str, title: str, fall: float | None, *confused: str) -> RankedEffect:
    bic = None if fall is None else 40.0 * fall
    sizes = () if fall is None else (FRICTION,)
    return RankedEffect(kind, title, 90.0, 0.0, 60.0, fall, bic, confused, sizes)


def step(added: str | None, title: str, cost: float, validation: float) -> LadderStep:
    root = np.sqrt(cost)
    errors = tuple(
        ChannelError(n, "rad/s", root * f, f, validation * f, "stated") for n, f in FLOORS.items()
    )
    return LadderStep(
        added, title, (), errors, 2e-4 * root, cost, (90.0, 91.0), (88.0, 87.0),
        left=left(cost, 4 if added else 2),
    )  # fmt: skip


def left(cost: float, parameters: int) -> ErrorProducts:
    """White errors of a squared size in noise floors."""
    size = 8400.0 * cost * np.square(list(FLOORS.values()))
    products = size[:, None, None] * np.eye(7)
    return ErrorProducts(products, np.full(2, 8400), np.full(2, 0.03), parameters)


RANKING = (
    ranked("coulomb_friction", "Coulomb friction", 97.0, "viscous_friction"),
    ranked("viscous_friction", "Viscous joint friction", 95.0),
    ranked("tip_payload", "Tip payload", None),
)
PLANNED = PlannedExperiment({"theta2": 1.57}, "rad/s", 123.0, ("Friction", "Damping"))

FOUND = with_evidence(Diagnosis(
    verdict="missing",
    final_verdict="nothing_missing",
    rounds=(
        DiagnosisRound(RANKING, "coulomb_friction", experiments=(PLANNED,)),
        DiagnosisRound(RANKING[1:], None),
    ),
    steps=(
        step(None, "The model as given", 81.0, 9.5),
        step("coulomb_friction", "Coulomb friction", 1.0, 1.1),
    ),
    words=(NASTY, "What remains: nothing."),
    not_applicable={"large_motion": "The model is non-linear already."},
    effects=({"id": "coulomb_friction", "fc1": {"start": 1.2, "vary": True}},),
    floors=FLOORS,
    seconds={"base": 1.0, "diagnose": 2.0},
    noise=left(1.0, 0),
))  # fmt: skip


def motion(samples: int) -> JointMotion:
    """The error of the made-up recordings follows sin 40 t; so does the deflection here."""
    t = np.linspace(0.0, 3.0, samples)
    place = np.column_stack([np.sin(5 * t), np.cos(4 * t)])
    rate = np.gradient(place, t, axis=0)
    bent = 0.001 * np.column_stack([np.sin(40 * t), np.cos(40 * t)])
    return JointMotion(place, rate, np.gradient(rate, t, axis=0), bent, ("rad", "rad"))


def better(comparison: RecordingComparison) -> RecordingComparison:
    """The same recording with a tenth of the error."""
    channels = tuple(replace(c, model=c.measured - 0.1 * c.residual) for c in comparison.channels)
    return replace(comparison, channels=channels, tip_rms=4e-5)


def whole_outcome(glocal: Outcome) -> Outcome:
    """A ladder that ended at the floor, a law that nobody listed, and runs that differ."""
    given = tuple(
        replace(r, motion=motion(len(r.channels[0].time)), theta2=0.4) for r in glocal.comparisons
    )
    first, last = (Estimate("EI1", x, 0.2, "N m²", True, "EI_1") for x in (369.5, 520.1))
    steps = (
        replace(FOUND.steps[0], parameters=(first,)),
        replace(FOUND.steps[1], parameters=(last, FRICTION)),
    )
    found = replace(
        FOUND, steps=steps, parameters=(last, FRICTION), proposal=proposal(law()), given=given,
        origins={"EI1": "arm", "fc1": "coulomb_friction"}, values={"EI1": 520.1, "fc1": 1.2},
        left=tuple(better(c) for c in given), linear_model=LinearModel(2e-4, 4e-5, 3e-5),
    )  # fmt: skip
    made = {
        run: [Estimate("fc1", 0.5 + 0.001 * k, 0.002, "N m", True)] for k, run in enumerate("abcde")
    }
    made["c"] = [Estimate("fc1", 0.6024, 0.002, "N m", True)]
    return replace(
        glocal, comparisons=given, diagnosis=found, origins={"lambda1": "drive"},
        repeated=repeatability(made), seconds={**glocal.seconds, "diagnose": 3.0},
    )  # fmt: skip
