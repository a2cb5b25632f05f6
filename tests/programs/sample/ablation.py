"""`python -m tests.programs.sample.ablation`: what each mechanism of the search is worth.

Each switch takes one mechanism out, in a process of its own, and the sample is run without it. The
table lists the cases that change and the processor time, beside the same version with everything.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np

from flexgui.core.resumable.journal import Journal
from tests.programs.sample.__main__ import REFERENCE, WORKERS, diagnose_in_process, version
from tests.programs.sample.cases import Case, cases
from tests.programs.sample.judge import BETTER, EQUAL, WORSE, compare, is_right

Patch = tuple[str, Callable[..., Any]]


def _first(*arguments: Any, **_: Any) -> Any:
    """Leaves the model that it is given."""
    return arguments[0]


def _data_and_fit(data: Any, fit: Any, *_: Any) -> Any:
    return data, fit


def _none(*_: Any, **__: Any) -> None:
    return None


def _nothing_missed(*_: Any) -> dict[str, float]:
    return {}


def _no(*_: Any, **__: Any) -> bool:
    return False


def _all_go_on(runners: Sequence[Any], *_: Any) -> list[bool]:
    return [True] * len(runners)


def _fit(data: Any, fit: Any, *_: Any) -> Any:
    return fit


def _starts(residuals: Any, starts: Any, *_: Any) -> Any:
    return list(starts)


def _own_start(values: Any) -> Callable[..., Any]:
    return lambda *_, **__: values


SWITCHES: Mapping[str, Sequence[Patch]] = {
    "progressive horizon, refits": [("core.estimate.starts._informative_share", _none)],
    "nominal start of a minimum": [("core.estimate.minimum.other_start", _none)],
    "nominal start of a refit": [("core.estimate.starts.differs_from_nominal", _no)],
    "progressive horizon, identification": [
        ("core.identify.fit.starts_over_horizon", _starts),
    ],
    "shape refinement": [("core.diagnose.acceptance.refine_force_shape", _fit)],
    "successive halving": [("core.diagnose.search_round.still_competitive", _all_go_on)],
    "exchange": [("core.diagnose.search.best_exchange", _none)],
    "prune": [("core.diagnose.search.Search._reduction", _none)],
    "bending shapes": [("core.diagnose.search.resolved", _first)],
    "limits of idealised laws": [("core.estimate.fitted_model.law_error", _nothing_missed)],
    "floor re-estimation": [
        ("core.diagnose.search.lower_floors", _none),
        ("core.diagnose.search.higher_floors", _none),
    ],
    "final polish": [("core.diagnose.diagnose.converge_precisely", _data_and_fit)],
    "defect correction of the identification": [
        ("core.identify.fit._with_corrected_steps", lambda r, rough, stopped: (r, rough))
    ],
    "several starts": [("core.identify.fit.several_starts", lambda r, start, spec: [start])],
    "simulated deviations": [("core.diagnose.diagnose.with_simulated_deviations", _fit)],
    "prediction-error bound": [("core.noise.output_noise.white_noise_bound", _none)],
    "noise per recording": [("core.noise.output_noise.noise_ratios", lambda r: np.ones(len(r)))],
    "next experiments": [("core.diagnose.ladder.deciding_experiments", lambda *_: ())],
    "validation as a gate": [
        ("core.diagnose.judgement.Judge.unseen", _none),
    ],
}  # fmt: skip


def _place(target: str) -> tuple[Any, str]:
    """The module or class of a dotted name, and the name in it."""
    parent, _, attribute = target.rpartition(".")
    module, _, last = parent.rpartition(".")
    if last[0].isupper():
        return getattr(importlib.import_module(f"flexgui.{module}"), last), attribute
    return importlib.import_module(f"flexgui.{parent}"), attribute


def switch_off(name: str) -> None:
    """Takes a mechanism out of this process."""
    for target, replacement in SWITCHES[name]:
        place, attribute = _place(target)
        assert hasattr(place, attribute), target
        setattr(place, attribute, replacement)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs what is not in the journal yet, and prints the table."""
    parser = argparse.ArgumentParser(prog="ablation", description=__doc__)
    parser.add_argument("words", nargs="*", help="only mechanisms whose names hold one of these")
    parser.add_argument("--answer", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.answer:
        from tests.programs.sample.__main__ import SECONDS, diagnose_case

        name, case = given.answer
        switch_off(name)
        print(json.dumps(diagnose_case(cases()[case], SECONDS)))
        return 0
    chosen = [n for n in SWITCHES if any(w in n for w in given.words or [""])]
    journal = Journal(Path("reports") / f"ablation_{version()}.jsonl")
    known = {tuple(k.split("|")): r for k, r in journal.records.items()}
    left = [(n, c) for n in ["", *chosen] for c in ended() if (n, c) not in known]
    with journal.writing() as writer, ThreadPoolExecutor(WORKERS) as pool:
        runs = {pool.submit(_run, *one): one for one in left}
        for done in as_completed(runs):
            name, case = runs[done]
            record = known[name, case] = {**done.result(), "key": f"{name}|{case}"}
            writer.line(json.dumps(record))
            print(name, case, record["cpu"], file=sys.stderr, flush=True)
    print("\n".join(table(chosen, known)))
    return 0


def ended() -> dict[str, Case]:
    """The cases of the sample that ended in the reference: the others say nothing of any part."""
    reference = Journal(REFERENCE).records
    return {n: c for n, c in cases().items() if "failed" not in reference[n]}


def _run(name: str, case: str) -> dict[str, Any]:
    if not name:
        return diagnose_in_process(case)
    return diagnose_in_process(case, ("tests.programs.sample.ablation", "--answer", name))


def table(chosen: Sequence[str], known: Mapping[Any, Mapping[str, Any]]) -> list[str]:
    """Markdown: which cases get worse or better without each mechanism, and s of a processor."""
    lines = ["| without | right | worse | better | CPU [s] |", "|---|---:|---|---|---:|"]
    for name in ["", *chosen]:
        right, cpu = 0, 0.0
        changed: dict[str, list[str]] = {WORSE: [], BETTER: [], EQUAL: []}
        for c, one in ended().items():
            changed[compare(one, known[name, c], known["", c])].append(c)
            right, cpu = right + is_right(one, known[name, c]), cpu + known[name, c]["cpu"]
        worse, better = (", ".join(changed[kind]) for kind in (WORSE, BETTER))
        lines.append(f"| {name or 'nothing'} | {right} | {worse} | {better} | {cpu:.0f} |")
    return lines


if __name__ == "__main__":
    raise SystemExit(main())
