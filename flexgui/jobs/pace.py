"""How fast a stage goes, and how long it will take."""

from __future__ import annotations

import time
from collections.abc import Callable


class Pace:
    """Steps per second of the current stage, without the time in which it was paused."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self.stage(None)

    def stage(self, total: int | None) -> None:
        """A stage begins."""
        self._total, self._done, self._worked = total, 0, 0.0
        self._since: float | None = self._now()

    def advance(self, n: int) -> None:
        """Note that `n` steps are done."""
        self._done += n

    def pause(self) -> None:
        """Stop the clock."""
        self._worked, self._since = self._elapsed(), None

    def resume(self) -> None:
        """Let the clock go on."""
        if self._since is None:
            self._since = self._now()

    @property
    def remaining_seconds(self) -> float | None:
        """Of this stage; None where it is not known."""
        if not self._total or not self._done:
            return None
        left = max(self._total - self._done, 0)
        return self._elapsed() / self._done * left

    def _elapsed(self) -> float:
        return self._worked + (0.0 if self._since is None else self._now() - self._since)
