"""Name what is hidden in recordings of an independent engine: a benchmark that others can enter.

`python -m tests.programs.benchmark write FOLDER` makes recordings and scenarios without the truth,
`score RESULTS` judges a table of answers beside FlexGUI's. `ours` makes FlexGUI's of what `make
evidence PARTS=engine` has found, and puts its score on docs/benchmark.md.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flexgui.core.effects import catalogue
from flexgui.core.errors import InputError
from flexgui.core.resumable.journal import Journal
from tests.programs.evidence.engine_words import misses, set_right
from tests.programs.evidence.frame import JOURNAL
from tests.programs.evidence.frame import table as markdown
from tests.programs.mujoco.wide_cases import CASES
from tests.programs.mujoco.wide_files import written

SEED = 70
"""Of the order of the cases, so that their numbers say nothing."""
COLUMNS = ("case", "effect", "parameter", "value")
NOTHING = "nothing"
DOCS = Path(__file__).resolve().parents[2] / "docs"
OURS, PAGE, MARK = DOCS / "evidence" / "benchmark_ours.csv", DOCS / "benchmark.md", "## Results\n"

Answers = Mapping[str, Mapping[str, Mapping[str, float]]]
"""Case -> effect -> parameter -> value in SI units."""


def numbered() -> dict[str, str]:
    """case001, ... -> its name, which is the truth."""
    order = np.random.default_rng(SEED).permutation(len(CASES))
    names = list(CASES)
    return {f"case{n:03d}": names[k] for n, k in enumerate(order, start=1)}


def write(folder: Path, chosen: Sequence[str]) -> None:
    """A folder per case, and the head of a table of answers."""
    names = numbered()
    if wrong := [case for case in chosen if case not in names]:
        raise InputError(f"{wrong[0]!r} is no case; they are case001 to case{len(names):03d}.")
    for case in chosen or names:
        (folder / case).mkdir(parents=True, exist_ok=True)
        written(CASES[names[case]], folder / case)
        print(f"Written: {folder / case}", flush=True)
    if not (folder / "results.csv").exists():
        (folder / "results.csv").write_text(",".join(COLUMNS) + "\n", encoding="utf-8")


def answers(path: Path) -> Answers:
    """The table of a participant.

    Raises:
        InputError: Where it cannot be read as one; the sentence names the line.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read as text: {error}.") from None
    rows = csv.reader(lines, skipinitialspace=True)
    if (head := tuple(next(rows, ()))) != COLUMNS:
        raise InputError(f"{path}: the first line must be {','.join(COLUMNS)}, not {head!r}.")
    found: dict[str, dict[str, dict[str, float]]] = {}
    for row in filter(None, rows):
        try:
            _add(found, row)
        except ValueError as error:
            raise InputError(f"{path}, line {rows.line_num}: {error}.") from None
    return found


def _add(found: dict[str, dict[str, dict[str, float]]], row: Sequence[str]) -> None:
    if len(row) != len(COLUMNS):
        raise ValueError(f"{len(row)} cells, where {len(COLUMNS)} are needed")
    case, effect, parameter, value = (cell.strip() for cell in row)
    if case not in numbered():
        raise ValueError(f"{case!r} is no case, such as case001")
    if effect not in (NOTHING, *catalogue()):
        raise ValueError(f"{effect!r} is no effect of docs/effects.md and not {NOTHING!r}")
    effects = found.setdefault(case, {})
    if effect == NOTHING and effects or NOTHING in effects:
        raise ValueError(f"{case} has {NOTHING!r} beside another line")
    sizes = effects.setdefault(effect, {})
    if bool(parameter) != bool(value) or (parameter and effect == NOTHING):
        raise ValueError("a parameter needs a value, a value a parameter, 'nothing' neither")
    if parameter in sizes:
        raise ValueError(f"{parameter} of {case} comes twice")
    if parameter:
        number = float(value)
        if not np.isfinite(number):
            raise ValueError(f"{value!r} is no finite number")
        sizes[parameter] = number


def judged(given: Answers) -> dict[str, dict[str, Any] | None]:
    """Case -> truth, what is named and values, as the engine's part of the evidence judges them;
    None where there is no answer."""
    found: dict[str, dict[str, Any] | None] = {}
    for case, name in numbered().items():
        truth = CASES[name].made()[2]
        effects = given.get(case)
        found[name] = None if effects is None else {
            "truth": truth, "named": sorted(set(effects) - {NOTHING}),
            "values": {k: v for sizes in effects.values() for k, v in sizes.items()},
        }  # fmt: skip
    return found


