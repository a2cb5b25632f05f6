"""All that a scenario's run produced, with the model as it is displayed and its repetitions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..results.comparison import RecordingComparison, Variant
from ..results.criteria import ErrorProducts
from ..results.diagnosis import Diagnosis
from ..results.identification import Estimate, Fit
from ..results.state_equations import StateEquations


@dataclass(frozen=True)
class Outcome:
    """All that a scenario's run produced; the page and the report show nothing else."""

    title: str
    method: str
    level: str
    """'lpv' or 'nonlinear'"""
    fits: tuple[Fit, ...]
    comparisons: tuple[RecordingComparison, ...]
    model: DescriptorModel
    equations: tuple[Equation, ...]
    variants: tuple[Variant, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)
    chosen_level: LevelChoice | None = None
    """None where the scenario states the level."""
    notes: tuple[str, ...] = ()
    """Sentences on how it was done: filter, output, simulation error, excitation, warnings."""
    findings: tuple[str, ...] = ()
    """What the check of the recordings found wrong, with the line that mends it."""
    arm_table: tuple[tuple[str, str, float, str], ...] = ()
    """(name, title, value, unit) of the arm's and the drive's parameters as given."""
    diagnosis: Diagnosis | None = None
    origins: Mapping[str, str] = field(default_factory=dict)
    """Name of an estimate -> arm, drive, sensor, or the id of the effect it belongs to."""
    as_given: tuple[Estimate, ...] = ()
    """Estimates of the first fit, where `fits` are of a model that has grown since."""
    repeated: tuple[Repeated, ...] = ()
    """Parameters over the runs of one experiment, where each run has estimates of its own."""
    mechanism: Mechanism | None = None
    """The arm of `model` in plain numbers; None where nobody stated it."""
    state_equations: StateEquations | None = None
    """The non-linear model with its drive and forces; None where joints follow a recording."""
    left: ErrorProducts | None = field(default=None, compare=False)
    """Errors of the fits, for BIC; None where there are none."""


@dataclass(frozen=True)
class LevelChoice:
    """The level of the model that recordings need, where the scenario leaves it open."""

    level: str
    """'lpv' or 'nonlinear'"""
    channel: str = ""
    """Where the linear model differs most from the full equations; empty: it cannot describe the
    rig."""
    ratio: float = float("nan")
    """By which, rms in noise floors."""


@dataclass(frozen=True)
class Equation:
    """A displayed equation of the model."""

    title: str
    latex: str
    note: str = ""


@dataclass(frozen=True)
class DescriptorModel:
    """E(kappa) x' = A x + B u, y = C x in affine terms, numbers at the estimate.

    `E_terms[i]` belongs to `basis[i]`, a readable function of the scheduling variables such as
    '1' or 'cos(theta2)'; the same for A.
    """

    basis: tuple[str, ...]
    E_terms: np.ndarray
    """(terms, nx, nx)"""
    A_basis: tuple[str, ...]
    A_terms: np.ndarray
    """(terms, nx, nx)"""
    B: np.ndarray
    """(nx, nu)"""
    outputs: tuple[str, ...]
    C: np.ndarray
    """(ny, nx)"""
    D: np.ndarray
    """(ny, nu)"""
    states: tuple[str, ...]
    inputs: tuple[str, ...]


@dataclass(frozen=True)
class Disagreement:
    """A run whose parameter is not what the other runs say."""

    run: str
    share: float
    """Of the others' mean by which it differs."""
    p_value: float


@dataclass(frozen=True)
class Repeated:
    """One parameter over the runs of an experiment."""

    name: str
    unit: str
    mean: float
    between: float
    """Standard deviation between runs, those left out that disagree; what a next run will do."""
    within: float
    """Root mean square of the runs' own deviations."""
    interval: tuple[float, float]
    """95 %, of the mean; Student's, since few runs show the scatter between them."""
    disagreeing: tuple[Disagreement, ...]


@dataclass(frozen=True)
class PresentEffect:
    """An effect that is in the model, with what it acts on."""

    kind: str
    """Its id."""
    title: str
    sizes: tuple[tuple[str, float, str], ...]
    """(name, value, unit) of its parameters; empty for an effect that is switched."""
    linear: bool
    """Whether it is in the matrices of the linear model (or could be: see `acts_on`)."""
    acts_on: str
    """'arm' (its parameters or its structure), 'drive', 'sensor', or the force that it is:
    'damping' (proportional to a joint's speed), 'dry' (constant against the motion), 'force'
    (any other)."""


@dataclass(frozen=True)
class Link:
    """One segment with the joint that carries it, in SI units."""

    length: float
    mass: float
    EI: float
    """N m^2; without a meaning where `modes` is 0 (rigid)."""
    modes: int
    damping_time: float
    """s, Kelvin-Voigt."""
    tip_mass: float
    tip_inertia: float
    joint: str
    """'revolute' or 'prismatic'."""
    axis_angle: float
    """rad, direction of a slide."""
    on_ground: bool
    """Whether it hangs on the ground instead of on the segment before."""
    hub_inertia: float
    rotor_inertia: float
    """kg m^2, of a rotor without a gear."""
    joint_stiffness: float | None
    """N m/rad (N/m) between motor and segment; None: rigid."""
    joint_damping: float
    """N m s/rad (N s/m)."""
    dry_friction: float
    """N m (N), a constant level."""
    gain: float | None
    """N m s/rad (N s/m) of a pure velocity loop; None: another drive."""
    limit: float | None
    """N m (N), the largest torque of the drive; None: no limit."""
    centre: tuple[float, float] | None = None
    """m, of the mass of a rigid link, along and across; None: it is a uniform beam."""
    inertia: float = 0.0
    """kg m^2 about that centre."""


@dataclass(frozen=True)
class Mechanism:
    """The arm as it now stands, and the effects in it."""

    links: tuple[Link, ...]
    gravity: tuple[float, float]
    """m/s^2 in the plane of motion."""
    base_stiffness: float | None
    """N/m, the same in both directions; None: the base does not move."""
    pedestal: tuple[float, float] | None
    """Stiffness, N m/rad, and inertia, kg m^2; None: the base does not turn."""
    frequencies: tuple[float, ...]
    """Hz of the first vibrations at `posture`, joints held, nothing damped; at most three."""
    posture: tuple[float, ...]
    """Joint positions at which `frequencies` hold, in rad (m)."""
    effects: tuple[PresentEffect, ...] = ()
