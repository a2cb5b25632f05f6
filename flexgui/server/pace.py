"""How fast one connection may talk."""

from __future__ import annotations

from collections.abc import Callable


class Pace:
    """A bucket that leaks: nothing is thrown away, who talks too fast is heard later."""

    def __init__(self, per_second: float, burst: int, clock: Callable[[], float]) -> None:
        self._rate, self._burst, self._clock = per_second, burst, clock
        self._level, self._seen = 0.0, clock()

    def delay(self) -> float:
        """s to wait before the message that has just come is heard."""
        now = self._clock()
        self._level = max(self._level - (now - self._seen) * self._rate, 0.0) + 1.0
        self._seen = now
        return max(self._level - self._burst, 0.0) / self._rate
