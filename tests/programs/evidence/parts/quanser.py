"""Published recordings: two benches with two flexible links."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from flexgui.core.results import Outcome, RecordingComparison
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.schema import DiagnoseSpec
from flexgui.core.workbench import run_scenario
from tests.programs.evidence.frame import Summary, better, table

TITLE = "Published benches with two flexible links"
ORDER = 2
FILES = ("quanser_2dsfl_steps.csv", "ctu_2dsfl_lqr.csv")
SCENARIO = Path(__file__).resolve().parents[4] / "scenarios" / "bench_2dsfl.toml"
OURS, UNCOUPLED = "Coupled arm, identified", "Two uncoupled stages, identified"


def _run(folder: Path, diagnosed: bool) -> Outcome:
    scenario = read_scenario(SCENARIO)
    if not diagnosed:
        scenario = scenario.model_copy(update={"diagnose": DiagnoseSpec()})
        scenario.model_fields_set.discard("diagnose")
    else:
        scenario = scenario.model_copy(update={"compare": ()})
    return run_scenario(scenario, folder=SCENARIO.parent, data_folder=folder)


def _errors(found: Sequence[RecordingComparison]) -> dict[str, dict[str, float]]:
    return {c.recording: {x.channel: x.normalised_error for x in c.channels} for c in found}


def models(folder: Path) -> dict[str, Any]:
    """The manufacturer's uncoupled model, at its values and identified, beside the coupled arm."""
    outcome = _run(folder, diagnosed=False)
    return {OURS: _errors(outcome.comparisons)} | {
        v.title: _errors(v.comparisons) for v in outcome.variants
    }


def ladder(folder: Path) -> dict[str, Any]:
    """What the diagnosis adds on the first bench, and what that leaves on both."""
    outcome = _run(folder, diagnosed=True)
    found = outcome.diagnosis
    assert found is not None
    return {
        "added": list(found.added),
        "verdict": found.final_verdict,
        "before": _errors(found.given),
        "after": _errors(found.left),
    }


CASES = {"models": models, "ladder": ladder}


def summary(found: Mapping[str, Any]) -> Summary:
    """Against the manufacturer's model."""
    if "models" not in found:
        return []
    ours, peer = (found["models"][name]["lqr"]["strain2"] for name in (OURS, UNCOUPLED))
    return [(
        "two-link bench, unseen recording: error of the second strain", f"{ours:.2f}",
        f"{peer:.2f}, the manufacturer's model, identified", better(ours, peer),
    )]  # fmt: skip


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    texts = [
        "`steps` is the manufacturer's recording on its own bench; it is estimated. `lqr` is a "
        "university's on another bench of the same type with other friction; it is judged. The "
        "table has the error of the links' strains relative to their spread. A virtual servo "
        "follows the encoders."
    ]
    if "models" in found:
        rows = [[title, *_cells(each)] for title, each in found["models"].items()]
        head = ("model", "steps ε1", "steps ε2", "lqr ε1", "lqr ε2")
        texts.append(table(head, rows))
    if "ladder" in found:
        one = found["ladder"]
        texts.append(
            f"**Ladder**: {', '.join(one['added']) or 'nothing'}; verdict on what remains: "
            f"{one['verdict']}."
        )
        rows = [[f"{r} {channel}", f"{error:.2f}", f"{one['after'][r][channel]:.2f}"]
                for r, channels in one["before"].items() if r in one["after"]
                for channel, error in channels.items()]  # fmt: skip
        texts.append(table(("recording, channel", "before", "after"), rows))
    return "\n\n".join(texts)


def _cells(each: Mapping[str, Mapping[str, float]]) -> list[str]:
    return [f"{each[r][c]:.2f}" for r in ("steps", "lqr") for c in ("strain1", "strain2")]
