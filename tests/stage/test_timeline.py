"""The player keeps time by the clock that it is given."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from flexgui.stage.timeline import Player

PATIENCE = 5.0
"""s, until a thread is taken for dead."""


class Clock:
    """Stands still until told otherwise."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class Still(Player):
    """A player without its thread: the test ticks."""

    def _wake(self) -> None:
        pass


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def seen() -> list[int]:
    return []


@pytest.fixture
def player(clock: Clock, seen: list[int]) -> Player:
    return Still(np.arange(11) * 0.1 + 7.0, seen.append, clock=clock)


def test_it_plays_in_real_time(player: Player, clock: Clock, seen: list[int]) -> None:
    player.play()
    for _ in range(3):
        player.tick()
        clock.now += 0.2
    assert seen == [0, 2, 4]


def test_the_latest_place_wins(player: Player, clock: Clock, seen: list[int]) -> None:
    player.play()
    player.tick()
    clock.now += 0.55
    player.tick()
    assert seen == [0, 5]


def test_a_sample_is_told_once(player: Player, clock: Clock, seen: list[int]) -> None:
    player.play()
    for _ in range(5):
        player.tick()
        clock.now += 0.01
    assert seen == [0]


def test_it_stops_at_the_end_and_says_so(clock: Clock, seen: list[int]) -> None:
    states: list[bool] = []
    player = Still(np.arange(11) * 0.1, seen.append, states.append, clock=clock)
    player.play()
    player.tick()
    clock.now += 5.0
    player.tick()
    assert seen[-1] == 10
    assert states == [True, False]
    assert not player.playing


def test_play_at_the_end_starts_again(player: Player, clock: Clock) -> None:
    player.seek(1.0)
    player.play()
    assert player.index == 0


def test_a_loop_begins_again(player: Player, clock: Clock) -> None:
    player.loop = True
    player.play()
    clock.now += 1.25
    player.tick()
    assert player.playing
    assert player.index == 2


def test_speed_changes_from_here_on(player: Player, clock: Clock) -> None:
    player.play()
    clock.now += 0.2
    player.speed = 0.5
    clock.now += 0.4
    assert player.place == pytest.approx(0.4)


def test_pause_holds_and_seek_goes_there(player: Player, clock: Clock, seen: list[int]) -> None:
    player.play()
    clock.now += 0.3
    player.pause()
    clock.now += 9.0
    assert player.place == pytest.approx(0.3)
    player.seek(0.75)
    player.tick()
    assert seen == [7]
    player.seek(99.0)
    assert player.index == 10


def test_steps_go_sample_by_sample_and_stay_inside(player: Player) -> None:
    player.seek(0.5)
    player.step()
    assert player.index == 6
    player.step(-2)
    assert player.index == 4
    player.step(-99)
    assert player.index == 0


def test_another_recording_starts_at_its_beginning(player: Player, seen: list[int]) -> None:
    player.seek(0.5)
    player.tick()
    player.load(np.linspace(3.0, 4.0, 3))
    player.tick()
    assert seen == [5, 0]
    assert player.duration == 1.0


def test_its_thread_calls_back_and_ends() -> None:
    at_end = threading.Event()
    seen: list[int] = []

    def on_sample(index: int) -> None:
        seen.append(index)
        if index == 4:
            at_end.set()

    player = Player(np.arange(5) * 0.02, on_sample, rate=60.0)
    player.play()
    assert at_end.wait(PATIENCE)
    player.close()
    assert seen == sorted(seen)
    thread = player._thread
    assert thread is not None
    thread.join(PATIENCE)
    assert not thread.is_alive()


def test_a_slow_call_skips_samples_and_never_overlaps() -> None:
    inside, worst, done = [0], [0], threading.Event()

    def slow(index: int) -> None:
        inside[0] += 1
        worst[0] = max(worst[0], inside[0])
        time.sleep(0.05)
        inside[0] -= 1
        if index == 19:
            done.set()

    player = Player(np.arange(20) * 0.01, slow, rate=60.0)
    player.play()
    for place in np.linspace(0.0, 0.1, 10):
        player.seek(float(place))
    assert done.wait(PATIENCE)
    player.close()
    assert worst[0] == 1


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_call_that_fails_does_not_end_the_player() -> None:
    again = threading.Event()

    def fragile(index: int) -> None:
        if index == 1:
            raise RuntimeError("the page has gone")
        if index == 2:
            again.set()

    player = Player(np.arange(3.0), fragile)
    player.seek(1.0)
    thread = player._thread
    assert thread is not None
    thread.join(PATIENCE)
    player.seek(2.0)
    assert again.wait(PATIENCE)
    player.close()
