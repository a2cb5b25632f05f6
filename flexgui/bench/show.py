"""The benchmark's table."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from flexgui.bench.row import Row

_UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"))
_SAME = {None: "", True: "yes", False: "NO"}


def duration(seconds: float | None) -> str:
    """Three digits in the unit that suits."""
    if seconds is None:
        return ""
    size, unit = next((u for u in _UNITS if seconds >= u[0]), _UNITS[-1])
    return f"{seconds / size:.3g} {unit}"


def ratio(row: Row) -> str:
    """How many times faster, or what stands in its place."""
    return row.value if row.ratio is None else f"{row.ratio:.0f} x"


def table(rows: Sequence[Row], quick: bool) -> Table:
    """What, our time, the peer's, the ratio, the target, whether the answers agree."""
    title = "FlexGUI benchmark" + (" (quick: short recordings, few repeats)" if quick else "")
    shown = Table(title=title, show_lines=True)
    shown.add_column("comparison", overflow="fold")
    for name in ("ours", "peer", "ratio", "target", "same answer"):
        shown.add_column(name, justify="right")
    shown.add_column("remark", overflow="fold")
    for row in rows:
        target = "" if row.target is None else f">= {row.target:.0f} x"
        peer = duration(row.peer)
        cells = (duration(row.ours), peer, ratio(row), target, _SAME[row.same])
        shown.add_row(row.what, *cells, row.note)
    return shown
