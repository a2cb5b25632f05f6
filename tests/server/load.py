"""`make load`: 30 and 60 browsers for two minutes, and 300 that come and go, on one server each.

Prints what was measured beside what is asked, and ends with 1 where a line is missed. The times are
the machine's as much as the program's: nothing else should run on it.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.server.crowd import EPSILON, THETA2, Member
from tests.server.served import Served, served, until, widget

JOBS = 2
"""Identifications that run meanwhile."""
PER_SECOND = 5.0
"""Moves of each browser."""
ASKED = {30: 300.0, 60: 800.0}
"""ms that 95 of 100 moves may take, by browsers."""
LOOK = 5.0
"""s between two looks at the memory."""
TOGETHER = 6
"""Browsers that come at the same time."""
PATIENCE = 240.0
"""s for all pages to be built and all jobs to run before the measurement begins."""
LAST_ANSWERS = 5.0
"""s after the last move."""
FLAT = 0.05
"""Share of the memory by which it may differ between the second and the last quarter."""
VISITS = 100
"""Pages of one round: built, and left."""
GIVEN_UP = 30.0
"""s after the last visit: a session in which nothing was done is kept for ten, an idle thread for
three."""
RETURNED = 0.02
"""Share of the memory that one more round of visits may add."""


@dataclass(frozen=True)
class Line:
    """One measured number and what is asked of it."""

    what: str
    found: str
    asked: str
    good: bool

    def __str__(self) -> str:
        return f"{'yes' if self.good else 'NO ':3}  {self.what:<34} {self.found:<26} {self.asked}"


@dataclass(frozen=True)
class Looks:
    """Memory over time."""

    seconds: np.ndarray
    """(n,)"""
    server: np.ndarray
    """(n,) MB"""


async def crowd_at_work(
    server: Served, people: int, seconds: float, jobs: int = JOBS
) -> tuple[list[Member], Looks]:
    """The browsers after their work, and the memory while they were at it."""
    members = [Member(k, people, server.port) for k in range(people)]
    for k in range(0, people, TOGETHER):
        await asyncio.gather(*(member.arrive(PATIENCE) for member in members[k : k + TOGETHER]))
    for member in members[:jobs]:
        await member.identify()
    await asyncio.gather(*(member.working(PATIENCE) for member in members[:jobs]))
    begin, memory = time.monotonic(), [(0.0, server.memory[0])]
    moving = [
        asyncio.create_task(
            member.move(seconds, 1.0 / PER_SECOND, member.number / people / PER_SECOND)
        )
        for member in members
    ]
    while time.monotonic() - begin < seconds:
        await asyncio.sleep(min(LOOK, seconds))
        memory.append((time.monotonic() - begin, server.memory[0]))
    await asyncio.gather(*moving)
    await asyncio.sleep(LAST_ANSWERS)
    for member in members[:jobs]:
        await member.working(PATIENCE)  # still
    for member in members:
        await member.leave()
    times, own = np.array(memory).T
    return members, Looks(times, own)


def of_crowd(members: list[Member], looks: Looks, server: Served) -> list[Line]:
    """What a crowd's work showed."""
    people = len(members)
    asked = ASKED.get(people, float("inf"))
    found = []
    for kind in (THETA2, EPSILON):
        answers = 1e3 * np.array([s for m in members for s in m.answers[kind]] or [np.inf])
        p50, p95, most = np.percentile(answers, [50, 95, 100])
        said = f"p50 {p50:.0f}, p95 {p95:.0f}, most {most:.0f} ms"
        found.append(Line(f"{people}: moves of {kind}", said, f"p95 <= {asked:g} ms", p95 <= asked))
    right = sum(m.last_shown == m.last_moved for m in members)
    foreign = sum(len(m.foreign) for m in members)
    found += [
        Line(f"{people}: last moves shown", f"{right} of {people}", "all", right == people),
        Line(f"{people}: others' moves shown", f"{foreign}", "none", foreign == 0),
        memory_over_time(f"{people}: server's memory", looks),
        complaints(f"{people}", server),
    ]
    replaced = sum(m.superseded for m in members)
    print(f"{people} browsers: {replaced} moves were replaced by newer ones before they began")
    return found


