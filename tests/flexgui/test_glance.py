"""The report's first page."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.results import Outcome
from flexgui.export.report import report_html
from flexgui.export.report_sections import digest, glance
from flexgui.views.summary import DOUBTFUL, provisional_warning

SCENARIO = "[identify]\nseed = 7\n"
LARGEST = 1_500_000


def test_the_first_page_says_what_it_is_of(
    glocal: Outcome, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    facts = dict(glance(glocal, SCENARIO)["facts"])
    assert facts["Date"] == "1970-01-01"
    assert facts["Seed"] == "7"
    assert digest(glocal) in facts["Data"]
    page = report_html(glocal, SCENARIO)
    assert page.index('id="glance"') < page.index('id="parameters"') < page.index("Appendix")
    assert page.index("Appendix") < page.index('id="recordings"')
    assert len(page) < LARGEST


def test_other_data_have_another_digest(glocal: Outcome) -> None:
    first, *rest = glocal.comparisons
    channel = replace(first.channels[0], measured=np.roll(first.channels[0].measured, 1))
    moved = replace(first, channels=(channel, *first.channels[1:]))
    assert digest(replace(glocal, comparisons=(moved, *rest))) != digest(glocal)
    assert digest(replace(glocal)) == digest(glocal)


def test_far_from_the_floor_it_is_said_that_all_rests_on_a_complete_model() -> None:
    assert provisional_warning(DOUBTFUL) == "" == provisional_warning(float("nan"))
    assert provisional_warning(9.0).startswith("Provisional: error is 9.0× noise floor.")
