"""Number fields: what is typed is used, or refused where it stands."""

from __future__ import annotations

from typing import Any

import pytest

from flexgui.session.session import Session
from tests.page.helpers import box, enter, press, sees

REFUSED = (
    ("Length [s]", "999", "999 is not a number from 0.2 to 30; still 3."),
    ("Length [s]", "-50", "-50 is not a number from 0.2 to 30; still 3."),
    ("Points", "99", "99 is not a whole number from 1 to 15; still 7."),
)
"""Label, what is typed, what is said."""


@pytest.mark.long
def test_an_entry_outside_its_limits_stays_and_says_what_is_allowed(
    page: Any, session: Session
) -> None:
    press(page, "Data")
    for label, typed, sentence in REFUSED:
        enter(page, label, typed)
        sees(page, sentence)
        page.wait_for_timeout(2000)
        assert box(page, label).input_value() == typed
        enter(page, label, "3" if label == "Length [s]" else "7")
        page.get_by_text(sentence).wait_for(state="hidden")
