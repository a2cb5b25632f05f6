"""The blind matrix in tables, beside what was asked for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from tests.studies.blind_case import COVERED

Record = dict[str, Any]

STRONG_RIGHT, WEAK_RIGHT, EACH_STRONG = 0.95, 0.85, 0.70
PAIRS_RIGHT, FALSE_ALARMS, UNLISTED_RIGHT = 0.90, 0.05, 0.80
NEAR_FLOOR = 1.1
"""Times the floor's rms: within 10 % of it."""


def tables(records: Sequence[Record]) -> str:
    """All that the records show."""
    broken = [r for r in records if "failed" in r or "unreachable" in r]
    good = [r for r in records if r not in broken]
    parts = {name: [r for r in good if r["part"] == name] for name in _TABLES}
    lines = [line for name, rows in parts.items() if rows for line in (*_TABLES[name](rows), "")]
    lines += [f"Not run: {r['key']}: {r.get('failed') or r['unreachable']}" for r in broken]
    return "\n".join([*lines, *_acceptance(parts), *_time(good)])


def right(r: Record) -> bool:
    """First, or in the declared group of the first, and accepted: a person is told of it."""
    return bool(r["in_group"] and r["took"])


def alarmed(r: Record) -> bool:
    """Whether anything but 'nothing is missing' is said."""
    return bool(r["accepted"]) or r["verdict"] != "nothing_missing"


def unlisted(r: Record) -> bool:
    """Whether the rest is said to be something that no effect describes."""
    return "unlisted" in (r["verdict"], r["final_verdict"])


def both(r: Record) -> bool:
    """Whether all hidden effects were accepted, or stand in an accepted one's group."""
    return all(r["named"].values())


def near_floor(r: Record) -> bool:
    """Whether the last error is within 10 % of the floor's rms."""
    return bool(np.sqrt(r["cost"][-1]) <= NEAR_FLOOR)


def covered(r: Record) -> list[bool]:
    """Per estimated size, whether the truth lies in its 95 % interval."""
    return [abs(s["value"] - s["truth"]) <= COVERED * s["std"] for s in _known(r)]


def deviations(r: Record) -> list[float]:
    """Per estimated size, estimate minus truth in standard deviations."""
    return [(s["value"] - s["truth"]) / s["std"] for s in _known(r)]


def _known(r: Record) -> list[dict[str, float]]:
    return [s for s in r["sizes"].values() if np.isfinite(s["std"]) and s["std"] > 0.0]


def share(rows: Sequence[Record], of: Callable[[Record], bool]) -> float:
    """Of the rows; NaN where there are none."""
    return float(np.mean([of(r) for r in rows])) if rows else float("nan")


def _percent(x: float) -> str:
    return "  -  " if np.isnan(x) else f"{100.0 * x:4.0f}%"


def _singles(rows: Sequence[Record]) -> list[str]:
    kinds = sorted({r["what"][0] for r in rows})
    head = "effect                 strong ranked covered floor | weak  ranked covered | instead"
    return ["Hidden effects: right and accepted, ranked right, interval, within 10 % of the floor",
            head, *[_single_line(k, [r for r in rows if r["what"] == [k]]) for k in kinds],
            _single_line("ALL", rows)]  # fmt: skip


def _single_line(name: str, rows: Sequence[Record]) -> str:
    strong = [r for r in rows if r["level"] != "weak"]
    weak = [r for r in rows if r["level"] == "weak"]
    cells = [_percent(share(strong, right)), _percent(share(strong, lambda r: r["in_group"])),
             _percent(_coverage(strong)), _percent(share(strong, near_floor)), "|",
             _percent(share(weak, right)), _percent(share(weak, lambda r: r["in_group"])),
             _percent(_coverage(weak)), "|"]  # fmt: skip
    wrong = Counter(_instead(r) for r in rows if not right(r))
    said = ", ".join(f"{kind} {n}" for kind, n in wrong.most_common(4))
    return f"{name:22s} {'  '.join(cells)} {said if name != 'ALL' else ''}"


