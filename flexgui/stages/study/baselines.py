"""What the figures of the baselines say: each method beside glocal, and how often glocal wins."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from flexgui.core.sentences import listed
from flexgui.sentences.written import format_number

if TYPE_CHECKING:
    from flexgui.core.montecarlo.summary import BaselineRow

GLOCAL, NONLINEAR = "glocal", "non-linear output error"
KINDS = {
    "identified": ("at its own points", "its own points", "at identified working points"),
    "unseen": ("at unseen points", "unseen points", "at unseen working points"),
    "sweeps": ("on sweeps", "sweeps", "on sweeps"),
}
"""Kind of recordings -> how it is called in a method's sentence, in glocal's, in the count."""

EQUAL = 0.05
"""% of FIT: a difference below this is none."""
EQUAL_SHARE = 0.02
"""Of a pole error or a time: likewise."""


def result_words(row: BaselineRow) -> str:
    """What a method found, in a few words."""
    if "order" in row.found:
        return f"order {row.found['order']}, degree {row.found['degree']} in cos θ₂"
    return "EI " + ", ".join(f"{EI:.2f}" for EI in row.found["EI"]) + " N m²"


def conclusions(rows: Sequence[BaselineRow]) -> list[str]:
    """What each row's figures say beside glocal's at the same points and ratio; for glocal itself
    beside the best of the others."""
    found = []
    for row in rows:
        same = [r for r in rows if (r.points, r.snr_db) == (row.points, row.snr_db)]
        others = [r for r in same if r.method != row.method]
        glocal = next((r for r in others if r.method == GLOCAL), None)
        if row.method == GLOCAL:
            found.append(_of_glocal(row, others))
        else:
            found.append("" if glocal is None else _beside(row, glocal))
    return found


def _beside(row: BaselineRow, glocal: BaselineRow) -> str:
    ahead: list[str] = []
    behind: list[str] = []
    for kind, (words, *_) in KINDS.items():
        gain = row.fit[kind] - glocal.fit[kind]
        if abs(gain) > EQUAL:
            (ahead if gain > 0 else behind).append(f"{abs(gain):.2f} points of FIT {words}")
    poles = row.pole_error, glocal.pole_error
    if abs(poles[0] - poles[1]) > EQUAL_SHARE * max(poles):
        times = max(poles) / max(min(poles), 1e-300)
        worse = poles[0] > poles[1]
        (behind if worse else ahead).append(
            f"poles {format_number(times, 3)} times {'as wrong' if worse else 'as near'}"
        )
    return f"{_verdict(ahead, behind)} {_effort(row, glocal)}"


def _verdict(ahead: Sequence[str], behind: Sequence[str]) -> str:
    if not ahead and not behind:
        return "As good as glocal."
    if not behind:
        return f"Better than glocal: {', '.join(ahead)}."
    if not ahead:
        return f"Worse than glocal: {', '.join(behind)}."
    return f"Better than glocal in {', '.join(ahead)}; worse in {', '.join(behind)}."


def _effort(row: BaselineRow, glocal: BaselineRow) -> str:
    times = row.seconds / glocal.seconds
    time = f"{times:.1f} times the time" if times >= 1.0 else f"{1.0 / times:.1f} times as fast"
    if row.parameters == glocal.parameters:
        return f"As many parameters, {time}."
    return f"{row.parameters} numbers instead of {glocal.parameters}, {time}."


def _of_glocal(row: BaselineRow, others: Sequence[BaselineRow]) -> str:
    won, lost = [], []
    for kind, (_, words, _) in KINDS.items():
        best = max(others, key=lambda r: r.fit[kind])
        gain = row.fit[kind] - best.fit[kind]
        if gain < -EQUAL:
            lost.append(f"{words} ({best.method}, by {-gain:.2f} points)")
        elif gain > EQUAL:
            won.append(f"{words} (by {gain:.2f} points)")
    nearest = min(others, key=lambda r: r.pole_error)
    if row.pole_error < (1.0 - EQUAL_SHARE) * nearest.pole_error:
        won.append("poles")
    elif row.pole_error > (1.0 + EQUAL_SHARE) * nearest.pole_error:
        times = row.pole_error / max(nearest.pole_error, 1e-300)
        lost.append(f"poles ({nearest.method}, {format_number(times, 3)} times as near)")
    first = f"Best on {', '.join(won)}." if won else "Best on nothing alone."
    return f"{first} Beaten on {', '.join(lost)}." if lost else f"{first} Beaten on nothing."


Cells = dict[tuple[int, float | None], "dict[str, BaselineRow]"]
"""(points, ratio) -> method -> row"""


def about_baselines(rows: Sequence[BaselineRow]) -> Iterator[tuple[str, str]]:
    """How often each method is best, and by how much glocal is ahead or behind."""
    if not rows:
        return
    cells: Cells = {}
    for row in rows:
        cells.setdefault((row.points, row.snr_db), {})[row.method] = row
    sentences = [_wins(cells, kind, words) for kind, (*_, words) in KINDS.items()]
    linear = {
        key: {name: row for name, row in methods.items() if name != NONLINEAR}
        for key, methods in cells.items()
    }
    sentences.append(_wins(linear, "sweeps", "on sweeps among the linear models"))
    others = [m for m in next(iter(cells.values())) if m != GLOCAL]
    sentences += [_against(cells, name) for name in others]
    yield "Does glocal hold what is claimed for it?", " ".join(sentences)


def _wins(cells: Cells, kind: str, words: str) -> str:
    tops = [max(methods.values(), key=lambda r: r.fit[kind]) for methods in cells.values()]
    glocal = [methods[GLOCAL].fit[kind] for methods in cells.values()]
    pairs = zip(tops, glocal, strict=True)
    lost = [top.method for top, own in pairs if own < top.fit[kind] - EQUAL]
    text = (
        f"In FIT {words} glocal is best, or within {EQUAL:g} points of the best, in "
        f"{len(cells) - len(lost)} of {len(cells)} cells"
    )
    return f"{text}; beaten by {listed(sorted({*lost}))} in {len(lost)}." if lost else f"{text}."


def _against(cells: Cells, name: str) -> str:
    pairs = [(methods[name], methods[GLOCAL]) for methods in cells.values() if name in methods]
    gain = [g.fit["sweeps"] - m.fit["sweeps"] for m, g in pairs]
    poles = [m.pole_error / max(g.pole_error, 1e-300) for m, g in pairs]
    time = [m.seconds / g.seconds for m, g in pairs]
    return (
        f"Against {name}: glocal is {plus(float(np.median(gain)), 2)} points of FIT on sweeps "
        f"({plus(min(gain), 2)} to {plus(max(gain), 2)}), its poles are "
        f"{format_number(float(np.median(poles)), 2)} times as near, and the other takes "
        f"{format_number(float(np.median(time)), 2)} times as long (medians)."
    )


def plus(value: float, digits: int) -> str:
    """'+0.03', with a true minus, and no sign before a zero."""
    text = f"{value:+.{digits}f}"
    return text[1:] if float(text) == 0.0 else text.replace("-", "−")


def snr(snr_db: float | None) -> str:
    """'SNR ∞' or '20 dB'."""
    return "SNR ∞" if snr_db is None else f"{snr_db:g} dB"
