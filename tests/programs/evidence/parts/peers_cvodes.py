"""SciPy's and lmfit's least squares over CVODES: what one writes for a fit with free tools."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from flexgui.core.simulate.state_equations import state_equations
from flexgui.library.casadi_function import casadi_function
from tests.programs.bench.case import NOISE, TRUTH
from tests.programs.bench.comparisons.fit import FIRST, Fitting, make_fitting
from tests.programs.bench.peers import ABSOLUTE, held_stretches
from tests.programs.evidence.frame import Summary, better, table

TITLE = "Peers on equal data: least squares over CVODES"
ORDER = 3
FILES: tuple[str, ...] = ()
NEEDS = ("casadi", "lmfit")
SOURCES = ("bench/case.py", "bench/comparisons/fit.py")

NAMES = ("EI1", "EI2")
SECONDS = 3.0
TOLERANCE, STEP = 1e-7, 1e-4
"""Of CVODES, and of the differences that are taken over what it leaves."""
OURS = "FlexGUI"


class Simulation:
    """The tip over the two stiffnesses: FlexGUI's exported CasADi function in CVODES, compiled."""

    def __init__(self, fitting: Fitting) -> None:
        import casadi as ca

        equations = state_equations(fitting.model, {})
        assert equations is not None
        f, self.experiment = casadi_function(equations, NAMES), fitting.experiment
        task = self.experiment.task
        x, r, k = (ca.SX.sym(name, f.size1_in(i)) for i, name in enumerate("xrk"))
        rates, y = f(x, r, k)
        names = [quantity.name for quantity in equations.outputs]
        rows = [names.index(channel) for channel, _ in self.experiment.channels]
        self.tip = ca.Function("tip", [x, r, k], [y[rows]])
        options = {
            "reltol": TOLERANCE, "abstol": TOLERANCE * ABSOLUTE, "max_num_steps": 10**6,
            "jit": True, "compiler": "shell",
            "jit_options": {"compiler": "gcc", "flags": ["-O3", "-march=native"]},
        }  # fmt: skip
        ode = {"x": x, "p": ca.vertcat(r, k), "ode": rates}
        self.stretches, self.count = held_stretches(task), 0
        self.holds = {
            n: ca.integrator(f"hold{n}", "cvodes", ode, 0.0,
                             [task.sample_time * (i + 1) for i in range(n)], options)
            for n in {b - a for a, b in self.stretches}
        }  # fmt: skip

    def errors(self, stiffness: np.ndarray, share: float) -> np.ndarray:
        """Measured minus simulated over the noise, over that share of the recording, flat; CVODES
        begins anew with every change of the references."""
        task, self.count = self.experiment.task, self.count + 1
        states, k = [np.asarray(task.start)[:, None]], stiffness * TRUTH
        for a, b in self.stretches:
            if a > share * len(task.time):
                break
            p = np.concatenate([task.references[a], k])
            states.append(np.array(self.holds[b - a](x0=states[-1][:, -1], p=p)["xf"]))
        x = np.hstack(states)
        tip = np.array(self.tip(x, task.references[: x.shape[1]].T, k)).T
        return np.asarray(
            (self.experiment.measured[: len(tip)] - tip).ravel() / NOISE.by_output["z"]
        )


def by_scipy(errors: Callable[..., np.ndarray], start: np.ndarray) -> np.ndarray:
    """`scipy.optimize.least_squares`, its trust region and differences."""
    return np.asarray(least_squares(errors, start, diff_step=STEP, bounds=(0.2, 5.0)).x)


def by_lmfit(errors: Callable[..., np.ndarray], start: np.ndarray) -> np.ndarray:
    """`lmfit.minimize`, its Levenberg-Marquardt with bounds."""
    import lmfit

    free = lmfit.Parameters()
    for name, x in zip(NAMES, start, strict=True):
        free.add(name, value=x, min=0.2, max=5.0)
    found = lmfit.minimize(
        lambda p: errors(np.array([p[name].value for name in NAMES])), free, epsfcn=STEP**2
    )
    return np.array([found.params[name].value for name in NAMES])


