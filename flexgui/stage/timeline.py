"""A player for recordings: play, pause, seek, step, speed, loop. It knows time, not widgets."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np

RATE = 30.0
"""Hz at most: what the page follows."""


class Player:
    """Calls `on_sample(index)` from one thread of its own, never twice at once.

    The latest place wins: while a call runs, places that pass are left out, so a slow call makes
    the motion jump and never lag. `on_state(playing)` tells that it started or came to an end.
    """

    def __init__(
        self,
        times: np.ndarray,
        on_sample: Callable[[int], None],
        on_state: Callable[[bool], None] | None = None,
        rate: float = RATE,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._times = np.asarray(times, dtype=float) - float(times[0])
        self._on_sample, self._on_state = on_sample, on_state
        self._interval, self._clock = 1.0 / rate, clock
        self._changed = threading.Condition(threading.RLock())
        self._place, self._since = 0.0, clock()
        self._playing, self._told_playing = False, False
        self._speed, self._loop = 1.0, False
        self._told: int | None = None
        self._closed = False
        self._thread: threading.Thread | None = None

    @property
    def duration(self) -> float:
        """s"""
        return float(self._times[-1])

    @property
    def playing(self) -> bool:
        """Whether it moves by itself."""
        with self._changed:
            return self._playing

    @property
    def place(self) -> float:
        """s from the start of the recording."""
        with self._changed:
            return self._now()

    @property
    def index(self) -> int:
        """The sample at that place."""
        return self._sample(self.place)

    @property
    def speed(self) -> float:
        """Seconds of the recording per second."""
        return self._speed

    @speed.setter
    def speed(self, value: float) -> None:
        with self._changed:
            self._settle(self._now())
            self._speed = max(float(value), 1e-3)
            self._wake()

    @property
    def loop(self) -> bool:
        """Whether it begins again at the end."""
        return self._loop

    @loop.setter
    def loop(self, value: bool) -> None:
        with self._changed:
            self._settle(self._now())
            self._loop = bool(value)

    def play(self) -> None:
        """Plays on; from the start where it stands at the end."""
        with self._changed:
            place = self._now()
            self._settle(0.0 if place >= self.duration else place)
            self._playing = True
            self._wake()

    def pause(self) -> None:
        """Stays where it is."""
        with self._changed:
            self._settle(self._now())
            self._playing = False
            self._wake()

    def seek(self, place: float) -> None:
        """Goes to a place in s, playing or not."""
        with self._changed:
            self._settle(float(np.clip(place, 0.0, self.duration)))
            self._wake()

    def step(self, samples: int = 1) -> None:
        """Pauses and moves by samples, back where negative."""
        with self._changed:
            index = int(np.clip(self._sample(self._now()) + samples, 0, len(self._times) - 1))
            self._settle(float(self._times[index]))
            self._playing = False
            self._wake()

    def load(self, times: np.ndarray) -> None:
        """Another recording, paused at its start."""
        with self._changed:
            self._times = np.asarray(times, dtype=float) - float(times[0])
            self._playing = False
            self._settle(0.0)
            self._told = None
            self._wake()

    def close(self) -> None:
        """Ends its thread; nothing is called after the call that runs."""
        with self._changed:
            self._closed, self._playing = True, False
            self._changed.notify_all()

    def tick(self) -> None:
        """Calls back if the sample or the state has changed; its thread does that by itself."""
        with self._changed:
            place = self._now()
            if self._playing and not self._loop and place >= self.duration:
                self._settle(self.duration)
                self._playing = False
            index, playing = self._sample(place), self._playing
            new_index, new_state = index != self._told, playing != self._told_playing
            self._told, self._told_playing = index, playing
        if new_index:
            self._on_sample(index)
        if new_state and self._on_state is not None:
            self._on_state(playing)

    def _now(self) -> float:
        if not self._playing:
            return self._place
        place = self._place + (self._clock() - self._since) * self._speed
        if self._loop and self.duration > 0.0:
            return place % self.duration if place > self.duration else place
        return min(place, self.duration)

    def _settle(self, place: float) -> None:
        self._place, self._since = place, self._clock()

    def _sample(self, place: float) -> int:
        """The last sample at or before a place; a tolerance against rounding."""
        found = int(np.searchsorted(self._times, place + 1e-9, side="right")) - 1
        return int(np.clip(found, 0, len(self._times) - 1))

    def _wake(self) -> None:
        # A call that failed has ended the thread; the next press starts another.
        alive = self._thread is not None and self._thread.is_alive()
        if not alive and not self._closed:
            self._thread = threading.Thread(target=self._run, name="player", daemon=True)
            self._thread.start()
        self._changed.notify_all()

    def _run(self) -> None:
        while True:
            started = time.monotonic()
            self.tick()
            with self._changed:
                if self._closed:
                    return
                rest = self._interval - (time.monotonic() - started)
                idle = not self._playing and self._told == self._sample(self._place)
                idle = idle and self._told_playing == self._playing
                if idle:
                    self._changed.wait()
                elif rest > 0.0:
                    self._changed.wait(rest)
