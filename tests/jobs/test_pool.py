"""A pool of workers, and sessions that share it."""

from __future__ import annotations

import os
import signal
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest

from flexgui.core.errors import InputError
from flexgui.jobs import Event, Failed, Finished, Job, JobPool, Stopped, Task, WorkerLost
from flexgui.jobs.job import DONE, LOST, PAUSED, RUNNING, STOPPED
from flexgui.jobs.messages import (
    Advanced,
    NewGeneration,
    Paused,
    PoolSettings,
    Queued,
    Resumed,
    Stage,
    Started,
)
from tests.jobs import helpers
from tests.jobs.conftest import LIGHT
from tests.jobs.helpers import (
    MANY,
    PATIENCE,
    Listener,
    begun,
    count,
    eventually,
    process_id,
    sleep_deaf,
    task,
)

RATE = 20.0
"""Largest number of generations told per second."""


def test_a_job_streams_and_its_generations_are_throttled(pool):
    job, heard = begun(pool, count, steps=200)
    assert heard.wait_for(Finished).result == 200
    assert (job.state.phase, job.result, job.state.stage) == (DONE, 200, "Counting")
    kinds = [type(e) for e in heard.events]
    assert kinds.index(Queued) < kinds.index(Started) < kinds.index(Stage) < kinds.index(Advanced)
    assert kinds[-1] is Finished
    assert sum(e.n for e in heard.of(Advanced)) == 200
    assert heard.of(Advanced)[-1].text == "200"
    told = [e.generation.number for e in heard.of(NewGeneration)]
    assert told == sorted(set(told)) and told[-1] == 200
    seconds = heard.times[-1] - heard.times[0]
    assert 3 <= len(told) <= RATE * seconds + 2
    assert job.state.history["count"][-1].number == 200


@pytest.mark.parametrize("paused", [False, True])
def test_stop_keeps_what_was_found(pool, paused):
    job, heard = begun(pool, count, steps=MANY)
    heard.wait_for(NewGeneration)
    if paused:
        job.pause()
        heard.wait_for(Paused)
    job.stop()
    job.stop()
    assert 0 < heard.wait_for(Stopped).result < MANY
    assert job.state.phase == STOPPED and job.result == heard.events[-1].result


def stands(job: Job) -> bool:
    number = job.state.history["count"][-1].number
    time.sleep(0.3)
    return job.state.history["count"][-1].number == number


def test_pause_holds_and_resume_goes_on(pool):
    job, heard = begun(pool, count, steps=300)
    heard.wait_for(NewGeneration)
    job.pause()
    heard.wait_for(Paused)
    assert eventually(lambda: stands(job))  # what was under way comes in
    held, left = job.state.history["count"][-1].number, job.remaining_seconds
    time.sleep(0.3)
    assert (job.state.phase, job.state.history["count"][-1].number) == (PAUSED, held)
    assert job.remaining_seconds == left and left is not None
    job.resume()
    heard.wait_for(Resumed)
    assert heard.wait_for(Finished).result == 300


def test_a_killed_worker_is_told_and_replaced(pool):
    job, heard = begun(pool, count, steps=40)
    heard.wait_for(NewGeneration)
    (pid,) = pool.worker_pids
    os.kill(pid, signal.SIGKILL)
    assert "signal 9" in heard.wait_for(WorkerLost).sentence
    assert job.state.phase == LOST
    pool.submit("s", task(count, steps=40), heard)
    assert heard.wait_for(Finished).result == 40
    assert pool.worker_pids != (pid,)


def test_an_idle_worker_that_is_killed_is_replaced(pool):
    assert eventually(lambda: pool.workers_ready == 1)
    (pid,) = pool.worker_pids
    os.kill(pid, signal.SIGKILL)
    assert eventually(lambda: pool.workers_ready == 1 and pool.worker_pids != (pid,))


def test_bad_input_is_one_sentence(pool):
    _, heard = begun(pool, helpers.refuse)
    assert heard.wait_for(Failed).sentence == "rig.csv has no column theta2; add it."


@pytest.mark.parametrize(
    ("work", "named"),
    [
        (task(helpers.crash), "ZeroDivisionError: a rig without length"),
        (task(helpers.unsendable), "Error"),
        (Task("tests.jobs.helpers:count", {"steps": lambda: 3}, "The test"), "Error"),
        (Task("tests.jobs.helpers:nowhere", title="The test"), "AttributeError"),
    ],
    ids=["crash", "unsendable result", "unsendable argument", "no such function"],
)
def test_an_unexpected_error_is_a_plain_sentence_and_stands_in_the_log(pool, caplog, work, named):
    heard = Listener()
    job = pool.submit("s", work, heard)
    sentence = heard.wait_for(Failed).sentence
    assert sentence.startswith("The test failed unexpectedly (") and named in sentence
    assert sentence.endswith("details are in the log.") and "\n" not in sentence
    assert "Traceback" in caplog.text
    assert job.state.sentence == sentence


