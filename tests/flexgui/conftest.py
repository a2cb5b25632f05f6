"""Outcomes made up from formulas, with everything in them that a real one may have."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.results import (
    ChannelComparison,
    DescriptorModel,
    Equation,
    Estimate,
    Fit,
    Generation,
    Identifiability,
    MissingTorque,
    Outcome,
    Quantity,
    RecordingComparison,
    StateEquations,
    Valley,
    Variant,
)
from flexgui.export.export_files import export_outcome
from tests.flexgui.findings import left, whole_outcome

EI = 520.8333
"""N m², of the paper's arm."""


def _channel(
    name: str, unit: str, seed: int, size: float = 0.3, noise: float = 0.02, fitted: bool = True
) -> ChannelComparison:
    rng = np.random.default_rng(seed)
    time = np.arange(3000) * 1e-3
    model = size * np.sign(np.sin(9 * time + seed)) * (1 - np.exp(-((time * 7) % 1) * 9))
    measured = model + size * noise * np.sin(40 * time) + 0.4 * size * noise * rng.normal(size=3000)
    counted = np.ones(3000, dtype=bool)
    counted[1200:1400] = False
    if name.startswith("z"):
        measured[1700:1760] = np.nan
        counted &= np.isfinite(measured)
    return ChannelComparison(name, unit, time, measured, model, counted, fitted)


def _recording(name: str, role: str, seed: int, label: str) -> RecordingComparison:
    channels = (
        _channel("ydot1", "rad/s", seed),
        _channel("ydot2", "rad/s", seed + 1, noise=0.04),
        _channel("z1", "m", seed + 2, size=0.08, noise=0.003, fitted=False),
    )
    return RecordingComparison(
        name, role, label, channels, note="Velocities from positions.", tip_rms=2.4e-4 + 1e-5 * seed
    )


def _missing(seed: int) -> MissingTorque:
    rng = np.random.default_rng(seed)
    time = np.arange(3000) * 1e-3
    velocity = 0.8 * np.sin(5 * time)
    missing = 1.4 * np.sign(velocity) + 0.5 * velocity + 0.15 * rng.normal(size=3000)
    recorded = 12 * np.cos(5 * time) + missing
    counted = np.ones(3000, dtype=bool)
    return MissingTorque(seed, "N m", time, velocity, "rad/s", missing, recorded, counted)


def _convergence(vector: tuple[float, ...], seed: int) -> tuple[Generation, ...]:
    rng = np.random.default_rng(seed)
    generations = []
    for k in range(60):
        best = 3.1 + 900 * np.exp(-k / 4)
        eps = rng.uniform(0.85e9, 1.15e9, 30)
        members = np.column_stack([eps, (EI * 12 / eps) ** 0.25])
        spread = 1 + 8 * np.exp(-k / 7)
        generations.append(
            Generation(k, best, best * spread, best * spread**2, np.array(vector), members)
        )
    return tuple(generations)


def _valley() -> Valley:
    eps = np.linspace(0.8e9, 1.2e9, 41)
    points = np.column_stack([eps, (EI * 12 / eps) ** 0.25])
    ratio = 1 + 1e-9 * np.abs(eps / 1e9 - 1)
    return Valley(("epsilon", "d"), ("Pa", "m"), points, ratio, np.array([4.0, -1.0]))


def _fit(label: str, recordings: tuple[str, ...], seed: int = 0) -> Fit:
    eps = 1.0098e9 * (1 + 0.01 * seed)
    d = (EI * 12 / eps) ** 0.25
    estimates = (
        Estimate("epsilon", eps, np.nan, "Pa", False, "\\varepsilon", 1.1e9, 0.8e9, 1.2e9),
        Estimate("d", d, np.nan, "m", False, "d", 0.045, 0.04, 0.06),
        Estimate("lambda1", 60.01, 0.12, "N m s/rad", True, "\\lambda_1", 50.0, 40.0, 80.0),
    )
    derived = (Estimate("EI", EI + 0.003 * seed, 0.0213, "N m²", True, "EI"),)
    identifiability = Identifiability(
        ("epsilon", "d", "lambda1"),
        2,
        np.array([812.0, 3.1, 4e-12]),
        np.array([[-4.0, 1.0, 0.0]]) / np.sqrt(17),
        valley=_valley(),
    )
    correlation = np.array([[1, -0.999, 0.1], [-0.999, 1, -0.08], [0.1, -0.08, 1]])
    return Fit(
        label, recordings, estimates, correlation, 3.1 + seed, 18000,
        _convergence((eps, d, 60.01), seed), identifiability, 2e-7, "Converged.", derived=derived,
    )  # fmt: skip


