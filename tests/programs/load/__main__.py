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
from websockets.exceptions import ConnectionClosed

from tests.programs.load.crowd import EPSILON, THETA2, LateError, Member
from tests.server.served import Served, served, stands, until

JOBS = 2
"""Identifications that run meanwhile."""
PER_SECOND = 5.0
"""Moves of each browser."""
ASKED = {30: 300.0, 60: 800.0}
"""ms that 95 of 100 moves may take, by browsers."""
LOOK = 5.0
"""s between two looks at the memory and at the workers."""
BUSY = 0.02
"""Share of a processor above which a worker searches: it gets more of one even where sixty pages
come first, and a sign of life every two seconds takes less."""
AT_WORK = 0.75
"""Share of the looks in which all identifications are to be found at work: a search may end after
thirty seconds of a fast processor, and the next begins after one look."""
TOGETHER = 6
"""Browsers that come at the same time."""
PATIENCE = 240.0
"""s for all pages to be built and all jobs to run before the measurement begins."""
LAST_ANSWERS = 5.0
"""s after the last move, at most."""
AGAIN = 0.2
"""s between two looks at whether all of them are there: the pace of the moves."""
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
    busy: np.ndarray
    """(n,) workers that have searched since the look before"""
    jobs: int = JOBS
    """That are to be busy."""


class Watch:
    """Looks at a server while a crowd is at it."""

    def __init__(self, server: Served, jobs: int) -> None:
        self._server, self._jobs = server, jobs
        self._begin = self._last = time.monotonic()
        self._worked = server.worked
        self._seen = [(0.0, server.memory[0], float(jobs))]

    def look(self) -> int:
        """How many workers have searched since the last look."""
        now, worked = time.monotonic(), self._server.worked
        enough = BUSY * (now - self._last)
        busy = sum(s - self._worked.get(pid, 0.0) > enough for pid, s in worked.items())
        self._last, self._worked = now, worked
        self._seen.append((now - self._begin, self._server.memory[0], float(busy)))
        return busy

    @property
    def looks(self) -> Looks:
        return Looks(*np.array(self._seen).T, self._jobs)


async def crowd_at_work(
    server: Served, people: int, seconds: float, jobs: int = JOBS
) -> tuple[list[Member], Looks]:
    """The browsers after their work, and what was seen while they were at it; LateError."""
    members = [Member(k, people, server.port) for k in range(people)]
    for k in range(0, people, TOGETHER):
        await asyncio.gather(*(member.arrive(PATIENCE) for member in members[k : k + TOGETHER]))
    searching = members[:jobs]
    for member in searching:
        await member.identify()
    if not all(await asyncio.gather(*(member.working(PATIENCE) for member in searching))):
        raise LateError(f"an identification did not begin in {PATIENCE:g} s")
    begin, watch = time.monotonic(), Watch(server, jobs)
    moving = [
        asyncio.create_task(
            member.move(seconds, 1.0 / PER_SECOND, member.number / people / PER_SECOND)
        )
        for member in members
    ]
    while time.monotonic() - begin < seconds:
        await asyncio.sleep(min(LOOK, seconds))
        if watch.look() < jobs:
            await asyncio.gather(*(member.identify_again() for member in searching))
    await asyncio.gather(*moving)
    await last_answers(members)
    for member in searching:
        await member.stop(LAST_ANSWERS)
    for member in members:
        await member.leave()
    return members, watch.looks


async def last_answers(members: list[Member]) -> None:
    """Until every last move is shown, but no longer than that may take."""
    end = time.monotonic() + LAST_ANSWERS
    while time.monotonic() < end and any(m.last_shown != m.last_moved for m in members):
        await asyncio.sleep(AGAIN)
    await asyncio.sleep(AGAIN)  # what others moved would come with it


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
        at_work(f"{people}: identifications at work", looks, sum(m.searches for m in members)),
        complaints(f"{people}", server),
    ]
    replaced = sum(m.superseded for m in members)
    print(
        f"{people} browsers: {replaced} moves were replaced by newer ones before they began",
        flush=True,
    )
    return found


def memory_over_time(what: str, looks: Looks) -> Line:
    """Of the second and the last quarter: what is made once is made in the first."""
    quarter = looks.seconds[-1] / 4.0
    early = (quarter <= looks.seconds) & (looks.seconds <= 2.0 * quarter)
    second = np.median(looks.server[early])
    last = np.median(looks.server[looks.seconds >= 3.0 * quarter])
    flat = bool(abs(last / second - 1.0) <= FLAT)
    return Line(what, f"{second:.0f} -> {last:.0f} MB", "flat (5 %)", flat)


def at_work(what: str, looks: Looks, searches: int) -> Line:
    """By the processor time of the workers, which no page has to tell."""
    all_busy = looks.busy[1:] >= looks.jobs
    said = f"{all_busy.sum()} of {len(all_busy)} looks, {searches} searches"
    return Line(what, said, f">= {AT_WORK:.0%}", bool(np.mean(all_busy) >= AT_WORK))


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
            stands(browser)


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


def on_a_server(
    what: str, work: Callable[[Served, Path], list[Line]], jobs: int = JOBS
) -> list[Line]:
    """Each line is printed as soon as it is there; a wait that runs out is one of them."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        with served(folder, "--workers", str(jobs), nice=True) as server:
            try:
                until(lambda: len(server.workers) > 0, PATIENCE, "a worker")
                lines = work(server, folder)
            # AssertionError: how the helpers of the tests say that something did not come.
            except (LateError, AssertionError, OSError, ConnectionClosed) as error:
                late = Line(f"{what}: ended early", str(error), "to its end", False)
                lines = [late, complaints(what, server)]
    print(*lines, sep="\n", flush=True)
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--people", type=int, nargs="*", default=list(ASKED))
    parser.add_argument("--rounds", type=int, default=3, help=f"of {VISITS} visits")
    wanted = parser.parse_args()
    lines: list[Line] = []
    print(
        f"{JOBS} identifications, {wanted.seconds:g} s, {PER_SECOND:g} moves per second each",
        flush=True,
    )
    for people in wanted.people:

        def crowd(server: Served, _: Path, people: int = people) -> list[Line]:
            members, looks = asyncio.run(crowd_at_work(server, people, wanted.seconds))
            return of_crowd(members, looks, server)

        lines += on_a_server(f"{people}", crowd)
        print(f"load of the machine after {people} browsers: {os.getloadavg()[0]:.1f}", flush=True)
    if wanted.rounds:
        lines += on_a_server(
            "pages",
            lambda server, folder: of_visits(
                rounds_of_visits(server, folder, wanted.rounds, VISITS), VISITS
            ),
        )
    missed = sum(not line.good for line in lines)
    print(f"{missed} of {len(lines)} lines missed" if missed else f"all {len(lines)} lines held")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
