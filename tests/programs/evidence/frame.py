"""Evidence in parts: each a file of `parts`, found by walking the folder, run case by case.

A part is a module with

- TITLE, ORDER (its place on the page) and FILES (recordings that it needs, not shipped),
- CASES: name -> function of the data folder that returns plain values (JSON),
- NEEDS, where there are any: modules of packages that the extra `peers` installs,
- SOURCES, where there are any: patterns below `tests` of what its cases are made with,
- FIGURES, where there are any: file name without ending -> title and function of (case -> values),
  None where they do not hold what it shows,
- section(found): Markdown from case -> those values; cases that were not run are missing,
- summary(found), where somebody else's figure stands beside ours: its rows of the page's first
  table, which are (what was asked, FlexGUI's, the best peer's, who is better).

One line of JSON per case; the same command goes on where it stopped. A part whose source has
changed is run again.
"""

from __future__ import annotations

import datetime
import hashlib
import importlib
import json
import os
import platform
import re
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

from flexgui.core.plugins import modules_of
from flexgui.core.resumable.journal import Journal
from tests.programs.studies.study_run import kept, run_all

PACKAGE = f"{__package__}.parts"
HERE = Path(__file__).resolve().parent
JOURNAL = Path("reports/evidence.jsonl")
PAGE = HERE.parents[2] / "docs" / "evidence.md"
PICTURES = "evidence"
"""The folder of the figures, beside the page."""

PACKAGES = ("flexgui-arm", "numpy", "scipy", "numba", "mujoco", "casadi", "pysindy", "lmfit",
            "nfoursid")  # fmt: skip

MOST_NAMED = 10
"""Cases that were not run and are named one by one."""
MOST_ROWS = 12
"""Of a table or a list that is shown unfolded."""

HEAD = """# Evidence

What FlexGUI finds on recordings of others, and how well, beside the tools of others. Each figure
has the command that makes it. `make evidence` makes them all and continues where it stopped. A part
that was not run here states this, or keeps what was found before, with its date.
"""
ASKED = ("asked", "FlexGUI", "best peer", "better", "part")


Summary = Sequence[tuple[str, str, str, str]]
"""What was asked, FlexGUI's figure, the best peer's, who is better."""

EVEN = 0.02
"""Relative difference of two figures below which neither is better."""


@dataclass(frozen=True)
class Case:
    """One piece of work of a part."""

    part: str
    what: str
    source: str
    """Digest of the part's code."""
    folder: str
    """Of the recordings that are not shipped."""

    @property
    def key(self) -> str:
        return f"{self.part}/{self.what}/{self.source}"


def parts() -> dict[str, ModuleType]:
    """Name -> module, in the order of the page."""
    found = {module.__name__.rpartition(".")[2]: module for module in modules_of(PACKAGE)}
    return dict(sorted(found.items(), key=lambda item: item[1].ORDER))


def digest(name: str) -> str:
    """Of a part's file, of what stands beside the frame and of what its cases are made with."""
    files = [HERE / "parts" / f"{name}.py", *sorted(HERE.glob("*_rules.py"))]
    for pattern in getattr(parts()[name], "SOURCES", ()):
        files += sorted(HERE.parent.glob(pattern))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:12]


def missing(part: ModuleType, folder: Path | None) -> list[str]:
    """Recordings that the part needs and that are not there."""
    return [f for f in part.FILES if folder is None or not (folder / f).is_file()]


def lacking(part: ModuleType) -> list[str]:
    """Modules that the part needs and that are not installed."""
    return [name for name in getattr(part, "NEEDS", ()) if find_spec(name) is None]


def cases(names: Sequence[str], folder: Path | None) -> list[Case]:
    """All cases of those parts that have what they need."""
    known = parts()
    able = [n for n in names if not missing(known[n], folder) and not lacking(known[n])]
    place = "" if folder is None else str(folder)
    return [Case(name, what, digest(name), place) for name in able for what in known[name].CASES]


