"""FlexGUI: identify flexible robot arms, on a page, from the command line or as a library.

    import flexgui as fg

    rig = fg.load("rig.toml")            # or fg.project(...) from Python objects and tables
    found = rig.identify()
    print(found.values["EI1"])
    found.plot("convergence").show()
    rig.diagnose().export("reports/rig")

Projects     load, open, project, scenarios, Project
Results      Identification, Diagnosis, Comparison, ResidualAnalysis, Simulation, Prediction,
             Profile, Plan, LinearModel
Their parts  Estimate, RankedEffect, LadderStep, ChannelError, RecordingComparison,
             ChannelComparison, Proposal, ProposedLaw
The rig      Arm, Segment, Drive, DriveLaw, Sensor, Channel, Excitation, Parameter, Recording
Effects      Effect, EffectParameter, formula, static_law
Catalogues   drives, effects, excitations, presets, sensors; register, unregister
Messages     Update (progress), InputError, StoppedError

All numbers are in SI units. Results are frozen; they print as text, are tables by `to_dataframe()`
and figures by `plot()`. `help(fg.Project)` explains each step.

Names are imported when they are first used: `import flexgui` itself loads nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "flexgui.library.building": "load project",
    "flexgui.library.opening": "open",
    "flexgui.library.plan": "Plan",
    "flexgui.library.project": "Project",
    "flexgui.library.comparison": "Comparison Simulation",
    "flexgui.library.predictions": "Prediction Profile",
    "flexgui.library.residuals": "ResidualAnalysis",
    "flexgui.library.identification": "Identification",
    "flexgui.library.diagnosis": "Diagnosis StoppedError",
    "flexgui.library.linear_model": "LinearModel",
    "flexgui.library.progress_callback": "Update",
    "flexgui.library.catalogues": (
        "drives effects excitations formula register sensors unregister"
    ),
    "flexgui.library.shipped": "scenarios",
    "flexgui.core.arm.arm": "Arm",
    "flexgui.core.arm.presets": "presets",
    "flexgui.core.arm.segment": "Segment",
    "flexgui.core.drives.drive": "Drive",
    "flexgui.core.drives.law": "DriveLaw static_law",
    "flexgui.core.effects.effect": "Effect EffectParameter",
    "flexgui.core.errors": "InputError",
    "flexgui.core.excitation.excitation": "Excitation",
    "flexgui.core.parameters": "Parameter",
    "flexgui.core.recording.recording": "Recording",
    "flexgui.core.results": (
        "ChannelComparison ChannelError Estimate LadderStep Proposal ProposedLaw RankedEffect "
        "RecordingComparison"
    ),
    "flexgui.core.sensors.sensor": "Channel Sensor",
}
_MODULES = {name: module for module, names in _HOME.items() for name in names.split()}

if TYPE_CHECKING:
    from flexgui.core.arm.arm import Arm as Arm
    from flexgui.core.arm.presets import presets as presets
    from flexgui.core.arm.segment import Segment as Segment
    from flexgui.core.drives.drive import Drive as Drive
    from flexgui.core.drives.law import DriveLaw as DriveLaw
    from flexgui.core.drives.law import static_law as static_law
    from flexgui.core.effects.effect import Effect as Effect
    from flexgui.core.effects.effect import EffectParameter as EffectParameter
    from flexgui.core.errors import InputError as InputError
    from flexgui.core.excitation.excitation import Excitation as Excitation
    from flexgui.core.parameters import Parameter as Parameter
    from flexgui.core.recording.recording import Recording as Recording
    from flexgui.core.results import ChannelComparison as ChannelComparison
    from flexgui.core.results import ChannelError as ChannelError
    from flexgui.core.results import Estimate as Estimate
    from flexgui.core.results import LadderStep as LadderStep
    from flexgui.core.results import Proposal as Proposal
    from flexgui.core.results import ProposedLaw as ProposedLaw
    from flexgui.core.results import RankedEffect as RankedEffect
    from flexgui.core.results import RecordingComparison as RecordingComparison
    from flexgui.core.sensors.sensor import Channel as Channel
    from flexgui.core.sensors.sensor import Sensor as Sensor
    from flexgui.library.building import load as load
    from flexgui.library.building import project as project
    from flexgui.library.catalogues import drives as drives
    from flexgui.library.catalogues import effects as effects
    from flexgui.library.catalogues import excitations as excitations
    from flexgui.library.catalogues import formula as formula
    from flexgui.library.catalogues import register as register
    from flexgui.library.catalogues import sensors as sensors
    from flexgui.library.catalogues import unregister as unregister
    from flexgui.library.comparison import Comparison as Comparison
    from flexgui.library.comparison import Simulation as Simulation
    from flexgui.library.diagnosis import Diagnosis as Diagnosis
    from flexgui.library.diagnosis import StoppedError as StoppedError
    from flexgui.library.identification import Identification as Identification
    from flexgui.library.linear_model import LinearModel as LinearModel
    from flexgui.library.opening import open as open  # noqa: A001
    from flexgui.library.plan import Plan as Plan
    from flexgui.library.predictions import Prediction as Prediction
    from flexgui.library.predictions import Profile as Profile
    from flexgui.library.progress_callback import Update as Update
    from flexgui.library.project import Project as Project
    from flexgui.library.residuals import ResidualAnalysis as ResidualAnalysis
    from flexgui.library.shipped import scenarios as scenarios
else:

    def __getattr__(name: str) -> Any:
        """Import a public name at its first use."""
        if name not in _MODULES:
            raise AttributeError(f"module 'flexgui' has no attribute {name!r}")
        found = getattr(import_module(_MODULES[name]), name)
        if isinstance(found, type) and hasattr(found, "__dataclass_fields__"):
            from flexgui.core.field_texts import FieldDoc

            found.__doc__ = FieldDoc(found.__doc__)  # `help()` shows its fields, as of an arm
        globals()[name] = found
        return found

    def __dir__() -> list[str]:
        return sorted([*_MODULES, "__version__"])
