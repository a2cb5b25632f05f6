"""A hundred of the cases of `make fuzz`, in this process."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.programs.fuzz.cases import FAMILIES, case
from tests.programs.fuzz.judge import fault, perform
from tests.programs.fuzz.run import _progress, _wait, arrange

pytestmark = pytest.mark.long

SEED = 2
CASES = 180
"""Nine of each kind."""


@pytest.mark.parametrize("number", range(CASES))
def test_whatever_is_given_it_runs_or_says_one_sentence(
    number: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("FLEXGUI_DATA", raising=False)
    made = case(SEED, number)
    arrange(made, tmp_path)
    code = perform(made)
    assert not fault(code, capfd.readouterr().err)


def test_the_cases_are_the_same_each_time_and_not_all_alike() -> None:
    first = [case(SEED, number) for number in range(CASES)]
    assert first == [case(SEED, number) for number in range(CASES)]
    assert len({repr(each) for each in first}) == CASES
    assert len({each.label for each in first}) >= len(FAMILIES) - 2


def begun(work: Callable[[], object]) -> int:
    child = os.fork()
    if child == 0:
        work()
        os._exit(0)
    return child


def spin() -> None:
    while True:
        pass


def test_a_case_that_waits_is_ended_and_so_is_one_that_works_for_ever() -> None:
    code, worked, _ = _wait(begun(lambda: time.sleep(1000.0)), 0.3)
    assert code == -signal.SIGKILL and worked < 0.3
    code, worked, _ = _wait(begun(spin), 0.3)
    assert code == -signal.SIGKILL and worked >= 0.3


def test_time_in_which_others_have_the_processor_does_not_count_as_waiting() -> None:
    """A stopped process is not ready to run; one that runs is, however seldom its turn comes."""
    child = begun(spin)
    try:
        assert _progress(child)[0]
        os.kill(child, signal.SIGSTOP)
        end = time.monotonic() + 10.0
        while _progress(child)[0] and time.monotonic() < end:
            time.sleep(0.01)
        assert not _progress(child)[0]
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
