"""What stands in the rows of the list of candidates."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flexgui.core.results import RankedEffect
from flexgui.stages.diagnose.panel_candidates import WORDS

ONE = RankedEffect("tip_payload", "Tip payload", 50.0, 1e-9, 70.0, 46.0, 900.0)


def shown(*ranked: RankedEffect, rest: tuple[RankedEffect, ...] = (), over: bool = False) -> str:
    rows = [(one, "", "") for one in ranked]
    return str(WORDS.candidates(rows, rest, over, {}, True, True, ""))


def test_only_a_refitted_share_stands_in_bold() -> None:
    assert '<i class="strong">46 %</i>' in shown(ONE)
    expected = shown(replace(ONE, refit_drop_percent=None))
    assert '<i class="">≈ 70 %</i>' in expected
    assert "Not refitted; estimate: 70 % of the error" in expected


@pytest.mark.parametrize("share", [99.97, 100.0])
def test_no_share_is_called_all_of_it(share: float) -> None:
    assert "100 %" not in shown(replace(ONE, refit_drop_percent=share))


def test_what_explains_next_to_nothing_is_folded() -> None:
    little = replace(ONE, title="Rotor inertia", refit_drop_percent=0.3)
    listed, fold = shown(ONE, rest=(little,)).split('data-fold="rest"')
    assert "Tip payload" in listed and "Rotor inertia" not in listed
    assert "1 more explains less than 1&nbsp;%" in fold and "&lt; 1 %" in fold
    assert "One effect explains too little" in shown(rest=(little,), over=True)


def test_a_button_says_what_it_adds_to_whom_reads_with_the_ears() -> None:
    assert 'Add<span class="fx-unseen"> Tip payload</span></button>' in shown(ONE)
