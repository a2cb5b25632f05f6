"""Number fields: what is typed is used, or refused where it stands."""

from __future__ import annotations

from typing import Any

import pytest

from flexgui.session.session import Session
from tests.page.helpers import box, enter, press, sees


@pytest.mark.long
@pytest.mark.parametrize(
    ("label", "typed", "sentence"),
    [
        ("Length [s]", "999", "999 is not a number from 0.2 to 30; still 3."),
        ("Length [s]", "-50", "-50 is not a number from 0.2 to 30; still 3."),
        ("Points", "99", "99 is not a whole number from 1 to 15; still 7."),
    ],
)
def test_an_entry_outside_its_limits_stays_and_says_what_is_allowed(
    page: Any, session: Session, label: str, typed: str, sentence: str
) -> None:
    press(page, "Data")
    enter(page, label, typed)
    sees(page, sentence)
    page.wait_for_timeout(2000)
    assert box(page, label).input_value() == typed
    enter(page, label, "2")
    page.get_by_text(sentence).wait_for(state="hidden")
