"""A scenario as a Python object."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexgui.core.diagnose.search_options import DEFAULT_EFFECTS
from flexgui.core.processors import at_most
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.results import Proposal
from flexgui.core.scenario.stated_effects import arms_to_compile, with_hidden_effects
from flexgui.core.validation import validated
from flexgui.library.comparison import Comparison, Simulation, reference_signals
from flexgui.library.diagnosis import Diagnosis, StoppedError
from flexgui.library.identification import Identification
from flexgui.library.linear_model import LinearModel, linear_model
from flexgui.library.progress_callback import Callback, at_work
from flexgui.library.stated_project import StatedProject

if TYPE_CHECKING:
    import pandas as pd

    from flexgui.core.results import Outcome
    from flexgui.library.plan import Plan


@dataclass(frozen=True, repr=False)
class Project(StatedProject):
    """A scenario with the places of its recordings. Frozen: each change is a new project."""

    def recordings(self, progress: Callback | None = None) -> tuple[Recording, ...]:
        """Read or simulate all recordings, in SI units.

        Args:
            progress: Called after each step.

        Returns:
            One per entry of `[[recordings]]`, in their order.

        Raises:
            InputError: Where a file is missing or wrong; it names file, column and row.
        """
        with at_work(progress) as heard:
            from flexgui.core.loading import load_recordings

            heard.stage("Reading the recordings", len(self.scenario.recordings))
            return tuple(load_recordings(self.scenario, self.model, self.folder, self.data, heard))

    def simulate(
        self,
        *,
        name: str = "simulated",
        hidden: Mapping[str, Mapping[str, float]] | None = None,
        role: str = "estimate",
        noise: bool = True,
        references: pd.DataFrame | None = None,
        values: Mapping[str, float] | None = None,
        state: Mapping[str, float] | None = None,
        **settings: Any,
    ) -> Simulation:
        """Simulate one experiment with the model as stated.

        Args:
            name: Of the recording.
            hidden: Effects of the simulated machine, id -> {parameter: value}; the machine is
                then the bare model with these alone, as in a scenario.
            role: 'estimate' or 'validate'.
            noise: Whether sensors have the noise that the scenario states.
            references: Table with `t` and the references of the drive, such as dtheta1_ref and
                dtheta2_ref, in SI units or those of the headings; instead of an excitation. Times
                are even. Other columns play no part.
            values: Parameter -> value in SI units; the scenario's own where not named.
            state: Coordinate, or its rate with a d before it -> where it begins, in SI units, such
                as {"dtheta1": 0.2, "v1_1": 0.01}; at rest and straight where not named.
            **settings: As `simulate` of a recording: theta2 [rad], seconds, seed, snr_db, ...

        Returns:
            The recording, as a rig would have written it.

        Raises:
            InputError: Where a setting is wrong.
        """
        from flexgui.core.loading import joint_units

        bare, played = self.model, None
        if references is not None:
            channels = bare.drive.reference_channels(bare.arm)
            played, clock = reference_signals(references, channels, joint_units(bare.arm))
            settings = {**settings, **clock}
        spec = validated(SimulateSpec, settings, "simulate")
        bare.check_values(values or {})
        model = bare if hidden is None else with_hidden_effects(bare, hidden, name)
        with at_work(None):
            from flexgui.core.loading import noise_levels
            from flexgui.core.simulate.experiment import NO_NOISE, simulate_recording

            levels = noise_levels(self.scenario.sensors) if noise else NO_NOISE
            made = simulate_recording(model, spec, name, role, levels, played, values, state)
        return Simulation(made, joint_units(model.arm))

    def identify(
        self, progress: Callback | None = None, *, check: bool = True, workers: int | None = None
    ) -> Identification:
        """Estimate the parameters of `[identify]`.

        Args:
            progress: Called after each step; returning False stops with the best so far.
            check: Whether the recordings are checked for faults.
            workers: Processors to use at most; all where not given.

        Returns:
            Estimates, how far they are known, and the comparison with the measurements.

        Raises:
            InputError: Where the scenario or a recording is wrong.
        """
        alone = self.with_settings(diagnose=None)
        return Identification(self, alone._run(progress, check, workers))

    def diagnose(
        self,
        progress: Callback | None = None,
        *,
        max_effects: int | None = None,
        check: bool = True,
        workers: int | None = None,
    ) -> Diagnosis:
        """Identify, then find which effects the model lacks.

        Args:
            progress: Called after each step; returning False stops.
            max_effects: Effects to add at most; as `[diagnose]` states, else 3.
            check: Whether the recordings are checked for faults.
            workers: Processors to use at most; all where not given.

        Returns:
            Verdict, ranking of the effects, and the ladder of errors.

        Raises:
            InputError: Where the scenario or a recording is wrong.
            StoppedError: Where it was stopped before it began; it holds the identification.
        """
        stated = self.scenario.diagnose.max_effects
        most = max_effects if max_effects is not None else stated or DEFAULT_EFFECTS
        asked = self.with_settings(diagnose={"max_effects": most})
        outcome = asked._run(progress, check, workers)
        if outcome.diagnosis is None:
            raise StoppedError(Identification(asked, outcome))
        return Diagnosis(asked, outcome)

    def propose(self, progress: Callback | None = None, *, workers: int | None = None) -> Proposal:
        """Fit the model, and propose laws for what it leaves; no listed effect is tried.

        Args:
            progress: Called after each step; returning False stops.
            workers: Processors to use at most; all where not given.

        Returns:
            One to three laws, or why there is none, and the variables that the rest depends on.
            `law.settings` of one is an effect for `with_effects`.

        Raises:
            InputError: Where the scenario or a recording is wrong.
        """
        with at_work(progress, workers=workers) as heard:
            from flexgui.core.workbench import propose_for

            return propose_for(self.scenario, **self._places, progress=heard)

    def plan(
        self,
        seconds: float = 60.0,
        *,
        parameters: Sequence[str] = (),
        between: Sequence[str] = (),
        progress: Callback | None = None,
        workers: int | None = None,
    ) -> Plan:
        """Choose the experiments to make next, within `[limits]`.

        Args:
            seconds: Time that there is, in s, all experiments together.
            parameters: Names of those to know better; all that are estimated where none is named.
            between: Ids of two effects to distinguish.
            progress: Called after each experiment that was simulated.
            workers: Processors to use at most; all where not given.

        Returns:
            References to play, and the deviations before and after.

        Raises:
            InputError: Where the scenario, a recording or an option is wrong.
        """
        with at_work(progress, workers=workers) as heard:
            from flexgui.core.experiments.design import ExperimentRequest
            from flexgui.core.experiments.plan import plan
            from flexgui.library.plan import Plan

            request = ExperimentRequest(
                seconds, tuple(parameters), tuple(between), self.scenario.limits
            )
            return Plan(self, plan(self.scenario, request, **self._places, progress=heard))

    def compare(
        self,
        values: Mapping[str, float] | None = None,
        progress: Callback | None = None,
        *,
        workers: int | None = None,
    ) -> Comparison:
        """Compare measurements and model at given values; nothing is estimated.

        Args:
            values: Parameter -> value in SI units; the scenario's own where not named.
            progress: Called after each recording.
            workers: Processors to use at most; all where not given.

        Returns:
            Measured, modelled and what is left, per recording and output.

        Raises:
            InputError: Where a parameter is not known or a recording is wrong.
        """
        with at_work(progress, workers=workers) as heard:
            from flexgui.core.workbench import compare_at

            found = compare_at(self.scenario, values or {}, **self._places, progress=heard)
            return Comparison(found)

    def linear(
        self,
        theta: Sequence[float] | None = None,
        *,
        theta2: float | None = None,
        output: str | None = None,
        values: Mapping[str, float] | None = None,
    ) -> LinearModel:
        """Linearise the model at rest, with the drive's loop closed.

        Args:
            theta: Joint positions (joints,), rad (m on a slide); zeros where not given.
            theta2: rad, of the second joint alone; instead of `theta`.
            output: Id of the sensor that y is; the paper's where it is defined.
            values: Parameter -> value in SI units; the scenario's own where not named.

        Returns:
            E x' = A x + B r, y = C x + D r, as numbers, for SciPy or python-control.

        Raises:
            InputError: Where a parameter or an output is not known.
        """
        return linear_model(self.model.steered_by(None), theta, theta2, output, values or {})

    def export(
        self,
        folder: str | Path,
        progress: Callback | None = None,
        *,
        check: bool = True,
        workers: int | None = None,
    ) -> Path:
        """Run everything that the scenario asks for and write the report.

        Args:
            folder: For report.html, result.json, tables and model; made where it is missing.
            progress: Called after each step.
            check: Whether the recordings are checked for faults.
            workers: Processors to use at most; all where not given.

        Returns:
            The path of report.html.

        Raises:
            InputError: Where the scenario or a recording is wrong, or nothing can be written.
        """
        from flexgui.export.folder import check_writable

        with at_most(workers):
            check_writable(Path(folder))
            self._write(self._run(progress, check), Path(folder))
        return Path(folder) / "report.html"

    def _run(self, progress: Callback | None, check: bool, workers: int | None = None) -> Outcome:
        with at_work(progress, arms_to_compile(self.scenario), workers) as heard:
            from flexgui.core.workbench import run_scenario

            return run_scenario(self.scenario, **self._places, progress=heard, check=check)