PEERS = {"SciPy over CVODES": by_scipy, "lmfit over CVODES": by_lmfit}


def fitted(modes: int, _: Path) -> dict[str, Any]:
    """Who -> both stiffnesses over the truth, sum of squares by CVODES, and times."""
    fitting = make_fitting(modes, SECONDS)
    fitting.ours()  # compiles
    clock = time.process_time()
    estimates = fitting.ours()
    answers = {OURS: (np.array([e.value for e in estimates]), time.process_time() - clock, 0)}
    clock = sum(os.times()[:4])  # the compiler is a process of its own
    simulation = Simulation(fitting)
    built = sum(os.times()[:4]) - clock
    for name, fit in PEERS.items():
        clock, simulation.count = time.process_time(), 0
        x = fitting.unknowns.parameters.vector() / TRUTH
        for share in (FIRST, 1.0):  # over all of it the start is out of phase
            x = fit(partial(simulation.errors, share=share), x)
        answers[name] = x * TRUTH, time.process_time() - clock, simulation.count
    return {
        "built": built,
        "std": [e.std / TRUTH for e in estimates],
        "answers": {
            name: {"EI": (x / TRUTH).tolist(), "seconds": spent, "simulations": count,
                   "squares": float(np.sum(simulation.errors(x / TRUTH, 1.0) ** 2))}
            for name, (x, spent, count) in answers.items()
        },
    }  # fmt: skip


CASES: dict[str, Callable[[Path], dict[str, Any]]] = {
    f"{n} mode{'s' if n > 1 else ''}": partial(fitted, n) for n in (1, 2)
}

ABOUT = """\
One recording of the paper's arm of 3 s at 1 kHz with a camera's noise; both stiffnesses start \
30 % off. The peers simulate the function that `to_casadi(free=["EI1", "EI2"])` exports with \
CasADi's CVODES in compiled C, first a sixteenth of the recording, then all of it; both \
differentiate by differences. Sum of squares: of the errors in units of the noise, computed by \
CVODES for each answer, over the least. One deviation of the stiffnesses is what FlexGUI states. \
Gauss-Newton on CasADi's own sensitivities, the quicker peer, stands under Speed."""


def summary(found: Mapping[str, Any]) -> Summary:
    """Times; the answers are the same where the sums of squares are."""
    rows = []
    for name, one in found.items():
        spent = {who: a["seconds"] for who, a in one["answers"].items()}
        peer = min(PEERS, key=spent.__getitem__)
        rows.append((
            f"fit of two stiffnesses, {name}", f"{spent[OURS]:.2f} s",
            f"{spent[peer]:.2f} s, {peer}", better(spent[OURS], spent[peer]),
        ))  # fmt: skip
    return rows


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    head = ("modes per segment", "fitted by", "EI1, EI2 off", "one deviation", "sum of squares",
            "processor time", "simulations")  # fmt: skip
    rows = [row for name, one in found.items() for row in _rows(name, one)]
    built = ", ".join(f"{one['built']:.0f} s for {name}" for name, one in found.items())
    return "\n\n".join([ABOUT, table(head, rows), f"The peers' code took {built} to build."])


def _rows(name: str, one: Mapping[str, Any]) -> list[list[str]]:
    least = min(answer["squares"] for answer in one["answers"].values())
    std = ", ".join(f"{s:.3%}" for s in one["std"])
    return [
        [name, who, ", ".join(f"{x - 1:+.3%}" for x in a["EI"]), std,
         f"+{a['squares'] / least - 1:.1e}", f"{a['seconds']:.2f} s", str(a["simulations"] or "")]
        for who, a in one["answers"].items()
    ]  # fmt: skip
