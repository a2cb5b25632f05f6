"""Who comes while a fresh machine compiles reads what is waited for."""

from __future__ import annotations

import logging
import threading
from types import SimpleNamespace
from typing import Any

import pytest

import core.warm
from flexgui.panels.in_browser import BUILDING
from flexgui.server import warming
from flexgui.server.warming import PREPARING, READY, Warming

PATIENCE = 10.0
"""s, far more than a thread needs to start."""


class Client:
    def __init__(self) -> None:
        self.said: list[str] = []
        self._websock_connection = SimpleNamespace(queue_message=self._take)

    def _take(self, message: Any) -> None:
        self.said.append(message.source)


class Pool:
    def __init__(self) -> None:
        self.started = threading.Event()

    def start(self) -> None:
        self.started.set()


def made(said: list[str]) -> tuple[Any, Pool]:
    pool = Pool()
    return Warming(pool, logging.getLogger("test"), said.append), pool  # type: ignore[arg-type]


@pytest.fixture(autouse=True)
def _nothing_to_load(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warming, "_load", lambda: None)


def test_a_fresh_machine_is_told_in_the_terminal_and_on_the_page(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun, end = threading.Event(), threading.Event()

    def compile_all(progress: Any) -> None:
        begun.set()
        assert end.wait(PATIENCE)

    monkeypatch.setattr(core.warm, "is_warm", lambda: False)
    monkeypatch.setattr(core.warm, "warm_up", compile_all)
    said: list[str] = []
    one, pool = made(said)
    one.start()
    assert begun.wait(PATIENCE)
    client = Client()
    one.receive(client)
    assert PREPARING in client.said[0]
    end.set()
    one.wait()
    one.admit(client)
    assert BUILDING in client.said[-1]
    assert pool.started.wait(PATIENCE)
    assert said == [PREPARING, READY]


def test_a_warm_machine_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(core.warm, "is_warm", lambda: True)
    said: list[str] = []
    one, pool = made(said)
    one.start().join(PATIENCE)
    client = Client()
    one.receive(client)
    one.wait()
    one.admit(client)
    assert pool.started.is_set()
    assert said == [] and not any(PREPARING in text for text in client.said)


def test_a_compilation_that_fails_keeps_nobody_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(progress: Any) -> None:
        raise RuntimeError("no compiler")

    monkeypatch.setattr(core.warm, "is_warm", lambda: False)
    monkeypatch.setattr(core.warm, "warm_up", fail)
    one, pool = made([])
    one.start().join(PATIENCE)
    one.wait()
    assert pool.started.is_set()