def memory_over_time(what: str, looks: Looks) -> Line:
    """Of the second and the last quarter: what is made once is made in the first."""
    quarter = looks.seconds[-1] / 4.0
    early = (quarter <= looks.seconds) & (looks.seconds <= 2.0 * quarter)
    second = np.median(looks.server[early])
    last = np.median(looks.server[looks.seconds >= 3.0 * quarter])
    flat = bool(abs(last / second - 1.0) <= FLAT)
    return Line(what, f"{second:.0f} -> {last:.0f} MB", "flat (5 %)", flat)


def complaints(what: str, server: Served) -> Line:
    """Nothing was logged, and the server lives."""
    said = server.log.strip().splitlines()
    for line in said[-20:]:
        print(f"     {line}")
    good = server.alive and not any("Traceback" in line or "ERROR" in line for line in said)
    return Line(f"{what}: errors logged", f"{len(said)} lines", "none", good)


@dataclass(frozen=True)
class Left:
    """What a server holds while nobody is there."""

    threads: int
    descriptors: int
    folders: int
    megabytes: float


def left(server: Served, folder: Path) -> Left:
    """Once all has had the time to go; `folder` is where the server keeps files."""
    process = Path(f"/proc/{server.process.pid}")
    kept = [path for path in folder.rglob("*") if path.is_dir() and is_of_a_session(path)]
    return Left(
        sum(1 for _ in (process / "task").iterdir()),
        sum(1 for _ in (process / "fd").iterdir()),
        len(kept),
        server.memory[0],
    )


def is_of_a_session(path: Path) -> bool:
    return path.parent.name == "sessions"


def visits(server: Served, count: int) -> None:
    """One whole page after the other: built, and left at once."""
    for _ in range(count):
        with server.browser() as browser:
            widget(browser, "3-D playback (HTML)", "GuiButton")


def rounds_of_visits(server: Served, folder: Path, rounds: int, count: int) -> list[Left]:
    """What is left after each round."""
    found = []
    for k in range(rounds):
        visits(server, count)
        time.sleep(GIVEN_UP)
        found.append(left(server, folder))
        print(f"after {(k + 1) * count} pages: {found[-1]}", flush=True)
    return found


def of_visits(found: list[Left], count: int) -> list[Line]:
    """From the first round on nothing grows: what serves everybody was made in it."""
    first, last = found[0], found[-1]
    names = (("threads", "threads"), ("descriptors", "descriptors"), ("session folders", "folders"))
    lines = []
    for title, name in names:
        series = [getattr(each, name) for each in found]
        good = series[-1] <= series[0] and (name != "folders" or not any(series))
        lines.append(Line(f"{title} after pages", " ".join(map(str, series)), "no more", good))
    growth = (last.megabytes - first.megabytes) / max(len(found) - 1, 1)
    series = [f"{each.megabytes:.0f}" for each in found]
    good = growth <= RETURNED * first.megabytes
    asked = f"<= 2 % per {count} pages"
    return [*lines, Line("MB after pages", " ".join(series), asked, good)]


def on_a_server(work: Callable[[Served, Path], list[Line]], jobs: int = JOBS) -> list[Line]:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        with served(folder, "--workers", str(jobs), nice=True) as server:
            until(lambda: len(server.workers) > 0, PATIENCE, "a worker")
            return work(server, folder)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--people", type=int, nargs="*", default=list(ASKED))
    parser.add_argument("--rounds", type=int, default=3, help=f"of {VISITS} visits")
    wanted = parser.parse_args()
    lines: list[Line] = []
    for people in wanted.people:

        def crowd(server: Served, _: Path, people: int = people) -> list[Line]:
            members, looks = asyncio.run(crowd_at_work(server, people, wanted.seconds))
            return of_crowd(members, looks, server)

        lines += on_a_server(crowd)
        print(f"load of the machine after {people} browsers: {os.getloadavg()[0]:.1f}", flush=True)
    if wanted.rounds:
        lines += on_a_server(
            lambda server, folder: of_visits(
                rounds_of_visits(server, folder, wanted.rounds, VISITS), VISITS
            )
        )
    print(f"\n{JOBS} identifications, {wanted.seconds:g} s, {PER_SECOND:g} moves per second each")
    print("\n".join(map(str, lines)))
    return 0 if all(line.good for line in lines) else 1


if __name__ == "__main__":
    sys.exit(main())
