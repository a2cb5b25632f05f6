"""The linear model at one posture, for SciPy and python-control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from flexgui.core.errors import InputError
from flexgui.core.model import Model
from flexgui.core.sentences import install_command
from flexgui.core.simulate.posture import Mode, Posture, posture, vibration_modes
from flexgui.core.simulate.response import (
    FrequencyResponse,
    LinearOutput,
    StepResponse,
    default_output,
    frequency_response,
    linear_output,
    references,
    step_response,
)
from flexgui.library.shown import chosen
from flexgui.views.dynamics import frequency_response as draw_frequency
from flexgui.views.dynamics import mode_table
from flexgui.views.dynamics import poles as draw_poles
from flexgui.views.dynamics import step as draw_step
from flexgui.views.table import html_table

if TYPE_CHECKING:
    import control
    import pandas as pd
    import plotly.graph_objects as go
    import scipy.signal


@dataclass(frozen=True, repr=False)
class LinearModel:
    """E x' = A x + B r, y = C x + D r at rest in a posture, the drive's loop closed, (11).

    x = [q, q', states of the drive]; r are the drive's references.
    """

    at: Posture
    kind: str
    """Id of the sensor that y is."""

    @property
    def E(self) -> np.ndarray:
        """(nx, nx), regular."""
        return self.at.E

    @property
    def A(self) -> np.ndarray:
        """(nx, nx)"""
        return self.at.A

    @property
    def B(self) -> np.ndarray:
        """(nx, nr)"""
        return self.at.B[:, : len(self.inputs)]

    @cached_property
    def _output(self) -> LinearOutput:
        return linear_output(self.at, self.kind)

    @property
    def C(self) -> np.ndarray:
        """(ny, nx)"""
        return self._output.C

    @property
    def D(self) -> np.ndarray:
        """(ny, nr)"""
        return self._output.D[:, : len(self.inputs)]

    @property
    def states(self) -> tuple[str, ...]:
        """Names of x: coordinates, their rates, the drive's own states."""
        names = self.at.model.arm.coordinate_names
        own = self.at.states - 2 * len(names)
        rates = [f"d{name}" for name in names]
        return (*names, *rates, *(f"drive{k + 1}" for k in range(own)))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of r, as columns of a recording."""
        return tuple(port.name for port in references(self.at))

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of y, as columns of a recording."""
        return tuple(port.name for port in self._output.ports)

    @property
    def poles(self) -> np.ndarray:
        """(nx,) in 1/s"""
        return self.at.poles

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """Vibrations, slowest first: frequency in Hz and damping ratio."""
        return vibration_modes(self.at)

    def step(self, seconds: float | None = None) -> StepResponse:
        """Compute what each output does after a unit step of each reference.

        Args:
            seconds: Length in s; one that suits the slowest pole where not given.

        Returns:
            time (N,) in s and values (N, ny, nr).
        """
        return step_response(self.at, self.kind, seconds)

    def frequency_response(self, frequency: np.ndarray | None = None) -> FrequencyResponse:
        """Compute G(i w) from each reference to each output.

        Args:
            frequency: (W,) in Hz; a grid about the poles where not given.

        Returns:
            frequency (W,) in Hz and gain (W, ny, nr), complex; NaN at a pole without damping,
            where the gain has no value.
        """
        return frequency_response(self.at, self.kind, frequency)

    def to_state_space(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Divide E out: A (nx, nx), B (nx, nr), C (ny, nx), D (ny, nr) of x' = A x + B r."""
        A, B = (np.linalg.solve(self.E, each) for each in (self.A, self.B))
        return A, B, self.C, self.D

    def to_scipy(self) -> scipy.signal.StateSpace:
        """Convert into a continuous `scipy.signal.StateSpace`."""
        from scipy.signal import StateSpace

        return StateSpace(*self.to_state_space())

    def to_control(self) -> control.StateSpace:
        """Convert into a continuous `control.StateSpace` with names of states and signals.

        Raises:
            InputError: Where python-control is not installed.
        """
        try:
            import control
        except ImportError:
            command = install_command("control")
            raise InputError(f"python-control is not installed; run {command}.") from None
        return control.ss(
            *self.to_state_space(),
            states=list(self.states), inputs=list(self.inputs), outputs=list(self.outputs),
        )  # fmt: skip

    def to_dataframe(self) -> pd.DataFrame:
        """Tabulate the poles: real and imaginary part in 1/s, damping ratio, and in Hz the natural
        frequency and the damped one, at which it is seen to swing."""
        import pandas as pd

        s = self.poles[np.lexsort((self.poles.imag, np.abs(self.poles)))]
        size = np.abs(s)
        damping = np.where(size > 0.0, -s.real / np.where(size > 0.0, size, 1.0), np.nan)
        hertz = {"natural_hz": size, "damped_hz": np.abs(s.imag)}
        scaled = {name: values / (2.0 * np.pi) for name, values in hertz.items()}
        return pd.DataFrame({"real": s.real, "imag": s.imag, **scaled, "damping": damping})

    def plot(self, view: str = "frequency") -> go.Figure:
        """Draw the model.

        Args:
            view: 'frequency', 'step' or 'poles'.

        Raises:
            InputError: Where the view is not known.
        """
        views: dict[str, Any] = {
            "frequency": lambda: draw_frequency(self.frequency_response()),
            "step": lambda: draw_step(self.step()),
            "poles": lambda: draw_poles(self.poles, self.modes),
        }
        return chosen(views, view)

    def __repr__(self) -> str:
        modes = ", ".join(f"{m.frequency:.4g} Hz ({m.damping:.2g})" for m in self.modes)
        return (
            f"LinearModel with {len(self.states)} states: {', '.join(self.inputs)} -> "
            f"{', '.join(self.outputs)}\nDamped frequencies (damping ratios): {modes or 'none'}"
        )

    def _repr_html_(self) -> str:
        return str(html_table(mode_table(self.modes)))


def linear_model(
    model: Model,
    theta: Sequence[float] | None,
    theta2: float | None,
    output: str | None,
    values: Mapping[str, float],
) -> LinearModel:
    """Linearise a model; the arguments are those of `Project.linear`, `theta2` in rad. InputError
    where the arm has no such posture."""
    joints = np.zeros(model.arm.joints)
    if theta is not None and theta2 is not None:
        raise InputError("linear has both theta and theta2; give one of them.")
    if theta is not None:
        if len(theta) != len(joints):
            raise InputError(f"theta has {len(theta)} values; the arm has {len(joints)} joints.")
        joints[:] = theta
    if theta2 is not None:
        if len(joints) < 2:
            raise InputError("The arm has one joint and no theta2; give theta.")
        joints[1] = theta2
    model.check_values(values)
    return LinearModel(
        posture(model, joints, model.numbers(values)), output or default_output(model)
    )
