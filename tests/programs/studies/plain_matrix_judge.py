"""How right an answer is: pure functions of plain values, and the tables of all cases."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import kstest

from flexgui.core.effects import effect

Record = Mapping[str, Any]

WITHIN = 1.15
"""Times the floor: the final error that is asked for."""

COVERED = 1.96
"""Standard deviations of an interval of 95 %."""

WORSE = 1.1
"""Times the error on unseen recordings beyond which it became worse: what starts that are fitted
anew and noise move it (core.diagnose.effect_search)."""

INSTEAD = ("joint_elasticity", "torque_ripple", "rotor_inertia", "base_compliance", "backlash")
"""What must not be named in the place of a sensor's or drive's slip."""


def judged(hidden: Sequence[str], answer: Record, truth: Mapping[str, float]) -> dict[str, Any]:
    """What was right.

    Args:
        hidden: ids of the hidden effects; none for nothing.
        answer: what `answered` keeps of a diagnosis.
        truth: name of a parameter -> its true value.

    Returns:
        first: the first effect added is hidden, or part of a hidden one; None for nothing hidden.
        exact: the set at the end is the hidden one (what an effect includes is not named by it).
        declared: the same, where an effect with which the answer declared its own confused counts.
        false_alarms: named and not hidden. missed: hidden and not named.
        within: the final error is at most WITHIN floors. covered: name -> truth in its interval.
        worse: unseen recordings became worse.
    """
    added, kept = list(answer["added"]), list(answer["kept"])
    parts = {p for kind in hidden for p in effect(kind).includes}
    wanted, named = set(hidden) - parts, _alone(kept)
    group = {k: set(answer["confused"].get(k, ())) for k in named}
    excused = {k for k in named - wanted if group[k] & wanted}
    covered = {
        name: bool(abs(value - truth[name]) <= COVERED * std)
        for name, (value, std) in answer["parameters"].items()
        if name in truth and std is not None
    }
    validation = answer["validation"]
    first = (bool(added) and added[0] in set(hidden) | parts) if hidden else None
    return {
        "first": first,
        "exact": named == wanted,
        "declared": named - excused == wanted - {w for k in excused for w in group[k]},
        "false_alarms": sorted(named - wanted),
        "missed": sorted(wanted - named),
        "within": answer["rms"] <= WITHIN,
        "covered": covered,
        "flagged": "unlisted" in (answer["verdict"], answer["final_verdict"]),
        "worse": bool(validation) and validation[1] > max(WORSE * validation[0], WITHIN),
    }  # fmt: skip


def _alone(kinds: Sequence[str]) -> set[str]:
    """Without what others of them include."""
    return set(kinds) - {p for k in kinds for p in effect(k).includes}


ASKED = {
    "first effect right": 97, "one exactly": 95, "two exactly": 90, "three exactly": 85,
    "four exactly": 75, "no false alarm where nothing is hidden": 97,
    "outside the catalogue flagged": 90, "outside: unseen recordings no worse": 100,
    "final error within 1.15 floors": 95, "intervals that cover": 90,
    "stand-ins named as such": 95,
}  # fmt: skip
"""Line of the table -> per cent asked for."""


def tables(records: Sequence[Record]) -> str:
    """Hit rates, coverage per effect, and p-values under nothing hidden, as text."""
    done = [r for r in records if "judged" in r]
    lost = Counter(
        "failed" if "failed" in r else "not to be told" for r in records if r not in done
    )
    lines = [
        f"{len(done)} cases judged; " + (", ".join(f"{n} {k}" for k, n in lost.items()) or "all")
    ]
    lines += (
        _rates(done) + [""] + _coverage(done) + [""] + _p_values(done) + [""] + _stand_ins(done)
    )
    return "\n".join(lines)


def _rates(done: Sequence[Record]) -> list[str]:
    listed = [r for r in done if r["part"] == "hidden"]
    outside = [r for r in done if r["part"] == "outside"]
    some = [r for r in listed if r["hidden"]]
    found: dict[str, list[bool]] = {"first effect right": [r["judged"]["first"] for r in some]}
    for count, word in enumerate(("one", "two", "three", "four"), start=1):
        own = [r for r in some if len(r["hidden"]) == count]
        found[f"{word} exactly"] = [r["judged"]["exact"] for r in own]
        found[f"{word} exactly or declared confusable"] = [r["judged"]["declared"] for r in own]
    none = [r for r in listed if not r["hidden"]]
    alarm: Callable[[Record], bool] = lambda r: bool(r["judged"]["false_alarms"])  # noqa: E731
    found["no false alarm where nothing is hidden"] = [not alarm(r) for r in none]
    found["no false alarm at all"] = [not alarm(r) for r in listed]
    found["outside the catalogue flagged"] = [r["judged"]["flagged"] for r in outside]
    found["outside: unseen recordings no worse"] = [not r["judged"]["worse"] for r in outside]
    found["final error within 1.15 floors"] = [r["judged"]["within"] for r in listed]
    exact = [r for r in listed if r["judged"]["exact"]]
    found["intervals that cover"] = [x for r in exact for x in r["judged"]["covered"].values()]
    return [_line(name, hits) for name, hits in found.items()]


def _line(name: str, hits: Sequence[bool]) -> str:
    asked = f"  (asked {ASKED[name]} %)" if name in ASKED else ""
    if not hits:
        return f"{name:45s}    -{asked}"
    return f"{name:45s} {100.0 * np.mean(hits):5.1f} %  {sum(hits)} of {len(hits)}{asked}"


def _coverage(done: Sequence[Record]) -> list[str]:
    """Per effect, where the set was exactly right: another model's sizes mean something else."""
    found: dict[str, list[bool]] = {}
    for r in done:
        if r["part"] != "outside" and r["judged"]["exact"]:
            for name, hit in r["judged"]["covered"].items():
                found.setdefault(r["answer"]["origins"].get(name, "?"), []).append(hit)
    return ["Intervals of 95 % that hold the truth, by effect:"] + [
        _line(f"  {kind}", hits) for kind, hits in sorted(found.items())
    ]


def _p_values(done: Sequence[Record]) -> list[str]:
    """Of candidates with one size to try each, where nothing is hidden, by tenths."""
    p = [
        x
        for r in done
        if r["part"] == "hidden" and not r["hidden"]
        for x in r["answer"]["p_values"].values()
    ]
    return ["Under nothing hidden: " + (spread(p) if p else "no p-values yet")]


def spread(p_values: Sequence[float]) -> str:
    """How they lie, and whether uniformly."""
    counts, _ = np.histogram(p_values, np.linspace(0.0, 1.0, 11))
    test = kstest(p_values, "uniform").pvalue
    return (
        f"{len(p_values)} p-values by tenths: {' '.join(map(str, counts))}; "
        f"Kolmogorov-Smirnov p = {test:.3g}"
    )


def _stand_ins(done: Sequence[Record]) -> list[str]:
    own = [r for r in done if r["part"] == "stand_in"]
    lines = [_line("stand-ins named as such", [_right(r) for r in own])]
    for what in sorted({r["what"] for r in own}):
        lines.append(_line(f"  {what}", [_right(r) for r in own if r["what"] == what]))
    return lines


def _right(r: Record) -> bool:
    named = set(r["answer"]["kept"])
    return set(r["hidden"]) <= named and not named & set(INSTEAD)
