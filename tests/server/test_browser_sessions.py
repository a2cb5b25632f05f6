"""Sessions as people meet them: reload, a second browser, a demo. With real clicks."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.page.helpers import box, enter, plots, press, ready, redrawn, sees, shows, visit
from tests.server.served import Served, served

THETA2, EPSILON = "θ2 [deg]", "ε [GPa]"
COPY, FOLLOW = "Take my own copy", "Follow the teacher again"
SMALL = {"width": 1280, "height": 720}
STILL = 1000
"""ms in which a change that is not to come would have come."""


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("served"), "--workers", "1") as found:
        yield found


@pytest.fixture(scope="module")
def mine(server: Served, chromium: Any) -> Iterator[Any]:
    """A person's page, which each test leaves at the first stage: opening one takes seconds."""
    with visit(chromium, server.address) as page:
        yield page


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory, chromium: Any) -> Iterator[tuple[Served, Any]]:
    """A demo and its teacher's page, which all followers share as they do in a class."""
    with (
        served(tmp_path_factory.mktemp("demo"), "--demo", "--workers", "1") as demo,
        visit(chromium, demo.address) as teacher,
    ):
        yield demo, teacher


@pytest.mark.long
def test_a_reload_keeps_sliders_and_data(mine: Any) -> None:
    for label, value in ((EPSILON, "1.5"), (THETA2, "100")):
        before = plots(mine)
        enter(mine, label, value)
        redrawn(mine, before)
    press(mine, "Data")
    sees(mine, "7 to fit, 1 to validate.")
    enter(mine, "Points", "3")
    mine.wait_for_timeout(STILL / 2)
    press(mine, "Simulate these experiments")
    sees(mine, "3 to fit, 1 to validate.")
    mine.reload()
    sees(mine, "3 to fit, 1 to validate.")
    press(mine, "Arm")
    ready(mine)
    shows(mine, THETA2, "100")
    shows(mine, EPSILON, "1.5")


@pytest.mark.long
def test_two_browsers_do_not_see_each_other(server: Served, chromium: Any, mine: Any) -> None:
    with visit(chromium, server.address) as yours:
        before = plots(yours)
        first = plots(mine)
        enter(mine, THETA2, "120")
        redrawn(mine, first)
        yours.wait_for_timeout(STILL)
        assert box(yours, THETA2).input_value() == "60"
        assert plots(yours) == before
        yours.reload()
        ready(yours)
        shows(yours, THETA2, "60")


@pytest.mark.long
def test_a_follower_sees_the_teacher_and_takes_a_copy(
    taught: tuple[Served, Any], chromium: Any
) -> None:
    demo, teacher = taught
    with visit(chromium, demo.address) as follower:
        before = plots(follower)
        enter(teacher, THETA2, "100")
        redrawn(follower, before)
        shows(follower, THETA2, "100")
        enter(follower, THETA2, "150")
        sees(follower, "You follow the teacher")
        shows(follower, THETA2, "100")
        assert box(teacher, THETA2).input_value() == "100"
        press(teacher, "Data")
        sees(follower, "7 to fit, 1 to validate.")
        press(follower, "Identify")
        follower.wait_for_timeout(STILL)
        sees(teacher, "7 to fit, 1 to validate.")
        sees(follower, "7 to fit, 1 to validate.")
        press(teacher, "Arm")
        ready(follower)
        press(follower, COPY)
        follower.get_by_role("button", name=FOLLOW).wait_for()
        ready(follower)
        shows(follower, THETA2, "100")
        enter(follower, THETA2, "140")
        shows(follower, THETA2, "140")
        teacher.wait_for_timeout(STILL)
        assert box(teacher, THETA2).input_value() == "100"
        enter(teacher, THETA2, "80")
        follower.wait_for_timeout(STILL)
        assert box(follower, THETA2).input_value() == "140"
        press(follower, FOLLOW)
        follower.get_by_role("button", name=COPY).wait_for()
        ready(follower)
        shows(follower, THETA2, "80")
        assert "Traceback" not in demo.log, demo.log


@pytest.mark.long
def test_a_copy_in_a_small_window_is_a_live_page(taught: tuple[Served, Any], chromium: Any) -> None:
    """Its figures are narrower than those of a wide window, from which they begin."""
    demo, _ = taught
    with visit(chromium, demo.address, SMALL) as follower:
        for way, back in ((COPY, FOLLOW), (FOLLOW, COPY), (COPY, FOLLOW)):
            press(follower, way)
            follower.get_by_role("button", name=back).wait_for()
            ready(follower)
        before = plots(follower)
        enter(follower, THETA2, "140")
        redrawn(follower, before)
        follower.set_viewport_size({"width": 1100, "height": 700})
        follower.wait_for_timeout(STILL)
        before = plots(follower)
        enter(follower, THETA2, "100")
        redrawn(follower, before)
        assert not demo.log, demo.log


@pytest.mark.long
def test_a_lost_connection_is_told_and_the_work_is_offered_again(
    tmp_path: Path, chromium: Any
) -> None:
    port = ("--port", str(free_port()))
    with (
        served(tmp_path, "--workers", "1", *port) as before,
        visit(chromium, before.address) as page,
    ):
        press(page, "Data")
        sees(page, "7 to fit, 1 to validate.")
        enter(page, "Points", "3")
        page.wait_for_timeout(STILL / 2)
        press(page, "Simulate these experiments")
        sees(page, "3 to fit, 1 to validate.")
        before.process.kill()
        before.process.wait()
        sees(page, "The connection is lost.")
        with served(tmp_path, "--workers", "1", *port) as again:
            sees(page, "Restore your work of")
            page.get_by_text("The connection is lost.").wait_for(state="hidden")
            press(page, "Restore it")
            sees(page, "is restored")
            press(page, "Data")
            sees(page, "3 to fit, 1 to validate.")
            assert "Traceback" not in again.log, again.log


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