def scores(given: Answers) -> list[str]:
    """A column of the table: the rows of `ROWS`."""
    every = judged(given)
    done = {name: one for name, one in every.items() if one is not None}
    hidden = [name for name in every if CASES[name].hidden]
    right = [done[name] for name in hidden if name in done and set_right(done[name])]
    bare = [name for name in every if not CASES[name].hidden]
    wrong = sum(bool(set(one["named"]) - set(one["truth"])) for one in done.values())
    errors = [abs(one["values"].get(name, 0.0) / true - 1.0) for one in right
              for sizes in one["truth"].values() for name, true in sizes.items()]  # fmt: skip
    return [
        f"{len(done)} of {len(every)}",
        f"{len(right)} of {len(hidden)}",
        f"{sum(not list(misses(one)) for one in right)} of {len(right)}",
        f"{np.median(errors):.2%}, {max(errors):.0%}" if errors else "–",
        f"{sum(name in done and set_right(done[name]) for name in bare)} of {len(bare)}",
        f"{wrong} of {len(done)}",
        *(_of_arm(done, arm, hidden) for arm in ARMS),
    ]


ARMS = tuple(dict.fromkeys(case.arm for case in CASES.values()))
ROWS = (
    "cases with an answer", "just what is hidden is named", "of these, every size as near as asked",
    "of these, error of a size: median, worst", "nothing hidden, nothing named",
    "something named that is not hidden", *(f"just what is hidden: arm {arm}" for arm in ARMS),
)  # fmt: skip


def _of_arm(done: Mapping[str, Any], arm: str, hidden: Iterable[str]) -> str:
    names = [name for name in hidden if CASES[name].arm == arm]
    return f"{sum(name in done and set_right(done[name]) for name in names)} of {len(names)}"


def ours(journal: Path) -> list[Sequence[str]]:
    """FlexGUI's answers as rows of COLUMNS, from what `make evidence PARTS=engine` has found."""
    known = Journal(journal).records
    found = {
        key.split("/", 1)[1].rpartition("/")[0]: record["found"]
        for key, record in known.items()
        if key.startswith("engine/") and "found" in record
    }
    if not found:
        raise InputError(f"{journal} holds no case of the engine; run make evidence PARTS=engine.")
    rows: list[Sequence[str]] = []
    for case, name in numbered().items():
        if name not in found:
            continue
        one = found[name]
        rows += [(case, NOTHING, "", "")] if not one["named"] else []
        for effect in one["named"]:
            sizes = [p for p, of in one["of"].items() if of == effect]
            rows += [(case, effect, p, f"{one['values'][p]:.6g}") for p in sizes]
            rows += [] if sizes else [(case, effect, "", "")]
    return rows


def _scored(results: Mapping[str, Path]) -> str:
    """Markdown; the columns are who answered."""
    columns = {"": ROWS, **{name: scores(answers(path)) for name, path in results.items()}}
    return markdown(list(columns), [list(row) for row in zip(*columns.values(), strict=True)])


def write_ours(journal: Path) -> None:
    """FlexGUI's table of answers, and its score on the page."""
    rows = ours(journal)
    with OURS.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])
    before = PAGE.read_text(encoding="utf-8").partition(MARK)[0]
    PAGE.write_text(f"{before}{MARK}\n{_scored({'FlexGUI': OURS})}\n", encoding="utf-8")
    print(f"Written: {OURS}, {PAGE}")


def main(arguments: Sequence[str] | None = None) -> int:
    """2 for what cannot be read."""
    ask = argparse.ArgumentParser(prog="python -m tests.programs.benchmark", description=__doc__)
    todo = ask.add_subparsers(dest="todo", required=True)
    one = todo.add_parser("write", help="recordings and scenarios")
    one.add_argument("folder", type=Path)
    one.add_argument("cases", nargs="*", help="such as case001; all by default")
    todo.add_parser("score", help="a table of answers").add_argument("results", type=Path)
    todo.add_parser("ours", help=f"writes {OURS.name}").add_argument(
        "--journal", type=Path, default=JOURNAL
    )
    given = ask.parse_args(arguments)
    try:
        if given.todo == "write":
            write(given.folder, given.cases)
        elif given.todo == "score":
            known = {"FlexGUI": OURS} if OURS.is_file() else {}
            print(_scored({given.results.name: given.results, **known}))
        else:
            write_ours(given.journal)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
