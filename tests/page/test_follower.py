"""Who follows the teacher reads it all the time, and can still turn to an own copy."""

from __future__ import annotations

from typing import Any

import pytest

from flexgui.page.in_browser import PURPOSE
from flexgui.session.session import Session
from tests.page.conftest import PATIENCE, Desktop
from tests.page.helpers import FIRST, sees

pytestmark = pytest.mark.long

BANNER = "You follow the teacher."


def test_a_follower_is_told_and_nobody_else(
    desktop: Desktop, chromium: Any, session: Session
) -> None:
    for follows in (True, False):
        desktop.read_only = follows
        context = chromium.new_context()
        context.set_default_timeout(PATIENCE)
        shown = context.new_page()
        shown.goto(desktop.address)
        shown.wait_for_function(FIRST)
        sees(shown, BANNER if follows else PURPOSE)
        assert bool(shown.get_by_text(BANNER).count()) == follows
        context.close()
