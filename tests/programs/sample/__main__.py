"""`make sample`: thirty diagnoses with a known truth, beside a stored reference.

The yardstick of every change of the method. What a version of `core` has answered is kept in
`reports/`, so a second call goes on where the first one stopped; a changed `core` begins anew.
Four more sets are run alike: `--set rigs` has forty rigs with recorded torques, `--set long` every
effect in seven recordings of 3,000 samples, `--set cuts` recordings that begin in mid-motion, and
`--set hz` thirty arms with gauges and currents at 100 Hz.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import resource
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import flexgui.core
from flexgui.core.resumable.journal import Journal
from tests.programs.sample import cases, cut_recordings, forty_rigs, hundred_hz, long_recordings
from tests.programs.sample.cases import Case
from tests.programs.sample.judge import line, summary

CASES = Path(__file__).parent
SETS = {
    "sample": cases.cases,
    "rigs": forty_rigs.cases,
    "long": long_recordings.cases,
    "cuts": cut_recordings.cases,
    "hz": hundred_hz.cases,
}
REFERENCE = CASES / "reference.jsonl"
WORKERS = 2
SECONDS = 75.0
"""of CPU that a case may take; then it counts as one that did not end."""
PATIENCE = 2.5
"""Times as long by the clock: other work may go on beside."""


def diagnose_case(case: Case, seconds: float) -> dict[str, Any]:
    """What a diagnosis says of the files of one case, as plain values, within that CPU time."""
    from flexgui.core.processors import at_most
    from flexgui.core.scenario.read import read_scenario
    from flexgui.core.workbench import run_scenario
    from flexgui.export.result import result

    with TemporaryDirectory() as folder, at_most(1):
        path = case.write(Path(folder))
        begun, clock = time.process_time(), time.perf_counter()
        limit = int(begun + seconds)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 1))
        outcome = run_scenario(read_scenario(path), folder=path.parent)
        cpu, by_clock = time.process_time() - begun, time.perf_counter() - clock
    assert outcome.diagnosis is not None
    found, last = result(outcome, []), outcome.diagnosis.steps[-1]
    return {
        "key": case.name,
        "kept": list(last.model),
        "shapes": list(outcome.diagnosis.shapes),
        "verdict": found["verdict"],
        "final_verdict": found["final_verdict"],
        "values": {p["name"]: float(f"{p['value']:.8g}") for p in found["parameters"]},
        "error": round(float(last.cost_per_sample) ** 0.5, 4),
        "cpu": round(cpu, 1),
        "seconds": round(by_clock, 1),
    }


def diagnose_in_process(
    name: str,
    module: Sequence[str] = ("tests.programs.sample", "--answer"),
    seconds: float = SECONDS,
) -> dict[str, Any]:
    """The record of one case, from a process of its own that may take so many `seconds`."""
    command = [sys.executable, "-m", *module, name]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=PATIENCE * seconds, check=False
        )
    except subprocess.TimeoutExpired:
        return {"key": name, "failed": "did not end", "cpu": seconds}
    if done.returncode:
        said = done.stderr.strip().splitlines() or [f"ended with {done.returncode}"]
        failed = "did not end" if done.returncode < 0 else said[-1]
        return {"key": name, "failed": failed, "cpu": seconds}
    return dict(json.loads(done.stdout.splitlines()[-1]))


def version() -> str:
    """Changes with any source of `core`, and with the cases."""
    digest = hashlib.sha256()
    for folder in (Path(flexgui.core.__file__).parent, CASES, CASES.parent / "mujoco"):
        for file in sorted([*folder.rglob("*.py"), *folder.glob("*truth.json")]):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def run(
    chosen: Mapping[str, Case], reference: Mapping[str, Any], options: argparse.Namespace
) -> dict[str, Any]:
    """The records of all cases; those that are not known yet are run."""
    journal = Journal(Path("reports") / f"{options.set}_{version()}.jsonl")
    module = (
        "tests.programs.sample",
        "--set",
        options.set,
        "--seconds",
        str(options.seconds),
        "--answer",
    )
    records = {n: r for n, r in journal.records.items() if n in chosen}
    for name in records:
        print(line(chosen[name], records[name], reference.get(name)), flush=True)
    left = [name for name in chosen if name not in records]
    with journal.writing() as writer, ThreadPoolExecutor(options.workers) as pool:
        jobs = [pool.submit(diagnose_in_process, name, module, options.seconds) for name in left]
        for done in as_completed(jobs):
            record = done.result()
            writer.line(json.dumps(record))
            name = record["key"]
            records[name] = record
            print(line(chosen[name], record, reference.get(name)), flush=True)
    return records


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit code 1 where a case is worse than in the reference."""
    parser = argparse.ArgumentParser(prog="make sample", description=__doc__)
    parser.add_argument("words", nargs="*", help="only cases whose names hold one of these")
    parser.add_argument("--store", action="store_true", help="the result becomes the reference")
    parser.add_argument("--set", choices=SETS, default="sample")
    parser.add_argument(
        "--seconds", type=float, default=SECONDS, help="of CPU that a case may take"
    )
    parser.add_argument("--workers", type=int, default=WORKERS, help="cases side by side")
    parser.add_argument("--answer", help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    known = SETS[given.set]()
    if given.answer:
        print(json.dumps(diagnose_case(known[given.answer], given.seconds)))
        return 0
    words = given.words or [""]
    chosen = {n: c for n, c in known.items() if any(word in n for word in words)}
    reference = Journal(REFERENCE).records if given.set == "sample" else {}
    records = run(chosen, reference, given)
    comparison = summary(known, records, {n: r for n, r in reference.items() if n in chosen})
    print(comparison)
    if given.store and given.set == "sample":
        lines = [json.dumps(records[name]) for name in known if name in records]
        REFERENCE.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return int("as a whole: worse" in comparison)


if __name__ == "__main__":
    raise SystemExit(main())