def answer_text(order: str) -> str:
    """The record of the case that a worker is sent."""
    case = Case(**json.loads(order))
    return json.dumps(kept(case, run_case))


def run_case(case: Case) -> dict[str, Any]:
    """What the case found, with when and with what."""
    clock = time.process_time()
    module = importlib.import_module(f"{PACKAGE}.{case.part}")
    work: Callable[[Path], Mapping[str, Any]] = module.CASES[case.what]
    found = work(Path(case.folder))
    return {
        "key": case.key,
        "found": found,
        "seconds": round(time.process_time() - clock, 1),
        "date": datetime.date.today().isoformat(),
        "with": versions(),
        "on": f"{os.cpu_count()} processors, {platform.machine()}",
    }


def versions() -> str:
    """What computed it; the code of `core` by its digest."""
    packages = [f"{name} {_version(name)}" for name in PACKAGES if _version(name)]
    return ", ".join([f"Python {platform.python_version()}", *packages, f"core {core_digest()}"])


@cache
def core_digest() -> str:
    """Of all its code."""
    files = sorted((HERE.parents[2] / "core").rglob("*.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:8]


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def run(
    names: Sequence[str],
    folder: Path | None,
    journal: Path = JOURNAL,
    processes: int = 2,
    told: Callable[[str], None] = print,
) -> None:
    """Runs what the journal does not hold yet."""
    run_all(cases(names, folder), answer_text, journal, told, processes)


def page(folder: Path | None, journal: Path = JOURNAL, before: str = "") -> str:
    """docs/evidence.md of all that the journal holds. A part of which it holds nothing stays as it
    is in the page `before`, with its rows in the table of all."""
    records = Journal(journal).records
    kept = {text.splitlines()[0]: f"## {text}" for text in f"\n{before}".split("\n## ")[1:]}
    done = {name: _records(name, part, records) for name, part in parts().items()}
    stays = {n for n, part in parts().items() if part.TITLE in kept and part.CASES and not done[n]}
    made = [r for each in done.values() for r in each.values() if "found" in r]
    # What all were made with is stated in the page before where parts of that stay.
    shared = made[0]["with"] if not stays and len({r["with"] for r in made}) == 1 else ""
    sections = [
        kept[part.TITLE] if name in stays else _section(name, part, folder, done[name], shared)
        for name, part in parts().items()
    ]
    old = [line for line in before.splitlines() if line.startswith("`make evidence`:")]
    head = [HEAD, *(old if stays else _made(made, shared)), *_summary(done, stays, before)]
    return "\n\n".join(text.strip() for text in (*head, *sections)) + "\n"


def _made(made: Sequence[Mapping[str, Any]], shared: str) -> list[str]:
    """How long all took, where, and with what if that was the same for all."""
    if not made:
        return []
    hours = sum(r["seconds"] for r in made) / 3600.0
    where = " and on ".join(sorted({r.get("on", "a machine that is not known") for r in made}))
    used = f", with {shared}" if shared else ""
    return [
        f"`make evidence`: {hours:.2g} hours of processor time on {where}{used}. Parts with other "
        "versions state theirs. Seconds by the clock were measured while other cases ran beside, "
        "but for speed and growth."
    ]


def _summary(
    done: Mapping[str, Mapping[str, Any]], stays: Collection[str], before: str
) -> list[str]:
    """The table of all; of parts that stay their rows in the page `before`."""
    rows: list[list[str]] = []
    for name, part in parts().items():
        link = f"[{name}](#{heading(part.TITLE)})"
        if name in stays:
            lines = (line for line in before.splitlines() if line.endswith(f"| {link} |"))
            rows += [line.strip("| ").split(" | ") for line in lines]
        elif hasattr(part, "summary"):
            rows += [[*row, link] for row in part.summary(_good(done[name]))]
    return [table(ASKED, rows)] if rows else []


def better(ours: float, peer: float) -> str:
    """Who has the smaller figure."""
    if abs(ours - peer) <= EVEN * abs(peer):
        return "neither"
    return "FlexGUI" if ours < peer else "**peer**"


def heading(title: str) -> str:
    """The anchor of a heading on GitHub and on the site."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def folded(text: str) -> str:
    """Markdown whose long tables and lists are shut until somebody opens them."""
    blocks = text.split("\n\n")
    return "\n\n".join(_folded(block) for block in blocks)


def _folded(block: str) -> str:
    lines = block.splitlines()
    count = len(lines) - 2 if block.startswith("| ") else len(lines)
    if not block.startswith(("| ", "- ")) or count <= MOST_ROWS:
        return block
    title = f"<summary>{count} {'rows' if block.startswith('|') else 'lines'}</summary>"
    return f'<details markdown="1">\n{title}\n\n{block}\n\n</details>'


def pictures(journal: Path = JOURNAL) -> dict[str, str]:
    """File name -> SVG, of the figures that the journal's records can make."""
    from tests.programs.evidence.figures import svg

    records, found = Journal(journal).records, {}
    for name, part in parts().items():
        good = _good(_records(name, part, records))
        for file, (_, draw) in getattr(part, "FIGURES", {}).items():
            drawn = draw(good)
            if drawn is not None:
                found[f"{file}.svg"] = svg(drawn)
    return found


def _records(
    name: str, part: ModuleType, records: Mapping[str, dict[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Case -> record, of the part as it now stands."""
    source = digest(name)
    keys = {what: f"{name}/{what}/{source}" for what in part.CASES}
    return {what: records[key] for what, key in keys.items() if key in records}


def _good(done: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
    return {what: r["found"] for what, r in done.items() if "found" in r}


def _section(
    name: str, part: ModuleType, folder: Path | None, done: Mapping[str, dict[str, Any]],
    shared: str,
) -> str:  # fmt: skip
    good = _good(done)
    took = sum(r["seconds"] for r in done.values() if "found" in r)
    spent = f", {took:.0f} s of processor time" if good else ""
    lines = [f"## {part.TITLE}", f"`make evidence PARTS={name}`{spent}"]
    lines += _not_run(part, folder, done)
    lines += [f"Failed: {w}: {r['failed']}." for w, r in done.items() if "failed" in r]
    lines += [folded(part.section(good))] if good or not part.CASES else []
    lines += [
        f"![{title}]({PICTURES}/{file}.svg)"
        for file, (title, draw) in getattr(part, "FIGURES", {}).items()
        if draw(good) is not None
    ]
    return "\n\n".join(lines + _dated([r for r in done.values() if "found" in r], shared))


def _not_run(part: ModuleType, folder: Path | None, done: Mapping[str, Any]) -> list[str]:
    """Why, and what to do; of many cases their number."""
    absent, packages = missing(part, folder), lacking(part)
    left = [what for what in part.CASES if what not in done]
    if absent and not done:
        return [f"Not run: it needs {', '.join(absent)}, which are not part of FlexGUI; set "
                "FLEXGUI_DATA to the folder that holds them."]  # fmt: skip
    if packages and not done:
        return [f"Not run: it needs {', '.join(packages)}; pip install '.[peers]'."]
    if len(left) > MOST_NAMED:
        return [f"Not run yet: {len(left)} of {len(part.CASES)} cases; the same command goes on."]
    return [f"Not run: {', '.join(left)}."] if left else []


def _dated(records: Sequence[Mapping[str, Any]], shared: str) -> list[str]:
    """When, and with what where the page does not state it for all; a line per set of versions."""
    found = []
    for used in sorted({r["with"] for r in records}):
        days = sorted({r["date"] for r in records if r["with"] == used})
        span = days[0] if len(days) == 1 else f"{days[0]} to {days[-1]}"
        found.append(f"*{span}.*" if used == shared else f"*{span}; {used}.*")
    return found


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """In Markdown; the first column is text, the others numbers."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
