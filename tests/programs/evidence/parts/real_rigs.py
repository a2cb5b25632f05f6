"""Real rigs from plain scenarios: no filter and no noise is stated."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pandas as pd

from flexgui.core.results import Proposal
from flexgui.core.results.diagnosis import Diagnosis, LadderStep
from flexgui.core.scenario.read import read_scenario
from flexgui.core.workbench import run_scenario
from flexgui.sentences.proposal import carrier_words
from flexgui.sentences.written import estimate_text
from tests.programs.evidence.frame import table

TITLE = "Real rigs, plainly stated"
SCENARIOS = Path(__file__).resolve().parents[4] / "scenarios"
ORDER = 3

RIGID = """
[[arm.segments]]
length = {length}
mass = {mass}
modes = 0
"""
JOINT = '\n[drive]\nkind = "torque"\n{constants}\n[identify]\nparameters = ["m1"]\n'
LOGGED = (
    'columns = { strain1 = "deflection1", strain2 = "deflection2" }\n'
    "logger_filter = { strain1 = { frequency = 12.57, damping = 0.9 }, "
    "strain2 = { frequency = 12.57, damping = 0.9 } }"
)
BENCH = """
[arm]
preset = "two_stage_bench"

[drive]
kind = "torque"
torque_constants = [8.925, 0.87]

[sensors]
strain1 = { place = 0.0, distance = -0.0673 }
strain2 = { place = 0.0, distance = -0.0673 }

[identify]
parameters = ["EI1", "EI2", "tau1", "tau2"]
output = ["torque", "strain"]
offsets = ["strain1", "strain2"]
"""
RULER = """
[[arm.segments]]
length = 0.3
mass = 0.03
EI = 0.05
hub_inertia = 0.001
modes = 2

[drive]
kind = "compensator"
gains = [1.0]
zeros = [13.0]
poles = [20.0]

[identify]
parameters = ["EI1", "tau1", "Jh1", "kc1"]
output = ["encoder", "acceleration"]
offsets = ["acceleration1"]
"""
RULER_COLUMNS = """
[recordings.columns]
theta1_ref = { name = "reference", gain = 1e-3 }
theta1 = { name = "encoder", gain = 1e-3 }
acceleration1 = { name = "accelerometer", gain = "unknown" }
"""


def _without_second_encoder(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.drop(columns="deflection1")


def _with_second_encoder(rows: pd.DataFrame) -> pd.DataFrame:
    link = (rows["theta1"] + rows["deflection1"]).rename("link_theta1")
    return _without_second_encoder(rows).assign(link_theta1=link)


def _slide(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.rename(columns={"force": "u1", "q": "theta1", "q_ref": "theta1_ref"})


@dataclass(frozen=True)
class Rig:
    """What a newcomer states of it."""

    title: str
    text: str
    """TOML of arm, drive and parameters."""
    recordings: Sequence[tuple[str, str]]
    """File and role; an empty role: estimated, and the last third validates."""
    extra: str = ""
    """Of each recording."""
    known: str = ""
    """What others found."""
    rig: str = ""
    """TOML of what its owners state of the installation."""
    columns: Callable[[pd.DataFrame], pd.DataFrame] = lambda rows: rows
    """Of a file, as they are stated."""
    shipped: str = ""
    """File of the scenario that comes with the program, in place of a text."""


RIGS = {
    "ur10e_joint1": Rig(
        "UR10e, joint 1 (vertical axis)",
        RIGID.format(length=1.2, mass=10.0) + JOINT.format(constants="torque_constants = [10.0]"),
        [("rigs/ur_j1.csv", "")],
        known="viscous 21.3, Coulomb 12.5",
    ),
    "ur10e_joint2": Rig(
        "UR10e, joint 2 (in the vertical plane)",
        # The encoder counts from the horizontal, and the arm stands upright at -90 degrees.
        "[arm]\ngravity = [0.0, 9.81]\n"
        + RIGID.format(length=1.2, mass=25.0)
        + JOINT.format(constants="torque_constants = [10.6956]"),
        [("rigs/ur_j2a.csv", "estimate"), ("rigs/ur_j2b.csv", "validate")],
        known="viscous 20.2, Coulomb 13.3, grows with the load",
    ),
    "kuka_rigid": Rig(
        "KUKA KR300, joint 1",
        RIGID.format(length=2.0, mass=900.0) + JOINT.format(constants="") + 'output = "torque"\n',
        [(f"rigs/kuka{c}.csv", "estimate") for c in "AB"] + [("rigs/kukaC.csv", "validate")],
        known="Coulomb 285, viscous 2050, asymmetry 54",
        rig="gear_ratio = [256.857]",
        columns=_without_second_encoder,
    ),
    "kuka_elastic": Rig(
        "KUKA KR300, joint 1 with its second encoder; spring and motor as published",
        RIGID.format(length=2.0, mass=900.0)
        + "hub_inertia = 609.0\njoint_compliance = 2.2e-7\n"
        + JOINT.format(constants="")
        + 'output = ["torque", "link_encoder"]\n',
        [(f"rigs/kuka{c}.csv", "estimate") for c in "AB"] + [("rigs/kukaC.csv", "validate")],
        known="spring 4.58e6, motor 609; encoders read 3 ms apart",
        rig="gear_ratio = [256.857]",
        columns=_with_second_encoder,
    ),
    "two_stage_bench": Rig(
        "Bench with two flexible links",
        BENCH,
        [("quanser_2dsfl_steps.csv", "estimate"), ("ctu_2dsfl_lqr.csv", "validate")],
        LOGGED,
        rig="level = true\nrigid_base = true",
        known="coupling, Coulomb friction with presliding, link damping",
    ),
    "flexible_link": Rig(
        "One flexible link on a servo",
        """