def _model() -> DescriptorModel:
    rng = np.random.default_rng(1)
    n = 4
    e0, e1, a0 = np.eye(2 * n), np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
    e0[n:, n:] += rng.normal(size=(n, n)) ** 2
    e1[n:, n:] = rng.normal(size=(n, n))
    a0[:n, n:] = np.eye(n)
    a0[n + 2, 2], a0[n + 3, 3] = -2 * EI, -2 * EI
    b = np.vstack([np.zeros((n, 2)), np.eye(n)[:, :2] * 60])
    c = np.hstack([np.zeros((2, n)), np.array([[1, 0, 0.5, 0], [0, 1, 0.5, 0.5]])])
    names = ("theta1", "theta2", "v1_1", "v2_1")
    return DescriptorModel(
        ("1", "cos(theta2)"), np.stack([e0, e1]), ("1",), a0[None], b, ("ydot1", "ydot2"), c,
        np.zeros((2, 2)), names + tuple(f"d{x}" for x in names), ("dtheta1_ref", "dtheta2_ref"),
    )  # fmt: skip


EQUATIONS = (
    Equation("Dynamics (1)", r"M(q)\,\ddot{q} = F(q,\dot{q}) + G u"),
    Equation(
        "Velocity loop (11)",
        r"E(\kappa)\,\dot{x} = \begin{bmatrix} 0 & I \\ -K & -D - G \Lambda G^{T} \end{bmatrix} x"
        r" + \begin{bmatrix} 0 \\ G \Lambda \end{bmatrix} \dot{\theta}^{*}",
        "Λ in N m s/rad.",
    ),
    Equation("Bending energy", r"V = \sum_{k=1}^{2} \frac{1}{2} EI_k \int_0^{l_k} p^{2} \, dx"),
)


ONE_JOINT = StateEquations(
    states=(Quantity("theta1", "rad"), Quantity("dtheta1", "rad/s")),
    coordinates=1,
    inputs=(Quantity("dtheta1_ref", "rad/s"),),
    outputs=(Quantity("theta1", "rad"),),
    parameters=(Quantity("lambda1", "N m s/rad", 60.0),),
    statements=("rates[0] = x[1]", "rates[1] = k[0]*(r[0] - x[1])", "y[0] = x[0]"),
)


def _outcome(fits: tuple[Fit, ...], comparisons: tuple[RecordingComparison, ...]) -> Outcome:
    return Outcome(
        title="Seven working points",
        method="glocal" if len(fits) == 1 else "local",
        level="lpv",
        fits=fits,
        comparisons=comparisons,
        model=_model(),
        equations=EQUATIONS,
        state_equations=ONE_JOINT,
        seconds={"identify": 12.34},
        notes=("Output ȳ from positions by central differences over 2 ms.",),
        arm_table=(("l1", "length of segment 1", 0.5, "m"), ("m1", "mass", 7.5, "kg")),
        left=left(81.0, 3 * len(fits)),
    )


@pytest.fixture(scope="session")
def glocal() -> Outcome:
    """Five recordings to estimate from, two to validate, another model, missing torques."""
    names = tuple(f"th{k}" for k in range(1, 6))
    comparisons = tuple(_recording(n, "estimate", k, "glocal") for k, n in enumerate(names))
    comparisons += tuple(_recording(f"sweep{k}", "validate", 9 + k, "glocal") for k in (1, 2))
    comparisons = (replace(comparisons[0], missing_torque=(_missing(1), _missing(2))),
                   *comparisons[1:])  # fmt: skip
    worse = tuple(
        replace(r, channels=tuple(replace(c, model=0.9 * c.model) for c in r.channels))
        for r in comparisons
    )
    outcome = _outcome((_fit("glocal", names),), comparisons)
    return replace(outcome, variants=(Variant("one mode", (), worse),))


@pytest.fixture(scope="session")
def local() -> Outcome:
    """A fit for each of three recordings."""
    names = ("th1", "th2", "th3")
    fits = tuple(_fit(name, (name,), k) for k, name in enumerate(names))
    return _outcome(fits, tuple(_recording(n, "estimate", k, n) for k, n in enumerate(names)))


@pytest.fixture(scope="session")
def bare(glocal: Outcome) -> Outcome:
    """Nothing estimated, one recording without a spread: as little as an outcome can hold."""
    flat = _channel("torque1", "N m", 3)
    flat = replace(flat, measured=np.zeros(3000), model=np.full(3000, np.nan))
    only = RecordingComparison("rest", "estimate", "as given", (flat,))
    return Outcome("As given", "glocal", "nonlinear", (), (only,), glocal.model, ())


@pytest.fixture(scope="session")
def diagnosed(glocal: Outcome) -> Outcome:
    """All that an outcome may hold."""
    return whole_outcome(glocal)


SCENARIO = 'title = "Seven working points"  # θ2, <b> & "quotes"\n'


@pytest.fixture(scope="session")
def exported(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], Path]:
    """The folder of the outcome of this name, which is exported once."""

    @cache
    def export(name: str) -> Path:
        out = tmp_path_factory.mktemp(name) / "deep" / "report"
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("SOURCE_DATE_EPOCH", "0")
            beside = {"diagnosed.toml": b'title = "diagnosed"\n'} if name == "diagnosed" else {}
            export_outcome(request.getfixturevalue(name), SCENARIO, out, beside=beside)
        return out

    return export
