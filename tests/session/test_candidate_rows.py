"""What stands in the rows of the list of candidates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.results import LadderStep, RankedEffect
from flexgui.stages.diagnose.look import Looked
from flexgui.stages.diagnose.panel_candidates import row_words

ONE = RankedEffect("tip_payload", "Tip payload", 50.0, 1e-9, 70.0, 46.0, 900.0)
FOUND = Looked(
    LadderStep(None, "as given", (), (), None, 9.0), ("a",), (("z1",),), (1e-3,),
    (np.zeros((3, 1)),), ranking=(ONE,),
)  # fmt: skip


def row(one: RankedEffect) -> str:
    return str(row_words(0, one, FOUND, {}))


def test_only_a_refitted_share_stands_in_bold() -> None:
    assert "<i>46 %</i>" in row(ONE)
    expected = row(replace(ONE, refit_drop_percent=None))
    assert "<i></i>" in expected
    assert "Not refitted; estimate: ≈ 70 % of the error" in expected


@pytest.mark.parametrize("share", [99.97, 100.0])
def test_no_share_is_called_all_of_it(share: float) -> None:
    assert "100 %" not in row(replace(ONE, refit_drop_percent=share))