[[arm.segments]]
length = 0.419
mass = 0.065
EI = 0.13
modes = 1
hub_inertia = 0.00208

[drive]
kind = "torque"

[identify]
parameters = ["EI1"]
output = ["torque", "deflection"]
""",
        [("rigs/rfl_first.csv", "estimate"), ("rigs/rfl_second.csv", "validate")],
        known="viscous .025 + .069, gauge's scale .6",
    ),
    "tudor": Rig(
        "TUDOR, two elastic links under gravity; gains and torque constants unknown",
        "",
        [("rigs/merit1.csv", "estimate"), ("rigs/merit2.csv", "validate")],
        shipped="tudor.toml",
        known="first current R² .964 by regression on the strains; the second mostly friction",
    ),
    "ruler": Rig(
        "Steel ruler on a motor in a loop, encoder and accelerometer in counts",
        RULER,
        [(f"rigs/slfr_swept{k}.csv", "estimate") for k in (1, 2, 3)]
        + [(f"rigs/slfr_swept{k}.csv", "validate") for k in (4, 5)],
        RULER_COLUMNS,
        known="resonances 3.0 and 16.5 Hz, hub at rest 2.5 Hz",
    ),
    "emps": Rig(
        "EMPS slide",
        '[arm]\npreset = "single_axis"\n\n[drive]\nkind = "torque"\n\n[identify]\n'
        'parameters = ["m1"]\n',
        [("emps.csv", "")],
        known="mass 95.1, viscous 203.5, Coulomb 20.4",
        columns=_slide,
    ),
}
FILES = tuple(sorted({file for rig in RIGS.values() for file, _ in rig.recordings}))
SHARE = 2.0 / 3.0
"""Of a single recording, that is estimated."""


def write_scenario(name: str, folder: Path, work: Path, tables: str) -> Path:
    """The scenario of a rig with more TOML tables and its recordings, in a folder `work`."""
    rig = RIGS[name]
    stated = f"[rig]\n{rig.rig}\n" if rig.rig else ""
    text = f'title = "{rig.title}"\n{rig.text}\n{stated}{tables}\n'
    for file, role in rig.recordings:
        rows = rig.columns(pd.read_csv(folder / file))
        part = round(SHARE * len(rows))
        roles = {role: rows} if role else {"estimate": rows[:part], "validate": rows[part:]}
        for each, some in roles.items():
            path = f"{Path(file).stem}_{each}.csv"
            some.to_csv(work / path, index=False)
            text += f'\n[[recordings]]\nfile = "{path}"\nrole = "{each}"\n{rig.extra}\n'
    (work / "scenario.toml").write_text(text, encoding="utf-8")
    return work / "scenario.toml"


def diagnose(name: str, folder: Path) -> dict[str, Any]:
    """The verdict on one rig as plain values."""
    with TemporaryDirectory() as temporary:
        work = Path(temporary)
        path = SCENARIOS / RIGS[name].shipped
        if not RIGS[name].shipped:
            path = write_scenario(name, folder, work, "[diagnose]\nmax_effects = 4\n")
        start = time.process_time()
        found = run_scenario(read_scenario(path), folder=path.parent, data_folder=folder).diagnosis
        seconds = time.process_time() - start
    assert found is not None
    return _plain(found) | {"seconds": seconds}


def _plain(found: Diagnosis) -> dict[str, Any]:
    first, last = found.steps[0], found.steps[-1]
    return {
        "verdict": found.final_verdict or found.verdict,
        "added": list(found.kept),
        "values": {
            e.name: [e.value, e.std, e.unit]
            for e in found.parameters
            if e.recording is None and not (e.at_bound or e.undetermined)
        },
        "errors": [_rms(first), _rms(last)],
        "unseen": [_unseen(first), _unseen(last)],
        "refused": [
            f"{title}: {why.reason.value}" for r in found.rounds for title, why in r.refused
        ],
        "ruled_out": dict(found.ruled_out),
        "proposal": _proposal(found.proposal),
    }


def _proposal(proposal: Proposal | None) -> dict[str, Any] | None:
    """What the rest depends on most, and the first law; None where nothing was left."""
    if proposal is None:
        return None
    best, law = next(iter(proposal.carriers), None), next(iter(proposal.laws), None)
    return {
        "carrier": best and [carrier_words(best), best.target_title, best.share],
        "reason": proposal.reason,
        "refused": [why.reason.value for _, why in proposal.refused],
        "law": law and [law.formula, [f"{e.name} = {estimate_text(e)}" for e in law.parameters]],
        "errors": law and list(law.rms),
        "unseen": law and list(law.unseen_rms),
        "seconds": proposal.seconds,
    }


def _rms(step: LadderStep) -> float:
    return float(step.cost_per_sample) ** 0.5


def _unseen(step: LadderStep) -> float:
    """In noise floors, over all channels."""
    squares = [(e.validation_rms / e.floor) ** 2 for e in step.errors]
    return float(sum(squares) / len(squares)) ** 0.5


CASES = {name: partial(diagnose, name) for name in RIGS}


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    head = (
        "rig", "found", "verdict", "error [floors]", "unseen", "CPU s", "sizes", "others found",
        "ruled out as stated",
    )  # fmt: skip
    rows = [_row(RIGS[name], found[name]) for name in RIGS if name in found]
    text = (
        "Arm, drive and files are stated as a newcomer would, without noise, and without filters "
        "but the logger of the bench. Error: of "
        "the model as given and of the last model, in multiples of the estimated noise floor; "
        "*unseen*: the same on recordings, or on a last third, that no fit used. "
        "Sizes: without those that the recordings leave open."
    )
    return f"{text}\n\n{table(head, rows)}\n\n{_laws(found)}"


def _laws(found: Mapping[str, Any]) -> str:
    """Table of what is proposed for the rest."""
    head = (
        "rig", "the rest depends most on", "proposed", "error [floors]", "unseen", "s",
    )  # fmt: skip
    rows = [
        [RIGS[name].title, *_law(one["proposal"])]
        for name, one in found.items()
        if name in RIGS and one.get("proposal")
    ]
    text = (
        "What no listed effect explains, and the law that is proposed for it (method.md, 3.9). "
        "Share: of the squared error above the noise, on quarters of the recordings that the "
        "function was not fitted to. `no_carrier`: no variable carries the rest; `no_law`: each "
        "law that was tried in the model failed a test, `small_share` since it explains too little."
    )
    return f"{text}\n\n{table(head, rows)}"


def _law(one: Mapping[str, Any]) -> list[str]:
    words, target, share = one["carrier"] or ("nothing", "", 0.0)
    carrier = f"{words}, at {target}: {100.0 * share:.0f} %" if target else words
    if not one["law"]:
        refused = f" ({', '.join(one['refused'])})" if one["refused"] else ""
        return [carrier, f"nothing: {one['reason']}{refused}", "", "", f"{one['seconds']:.0f}"]
    formula, values = one["law"]
    return [
        carrier, f"`{formula}`, {', '.join(values)}",
        " → ".join(f"{x:.3g}" for x in one["errors"]),
        " → ".join(f"{x:.3g}" for x in one["unseen"]), f"{one['seconds']:.0f}",
    ]  # fmt: skip


def _row(rig: Rig, one: Mapping[str, Any]) -> list[str]:
    sizes = ", ".join(f"{n} {value:.4g}" for n, (value, _, _) in one["values"].items())
    return [
        rig.title, ", ".join(one["added"]) or "nothing", one["verdict"],
        " → ".join(f"{x:.3g}" for x in one["errors"]),
        " → ".join(f"{x:.3g}" for x in one["unseen"]),
        f"{one['seconds']:.0f}", sizes, rig.known, ", ".join(one["ruled_out"]) or "nothing",
    ]  # fmt: skip