def _instead(r: Record) -> str:
    if r["took"]:
        return str(r["rounds"][0][0])
    return "nothing" if r["in_group"] else f"nothing (first {r['top'][0][0] if r['top'] else '-'})"


def _coverage(rows: Sequence[Record]) -> float:
    found = [x for r in rows for x in covered(r)]
    return float(np.mean(found)) if found else float("nan")


def _pairs(rows: Sequence[Record]) -> list[str]:
    lines = ["Pairs: both found, and what was accepted where they were not"]
    for r in rows:
        if not both(r):
            lines.append(f"  {' + '.join(r['what'])} ({r['noise']}): {', '.join(r['accepted'])}")
    return [*lines, f"  both found {_percent(share(rows, both))} of {len(rows)}"]


def _nulls(rows: Sequence[Record]) -> list[str]:
    lines = ["Nothing hidden: false alarms"]
    for noise in sorted({r["noise"] for r in rows}):
        mine = [r for r in rows if r["noise"] == noise]
        said = Counter((r["accepted"] or [r["verdict"]])[0] for r in mine if alarmed(r))
        words = ", ".join(f"{k} {n}" for k, n in said.most_common())
        lines.append(f"  {noise:9s} {_percent(share(mine, alarmed))} of {len(mine)}  {words}")
    return lines


def _outside(rows: Sequence[Record]) -> list[str]:
    lines = ["Outside the catalogue: called unlisted, and what was accepted"]
    for kind in sorted({r["what"][0] for r in rows}):
        mine = [r for r in rows if r["what"] == [kind]]
        said = Counter(a for r in mine for a in r["accepted"])
        words = ", ".join(f"{k} {n}" for k, n in said.most_common(5))
        lines.append(f"  {kind:20s} {_percent(share(mine, unlisted))} of {len(mine)}  {words}")
    return lines


_TABLES = {"singles": _singles, "pairs": _pairs, "nulls": _nulls, "outside": _outside}


def _acceptance(parts: dict[str, list[Record]]) -> list[str]:
    """Each line that was asked for, its figure and whether it holds."""
    strong = [r for r in parts["singles"] if r["level"] != "weak"]
    weak = [r for r in parts["singles"] if r["level"] == "weak"]
    kinds = sorted({r["what"][0] for r in strong})
    each = {k: share([r for r in strong if r["what"] == [k]], right) for k in kinds}
    worst = min(each, key=lambda k: each[k]) if each else "-"
    nulls = {n: share([r for r in parts["nulls"] if r["noise"] == n], alarmed)
             for n in sorted({r["noise"] for r in parts["nulls"]})}  # fmt: skip
    rows = [
        ("strong: right effect first", share(strong, right), STRONG_RIGHT, 1),
        ("weak: right effect first", share(weak, right), WEAK_RIGHT, 1),
        (f"worst strong effect ({worst})", each.get(worst, np.nan), EACH_STRONG, 1),
        ("strong: error within 10 % of the floor", share(strong, near_floor), 1.0, 1),
        ("pairs: both found", share(parts["pairs"], both), PAIRS_RIGHT, 1),
        *[(f"false alarms, {n}", x, FALSE_ALARMS, -1) for n, x in nulls.items()],
        ("outside: called unlisted", share(parts["outside"], unlisted), UNLISTED_RIGHT, 1),
    ]  # fmt: skip
    return ["Required", *[_line(*row) for row in rows if not np.isnan(row[1])], ""]


def _line(what: str, found: float, asked: float, sign: int) -> str:
    holds = sign * (found - asked) >= 0.0
    sense = "at least" if sign > 0 else "at most"
    return (
        f"  {'holds ' if holds else 'MISSED'} {what:45s} {100 * found:5.1f} %  "
        f"({sense} {100 * asked:.0f} %)"
    )


def _time(rows: Sequence[Record]) -> list[str]:
    if not rows:
        return ["Nothing was run."]
    seconds = [r["seconds"]["data"] + r["seconds"]["diagnose"] for r in rows]
    return [f"{len(rows)} cases, {np.mean(seconds):.1f} s of one core each (at most "
            f"{max(seconds):.0f} s)"]  # fmt: skip
