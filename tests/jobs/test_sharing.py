"""Sessions that share a pool."""

from __future__ import annotations

import time

import pytest

from flexgui.core.errors import InputError
from flexgui.jobs import Finished, JobPool, Stopped
from flexgui.jobs.job import PAUSED, RUNNING, STOPPED
from flexgui.jobs.messages import NewGeneration, PoolSettings, Queued, Started
from tests.jobs.conftest import LIGHT
from tests.jobs.helpers import MANY, PATIENCE, Listener, begun, count, eventually, task


def test_three_sessions_take_turns_and_see_their_place(pool):
    first = pool.submit("a", task(count, steps=MANY), Listener())
    assert eventually(lambda: first.state.phase == RUNNING)
    order: list[str] = []

    def listener_of(name: str):
        return lambda e: order.append(name) if isinstance(e, Started) else None

    jobs = [
        pool.submit(name[0], task(count, steps=1), listener_of(name))
        for name in ("a1", "a2", "b1", "b2", "c1")
    ]
    assert [job.state.place for job in jobs] == [3, 5, 1, 4, 2]
    first.stop()
    assert all(job.wait(PATIENCE) for job in jobs)
    assert eventually(lambda: len(order) == 5)
    assert [name[0] for name in order[:3]].count("b") == 1
    assert order.index("c1") < order.index("b2") and order.index("b1") < order.index("a2")


def test_a_waiting_job_can_be_stopped_and_others_move_up(pool):
    running = pool.submit("a", task(count, steps=MANY), Listener())
    assert eventually(lambda: running.state.phase == RUNNING)
    heard = Listener()
    second = pool.submit("b", task(count, steps=1), Listener())
    third = pool.submit("c", task(count, steps=1), heard)
    assert third.state.place == 2
    second.stop()
    assert (second.state.phase, third.state.place) == (STOPPED, 1)
    running.stop()
    heard.wait_for(Finished)
    assert heard.of(Queued)[-1].place == 1


def test_a_session_that_leaves_drops_its_jobs_and_hears_nothing(pool):
    heard, other = Listener(), Listener()
    running = pool.submit("leaver", task(count, steps=MANY), heard)
    heard.wait_for(NewGeneration)
    queued = pool.submit("leaver", task(count, steps=1), heard)
    stays = pool.submit("stays", task(count, steps=3), other)
    pool.cancel_session("leaver")
    assert running.wait(PATIENCE) and queued.state.phase == STOPPED
    assert other.wait_for(Finished).result == 3 and stays.result == 3
    assert not heard.of(Stopped)


def test_too_many_waiting_jobs_of_one_session_are_refused_in_a_sentence():
    with JobPool(1, PoolSettings(queued_per_session=2, warm_up=None)) as pool:
        running = pool.submit("s", task(count, steps=MANY), Listener())
        assert eventually(lambda: running.state.phase == RUNNING)
        for _ in range(2):
            pool.submit("s", task(count, steps=1), Listener())
        with pytest.raises(InputError, match="2 jobs of this session wait already"):
            pool.submit("s", task(count, steps=1), Listener())
        pool.submit("other", task(count, steps=1), Listener())


def test_a_long_pause_ends_when_others_wait():
    with JobPool(1, PoolSettings(pause_limit=0.3, warm_up=None)) as pool:
        job, heard = begun(pool, count, session="a", steps=MANY)
        heard.wait_for(NewGeneration)
        job.pause()
        time.sleep(0.6)
        assert job.state.phase == PAUSED
        other = pool.submit("b", task(count, steps=1), Listener())
        assert heard.wait_for(Stopped).result > 0
        assert other.wait(PATIENCE)


def test_two_workers_work_at_once():
    with JobPool(2, LIGHT) as pool:
        assert eventually(lambda: pool.workers_ready == 2)
        jobs = [pool.submit(s, task(count, steps=MANY), Listener()) for s in "ab"]
        assert eventually(lambda: all(job.state.phase == RUNNING for job in jobs))