def test_a_task_that_ends_its_process_is_a_lost_worker(pool):
    _, heard = begun(pool, helpers.die_quietly)
    assert "exit code 3" in heard.wait_for(WorkerLost).sentence


def test_a_listener_that_fails_harms_nobody(pool):
    def broken(event: Event) -> None:
        raise RuntimeError("page gone")

    first = pool.submit("s", task(count, steps=5), broken)
    second = pool.submit("s", task(count, steps=5), Listener())
    assert first.wait(PATIENCE) and second.wait(PATIENCE)
    assert (first.result, second.result) == (5, 5)


def test_a_listener_may_use_its_job(pool):
    heard, jobs = Listener(), []

    def listener(event: Event) -> None:
        heard(event)
        if isinstance(event, NewGeneration):
            jobs[0].stop()

    jobs.append(pool.submit("s", task(count, steps=MANY), listener))
    assert heard.wait_for(Stopped).result < MANY


def test_many_small_jobs_leave_nothing_behind(pool):
    def handles() -> tuple[int, int]:
        return len([*Path("/proc/self/fd").iterdir()]), threading.active_count()

    assert pool.submit("s", task(count, steps=1), Listener()).wait(PATIENCE)
    before = handles()
    jobs = [pool.submit("s", task(count, steps=1), Listener()) for _ in range(50)]
    assert all(job.wait(PATIENCE) and job.result == 1 for job in jobs)
    assert eventually(lambda: all(a <= b for a, b in zip(handles(), before, strict=True)))
    assert not pool.waiting and not pool._active


def test_a_worker_is_replaced_after_its_share_of_jobs():
    with JobPool(1, PoolSettings(recycle_after=2, warm_up=None)) as pool:
        jobs = [pool.submit("s", task(process_id), Listener()) for _ in range(4)]
        assert all(job.wait(PATIENCE) for job in jobs)
    pids = [job.result for job in jobs]
    assert pids[0] == pids[1] != pids[2] == pids[3]


@pytest.mark.long
def test_workers_that_never_start_are_told_instead_of_waited_for(caplog):
    settings = PoolSettings(warm_up="tests.jobs.helpers:never_there")
    with JobPool(1, settings) as pool:
        _, heard = begun(pool, count, steps=1)
        assert "No worker process can be started" in heard.wait_for(Failed).sentence
    assert "could not be started (exit code 4)" in caplog.text


def test_a_warm_up_that_fails_stands_in_the_log_and_the_worker_works(caplog):
    with JobPool(1, PoolSettings(warm_up="tests.jobs.helpers:never_warm")) as pool:
        job = pool.submit("s", task(count, steps=3), Listener())
        assert job.wait(PATIENCE) and job.result == 3
    assert "no warmth" in caplog.text


def test_nothing_is_accepted_after_the_end():
    pool = JobPool(1, LIGHT)
    pool.close()
    pool.close()
    with pytest.raises(InputError, match="closed"):
        pool.submit("s", task(count, steps=1), Listener())


def test_a_worker_that_has_not_stopped_yet_is_ready_until_it_is_replaced():
    """A job that is waited for shows that there is a free one, after its replacement too."""
    with JobPool(1, replace(LIGHT, grace=2.0)) as pool:
        first = Listener()
        pool.submit("s", task(process_id), first)
        before = first.wait_for(Finished).result
        deaf = Listener()
        job = pool.submit("s", task(sleep_deaf, seconds=PATIENCE), deaf)
        deaf.wait_for(Stage)
        job.stop()
        assert pool.worker_pids == (before,)
        assert deaf.wait_for(Stopped).result is None
        second = Listener()
        pool.submit("s", task(process_id), second)
        assert second.wait_for(Finished).result == pool.worker_pids[0] != before


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
    assert heard.of(Queued)[-1].place == 0, "nobody is before it, it only begins"


def test_a_job_that_waits_for_its_worker_alone_has_no_place():
    with JobPool(1, LIGHT) as cold:
        first = cold.submit("a", task(count, steps=1), Listener())
        second = cold.submit("b", task(count, steps=1), Listener())
        assert (first.state.place, second.state.place) == (0, 1)


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
