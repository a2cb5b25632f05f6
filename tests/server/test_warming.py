"""A page comes before the simulation is compiled, and says what its jobs wait for."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import pytest

from flexgui.core import precompile
from flexgui.server import warming
from flexgui.server.warming import READY, Warming

PATIENCE = 10.0
"""s, far more than a thread needs to start."""


class Notice:
    """Of a browser."""

    def __init__(self, title: str, body: str) -> None:
        self.title, self.body, self.there = title, body, True

    def remove(self) -> None:
        self.there = False


class Client:
    def __init__(self) -> None:
        self.notices: list[Notice] = []
        self._websock_connection = SimpleNamespace(queue_message=lambda message: None)

    def add_notification(self, title: str, body: str, **more: Any) -> Notice:
        self.notices.append(Notice(title, body))
        return self.notices[-1]


class Pool:
    def __init__(self) -> None:
        self.started = threading.Event()
        self.warming = threading.Lock()

    def start(self) -> None:
        self.started.set()


def warming_of(said: list[str], shown: bool = True) -> tuple[Any, Pool]:
    pool = Pool()
    begun = Warming(pool, said.append)  # type: ignore[arg-type]
    if shown:
        begun.page_is_shown()
    return begun, pool


@pytest.fixture(autouse=True)
def _nothing_to_load(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warming, "_load", lambda: None)


def test_a_page_comes_before_all_is_compiled_and_says_what_its_jobs_wait_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun, more, end = threading.Event(), threading.Event(), threading.Event()

    def compile_all(progress: Any) -> None:
        progress.stage("compiling", 3)
        begun.set()
        assert more.wait(PATIENCE)
        progress.advance()
        begun.set()
        assert end.wait(PATIENCE)

    monkeypatch.setattr(precompile, "kernels_compiled", lambda: False)
    monkeypatch.setattr(precompile, "compile_kernels", compile_all)
    said: list[str] = []
    one, pool = warming_of(said, shown=False)
    early = Client()
    one.add_client(early)  # type: ignore[arg-type]
    thread = one.start()
    assert not begun.wait(0.2), "compilers and workers start behind the first page"
    one.page_is_shown()
    assert begun.wait(PATIENCE)
    one.wait()  # returns though nothing is compiled
    late = Client()
    one.add_client(late)  # type: ignore[arg-type]
    notices = [client.notices[0] for client in (early, late)]
    assert all(notice.there and notice.body.startswith("0 of 3 parts") for notice in notices)
    assert pool.warming.locked(), "a worker would compile the same once more"
    begun.clear()
    more.set()
    assert begun.wait(PATIENCE)
    assert all(notice.body.startswith("1 of 3 parts") for notice in notices)
    assert not pool.started.is_set()
    end.set()
    thread.join(PATIENCE)
    assert pool.started.is_set() and not any(notice.there for notice in notices)
    assert said == [f"{precompile.TITLE} ...", READY]


def test_a_warm_machine_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(precompile, "kernels_compiled", lambda: True)
    said: list[str] = []
    one, pool = warming_of(said)
    one.start().join(PATIENCE)
    client = Client()
    one.wait()
    one.add_client(client)  # type: ignore[arg-type]
    assert pool.started.is_set()
    assert said == [] and not client.notices


def test_a_compilation_that_fails_keeps_nobody_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(progress: Any) -> None:
        progress.stage("compiling", 3)
        raise RuntimeError("no compiler")

    monkeypatch.setattr(precompile, "kernels_compiled", lambda: False)
    monkeypatch.setattr(precompile, "compile_kernels", fail)
    one, pool = warming_of([])
    one.start().join(PATIENCE)
    one.wait()
    assert pool.started.is_set() and not pool.warming.locked()
