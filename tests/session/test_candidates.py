"""The list of candidates: what stands in its rows, and the place of an own effect in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.results import ChannelError, Estimate, LadderStep, RankedEffect
from flexgui.library.shipped import demo_scenario
from flexgui.stages.diagnose.effects import own_place, own_ranked, ranked_with_own
from flexgui.stages.diagnose.model_versions import ModelFindings, ModelVersion
from flexgui.stages.diagnose.panel_candidates import WORDS

ONE = RankedEffect("tip_payload", "Tip payload", 50.0, 1e-9, 70.0, 46.0, 900.0)


def shown(*ranked: RankedEffect, rest: tuple[RankedEffect, ...] = (), over: bool = False) -> str:
    rows = [(one, "", "") for one in ranked]
    return str(WORDS.candidates(rows, rest, over, {}, True, ""))


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


def listed(kind: str, refitted: float | None) -> RankedEffect:
    return RankedEffect(kind, kind, 9.0, 1e-9, 50.0, refitted, None)


def version(rms: float, *names: str, added: str | None = None) -> ModelVersion:
    step = LadderStep(
        None, "", tuple(Estimate(n, 1.0, 0.1, "", True) for n in names),
        (ChannelError("z1", "m", rms, 1.0),), None, rms**2,
    )  # fmt: skip
    found = ModelFindings(step, ("th1",), (("z1",),), (0.1,), (np.full((5, 1), rms),))
    return ModelVersion(demo_scenario(), "Own effect 1" if added else "", added, found)


BEFORE = version(10.0, "EI")
RANKING = (listed("a", 99.0), listed("b", 60.0), listed("c", None))


def with_list(ranking: tuple[RankedEffect, ...]) -> ModelVersion:
    assert BEFORE.found is not None
    return replace(BEFORE, found=replace(BEFORE.found, ranking=ranking))


def test_it_stands_between_what_explains_more_and_less() -> None:
    before, after = with_list(RANKING), version(5.0, "EI", "k", added="own_1")
    own = own_ranked(before, after)
    assert own is not None and own.refit_drop_percent == pytest.approx(100.0 * 75.0 / 99.0)
    assert [e.name for e in own.parameters] == ["k"]
    assert np.allclose(own.predicted[0], 5.0), "what was there less what is left"
    whole = ranked_with_own(before, after)
    assert [r.effect for r in whole.ranking] == ["a", "own_1", "b", "c"]
    assert [r.effect for r in ranked_with_own(whole, after).ranking] == ["a", "own_1", "b", "c"]
    assert own_place(before, after) == (
        "Your formula is number 2 of 4: it explains 75.8 % of the error above the noise floor; the "
        "best listed one, a, 99.0 %."
    )


def test_parameters_cost_something() -> None:
    names = ("k1", "k2", "k3", "k4")
    after = version(float(np.sqrt(100.0 - 0.61 * 99.0)), "EI", *names, added="own_1")
    whole = ranked_with_own(with_list(RANKING), after)
    assert [r.effect for r in whole.ranking] == ["a", "b", "own_1", "c"]


def test_without_a_list_there_is_no_place() -> None:
    after = version(5.0, "EI", "k", added="own_1")
    assert own_ranked(BEFORE, after) is None and own_place(BEFORE, after) == ""
    assert ranked_with_own(BEFORE, after) is BEFORE
