from __future__ import annotations

import threading
from dataclasses import dataclass
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.results import Generation
from flexgui.jobs import job as job_module
from flexgui.jobs.inbox import Inbox
from flexgui.jobs.job import Job
from flexgui.jobs.messages import (
    Advanced,
    Event,
    NewGeneration,
    Queued,
    Stage,
    Started,
    Task,
    merge_events,
)
from flexgui.jobs.pool import FairQueue, JobPool
from tests.jobs.helpers import PATIENCE, count


def generation(number: int) -> Generation:
    return Generation(number, 1.0, 1.0, 1.0, np.zeros(1))


@dataclass(frozen=True)
class Item:
    session: str
    number: int


def queue_of(sessions: str) -> FairQueue:
    queue = FairQueue()
    for k, session in enumerate(sessions):
        queue.put(cast(Job, Item(session, k)))
    return queue


def taken(queue: FairQueue) -> str:
    return "".join(item.session for item in iter(queue.take, None))


class TestFairQueue:
    def test_sessions_take_turns(self):
        assert taken(queue_of("aaabbc")) == "abcaba"

    def test_who_comes_back_stands_behind_who_waits_already(self):
        queue = queue_of("ab")
        first = queue.take()
        assert first is not None and first.session == "a"
        queue.done(first)
        queue.put(Item("a", 2))
        assert taken(queue) == "ba"

    @given(st.text("abc", max_size=12))
    def test_the_order_told_is_the_order_taken(self, sessions):
        queue = queue_of(sessions)
        told = list(queue.order())
        assert list(iter(queue.take, None)) == told
        assert len(told) == len(sessions)

    @given(st.text("abc", max_size=12))
    def test_no_session_is_more_than_one_ahead_while_others_wait(self, sessions):
        left = {s: sessions.count(s) for s in set(sessions)}
        served = dict.fromkeys(left, 0)
        for session in taken(queue_of(sessions)):
            served[session] += 1
            left[session] -= 1
            assert all(served[session] - served[s] <= 1 for s in left if left[s])


def after(*events: Event) -> list[Event]:
    """What waits once they have come."""
    waiting: list[Event] = []
    for event in events:
        waiting = merge_events(waiting, event)
    return waiting


class TestMerging:
    def test_only_the_newest_generation_of_each_fit_waits(self):
        events = [
            NewGeneration(fit, generation(k + n))
            for k in range(5)
            for fit, n in (("a", 0), ("b", 10))
        ]
        told = {e.label: e.generation.number for e in after(*events)}
        assert told == {"a": 4, "b": 14}

    @given(st.lists(st.integers(1, 5)))
    def test_no_step_and_no_simulation_is_lost(self, counts):
        events = [each for n in counts for each in (Advanced(n, simulations=2 * n), Queued(n))]
        told = [e for e in after(*events) if isinstance(e, Advanced)]
        assert sum(e.n for e in told) == sum(counts)
        assert sum(e.simulations for e in told) == 2 * sum(counts)

    def test_nothing_is_merged_across_a_new_stage(self):
        events = [Advanced(1), Stage("next", 3), Advanced(2)]
        assert after(*events) == events


class TestInbox:
    def test_what_waits_comes_in_order_and_one_delivery_at_a_time(self):
        heard, inside, done = [], [], threading.Event()

        def listener(totals: list[int]) -> None:
            inside.append(1)
            assert len(inside) == 1
            heard.extend(totals)
            inside.clear()
            if heard[-1] == 199:
                done.set()

        inbox = Inbox(listener, lambda waiting, item: [*waiting, item])
        for k in range(200):
            inbox.put(k)
        assert done.wait(PATIENCE)
        assert heard == list(range(200))

    def test_after_a_delivery_that_fails_the_next_one_comes(self, caplog):
        heard = threading.Event()

        def listener(items: list[str]) -> None:
            if items == ["broken"]:
                raise RuntimeError("broken page")
            heard.set()

        inbox = Inbox(listener)
        inbox.put("broken")
        assert inbox.wait_idle(PATIENCE)
        inbox.put("good")
        assert heard.wait(PATIENCE)
        assert "broken page" in caplog.text

    def test_a_closed_one_delivers_nothing(self):
        heard = []
        inbox = Inbox(heard.append)
        inbox.close()
        inbox.put("late")
        assert inbox.wait_idle(PATIENCE) and heard == []


class TestPace:
    @pytest.fixture
    def job(self) -> Job:
        pool = SimpleNamespace(lock=threading.RLock())
        return Job(cast(JobPool, pool), "s", Task.of(count, steps=3), lambda event: None)

    def test_time_left_follows_the_pace_and_leaves_out_pauses(self, job, monkeypatch):
        clock = [0.0]
        monkeypatch.setattr(job_module.time, "monotonic", lambda: clock[0])
        job.record(Started())
        job.record(Stage("Fitting", 10))
        assert job.remaining_seconds is None
        clock[0] = 4.0
        job.record(Advanced(2))
        assert job.remaining_seconds == 16.0
        job.pause()
        clock[0] = 100.0
        assert job.remaining_seconds == 16.0
        job.resume()
        clock[0] = 104.0
        job.record(Advanced(2))
        assert job.remaining_seconds == 12.0


class TestTask:
    def test_wrong_arguments_are_refused_at_once(self):
        with pytest.raises(TypeError):
            Task.of(count, stepps=3)
