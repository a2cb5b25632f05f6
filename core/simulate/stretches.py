"""Long simulations in stretches, between which somebody may stop them."""

from __future__ import annotations

from collections.abc import Iterator

from core.progress import look

STEPS = 20_000
"""Of a stretch: a step takes 1 to 20 us, alone or in lanes, so that a stop waits for less than half
a second."""


def stretches(samples: int, substeps: int) -> Iterator[slice]:
    """Rows of each stretch; the last row of one is the first of the next. One slice with all
    rows where there are few. Before each StoppedError where the user asked to stop.
    """
    rows = max(STEPS // substeps, 1)
    first = 0
    while True:
        look()
        last = min(first + rows, samples - 1)
        yield slice(first, last + 1)
        if last == samples - 1:
            return
        first = last
