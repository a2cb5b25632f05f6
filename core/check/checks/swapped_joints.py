"""Two channels of one kind under each other's name."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from core.check.case import Case
from core.check.finding import Check, Finding
from core.check.lagged import WORTH, share

CLEARLY = 0.2
"""Of the variance must the swap explain more."""


class SwappedJoints(Check):
    """Two joints, or the camera's axes, each of which fits the other's signals."""

    kind = "swapped_joints"

    def look(self, case: Case) -> Iterable[Finding]:
        for one in case.misfits:
            if one.swapped:
                yield from self._findings(case, *one.channels)
        known = {name for one in case.misfits for name in one.channels}
        yield from self._commands(case, known)
        yield from self._camera(case, known)
        yield from self._followers(case, known)

    def _findings(self, case: Case, first: str, second: str) -> Iterable[Finding]:
        sentence = f"{first} and {second} fit the other channels if they are swapped"
        a, b = case.recording.headers.get(first), case.recording.headers.get(second)
        mend = f'columns = {{ {first} = "{b}", {second} = "{a}" }}' if a and b else None
        for name in (first, second):
            yield case.finding(self.kind, name, 1.0, "", sentence, mend)

    def _commands(self, case: Case, known: set[str]) -> Iterable[Finding]:
        """References that explain the encoders better the other way round."""
        loops = [r for r in case.relations if len(r.inputs) == 2 and r.output.startswith("theta")]
        if len(loops) < 2 or known:
            return
        kept = float(np.mean([max(r.explained, 0.0) for r in loops]))
        swapped = float(np.mean([r.swapped for r in loops]))
        if swapped > max(kept + CLEARLY, WORTH):
            yield from self._findings(case, *loops[0].inputs)

    def _camera(self, case: Case, known: set[str]) -> Iterable[Finding]:
        """Axes whose moves are each other's, where the arm stands at 45 degrees to both."""
        loops = {r.output: r for r in case.relations if len(r.inputs) == 2}
        if known or not {"z1", "z2"} <= set(loops):
            return
        step = case.recording.step
        kept, swapped = [], []
        for own, other in (("z1", "z2"), ("z2", "z1")):
            y, x, crossed = case.mended.even(own), loops[own].expected, loops[other].expected
            if x is None or crossed is None:
                return
            kept.append(share(x, y, step))
            swapped.append(share(crossed, y, step))
        if min(swapped) > max(max(kept) + CLEARLY, WORTH):
            yield from self._findings(case, "z1", "z2")

    def _followers(self, case: Case, known: set[str]) -> Iterable[Finding]:
        """Positions or currents that follow the other joint's reference."""
        for kind in ("theta", "i"):
            pair = [
                r for r in case.relations if r.inputs == (f"{r.output}_ref",)
                and r.output in (f"{kind}1", f"{kind}2")
            ]  # fmt: skip
            if (
                len(pair) == 2
                and not known
                and all(r.swapped > max(r.direct + CLEARLY, WORTH) for r in pair)
            ):
                yield from self._findings(case, f"{kind}1", f"{kind}2")
