"""`make fuzz`: each case in a process of its own, its time and memory measured.

The processes are forked from one that has loaded everything, so that a case takes no start-up.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from tests.cli.helpers import FILE, SCENARIO, TEXT, csv, table
from tests.programs.fuzz.cases import EXPORT, SIMULATED, Case, case
from tests.programs.fuzz.judge import fault, perform

SECONDS = 20.0
"""Of a processor, so that other work on the machine does not count."""
HANGING = 6.0 * SECONDS
"""s of a processor, or of waiting for something else than one, after which a case is ended: on a
busy machine it waits its turn for as long as that takes."""
MEMORY = 2_000_000_000
"""Bytes."""
COMPILING = 600.0
"""The same of the first case on a machine."""
TICK = 0.01
"""s"""


@dataclass(frozen=True)
class Outcome:
    """Of one case."""

    number: int
    label: str
    code: int
    said: str
    seconds: float
    memory: int
    """Bytes at most."""

    @property
    def fault(self) -> str:
        """Empty where all is well."""
        if self.seconds > SECONDS:
            return f"took more than {SECONDS:.0f} s"
        if self.code == -signal.SIGKILL:
            return f"waited for {HANGING:.0f} s"
        if self.memory > MEMORY:
            return f"took {self.memory / 1e9:.1f} GB"
        return fault(self.code, self.said)


def arrange(case: Case, folder: Path) -> None:
    for name, content in case.files.items():
        (folder / name).write_bytes(content)


def _child(case: Case, folder: Path, errors: Path) -> None:
    """Never returns."""
    code = 1
    try:
        os.chdir(folder)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.dup2(os.open(errors, os.O_WRONLY | os.O_CREAT), 2)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        code = perform(case)
        sys.stderr.flush()
    except BaseException:
        traceback.print_exc()
        sys.stderr.flush()
    finally:
        os._exit(code)


def attempt(seed: int, number: int) -> Outcome:
    """One case."""
    return measured(case(seed, number), number, HANGING)


def measured(made: Case, number: int, patience: float) -> Outcome:
    """The case in a process of its own, which is killed when its `patience` in s is over."""
    with tempfile.TemporaryDirectory() as place:
        folder, errors = Path(place) / "work", Path(place) / "stderr"
        folder.mkdir()
        arrange(made, folder)
        child = os.fork()
        if child == 0:
            _child(made, folder, errors)
        code, seconds, memory = _wait(child, patience)
        said = errors.read_text("utf-8", "replace") if errors.exists() else ""
    return Outcome(number, made.label, code, said, seconds, memory)


def _wait(child: int, patience: float) -> tuple[int, float, int]:
    """Exit code (negative: killed), s of a processor and bytes."""
    waited, before = 0.0, time.monotonic()
    while True:
        done, status, usage = os.wait4(child, os.WNOHANG)
        if done:
            seconds = usage.ru_utime + usage.ru_stime
            return os.waitstatus_to_exitcode(status), seconds, usage.ru_maxrss * 1024
        runs, worked = _progress(child)
        now = time.monotonic()
        waited, before = waited + (0.0 if runs else now - before), now
        if max(waited, worked) > patience:
            with contextlib.suppress(ProcessLookupError):
                os.kill(child, signal.SIGKILL)
        time.sleep(TICK)


def _progress(process: int) -> tuple[bool, float]:
    """Whether it runs or could if a processor were free, and the s of one that it has had: fields
    state, utime and stime of proc(5), which come after the name in brackets."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    worked = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return fields[0] == "R", worked


def load() -> None:
    """What every command needs, and no thread; on a new machine its code is compiled before."""

    import flexgui.export.export_files
    import flexgui.export.report_motion
    import flexgui.scene.motion_page  # noqa: F401

    whole = Case("undamaged", EXPORT, {SCENARIO: TEXT.encode(), FILE: csv(table()).encode()})
    for made in (whole, Case("simulated", EXPORT, {SCENARIO: SIMULATED.encode()})):
        first = measured(made, -1, COMPILING)
        assert not first.fault or first.seconds > SECONDS, first
        print(f"A case that is {made.label} takes {measured(made, -1, COMPILING).seconds:.1f} s.")


def main() -> int:
    parser = argparse.ArgumentParser(description="Mutated input for the command line.")
    parser.add_argument("--cases", type=int, default=1500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    wanted = parser.parse_args()
    load()
    outcomes = []
    for number in range(wanted.first, wanted.first + wanted.cases):
        outcomes.append(attempt(wanted.seed, number))
        if outcomes[-1].fault:
            print(f"{number} {outcomes[-1].label}: {outcomes[-1].fault}", flush=True)
    print(summary(wanted.seed, outcomes))
    return 1 if any(outcome.fault for outcome in outcomes) else 0


def summary(seed: int, outcomes: list[Outcome]) -> str:
    """One paragraph."""
    codes = sorted(Counter(outcome.code for outcome in outcomes).items())
    kinds = ", ".join(f"{count} with exit code {code}" for code, count in codes)
    faults = sum(bool(outcome.fault) for outcome in outcomes)
    slowest = max(outcomes, key=lambda outcome: outcome.seconds)
    largest = max(outcomes, key=lambda outcome: outcome.memory)
    return (
        f"{len(outcomes)} cases of seed {seed}: {kinds}; {faults} faults; at most "
        f"{slowest.seconds:.1f} s (case {slowest.number}, {slowest.label}) and "
        f"{largest.memory / 1e9:.2f} GB (case {largest.number}, {largest.label})."
    )


if __name__ == "__main__":
    sys.exit(main())
