"""A hundred of the cases of `make fuzz`, in this process."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.programs.fuzz.cases import case
from tests.programs.fuzz.judge import fault, perform
from tests.programs.fuzz.run import arrange

pytestmark = pytest.mark.long

SEED = 2
CASES = 180
"""Nine of each kind."""


@pytest.mark.parametrize("number", range(CASES))
def test_whatever_is_given_it_runs_or_says_one_sentence(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("FLEXGUI_DATA", raising=False)
    made = case(SEED, number)
    arrange(made, tmp_path)
    code = perform(made)
    assert not fault(code, capfd.readouterr().err)
