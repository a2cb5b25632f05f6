"""A hundred of the cases of `make fuzz`, in this process."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz.cases import FAMILIES, case
from tests.fuzz.judge import fault, perform
from tests.fuzz.run import arrange

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
