"""What we replace inside viser and plotly.js still is what it was when we did: after an update read
what changed, see whether the replacement still holds, and only then write the new digest here."""

from __future__ import annotations

import asyncio
import hashlib
import inspect
import tomllib
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from plotly.offline import get_plotlyjs
from viser import GuiApi, ViserServer, _assignable_props_api, _messages
from viser import _assignable_props_api as api
from viser.infra import _async_message_buffer, _infra

from flexgui.page.in_browser import AFTER_DRAWING, AFTER_REACTING
from flexgui.server.viser_patches import ThreadSafeEvent, cache_type_hints
from tests.server.conftest import Place
from tests.server.helpers import Browser, apart

ROOT = Path(__file__).parents[2]
PATCHED: dict[str, tuple[Any, str]] = {
    "serve, by _served_with": (
        _infra.WebsockServer._background_worker, "59b19aac01fb31a3",
    ),
    "npt, by cache_type_hints": (
        _assignable_props_api.AssignablePropsBase._cast_value_recursive, "d6c2f32c36664ee7",
    ),
    "message_event, by make_events_thread_safe": (
        _async_message_buffer.AsyncMessageBuffer, "a5346247208b3f6b",
    ),
    "_handle_incoming_message, by report_errors": (
        _infra.WebsockMessageHandler._handle_incoming_message, "10ad01e6008ea965",
    ),
    "_thread_executor, by report_errors": (
        ViserServer.__init__, "14c27c9c9808abeb",
    ),
    "_setup_plotly_js, by skip_plotly_upload": (
        GuiApi.add_plotly, "41e384ed6d8172ae",
    ),
    "_plotly_json_str, by Plot": (_messages.GuiPlotlyProps, "2f7e4d7a28f5c8ac"),
}  # fmt: skip


def digest(patched: Any) -> str:
    return hashlib.sha256(inspect.getsource(patched).encode()).hexdigest()[:16]


@pytest.mark.parametrize("patch", PATCHED)
def test_what_is_replaced_in_viser_is_as_it_was(patch: str) -> None:
    patched, known = PATCHED[patch]
    assert digest(patched) == known, f"{patch}: viser's own code has changed"


@pytest.mark.parametrize(
    ("pattern", "place"),
    [(AFTER_DRAWING, "_redrawFromAutoMarginCount?"), (AFTER_REACTING, '.emit("plotly_react"')],
    ids=["after drawing", "after reacting"],
)
def test_plotly_has_one_place_of_each_kind_that_is_mended(pattern: Any, place: str) -> None:
    script = get_plotlyjs()
    assert script.count(place) == len(pattern.findall(script)) == 1


@pytest.mark.parametrize("package", ["viser", "plotly"])
def test_what_is_patched_is_pinned_to_one_version(package: str) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    constraints = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    pin = f"{package}=={version(package)}"
    named = [*project["dependencies"], *project["optional-dependencies"]["page"]]
    assert pin in named and pin in constraints


HINTS = (
    npt.NDArray[np.float16], npt.NDArray[np.float32], npt.NDArray[np.float64],
    npt.NDArray[np.uint8], npt.NDArray[np.uint32], float, tuple[npt.NDArray[np.float64], ...],
    tuple[float, float, float],
)  # fmt: skip


@pytest.mark.parametrize("hint", HINTS, ids=str)
@pytest.mark.parametrize("name", ["vertices", "color"])
def test_a_value_is_cast_as_before(hint: Any, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(api, "npt", npt)
    numbers = np.array([0.25, 0.5, 1.0])
    value: Any = (numbers, numbers.astype(np.float32)) if "tuple[numpy" in str(hint) else numbers
    before = cast(hint, value, name)
    cache_type_hints()
    after = cast(hint, value, name)
    for a, b in zip(parts(before), parts(after), strict=True):
        assert a.dtype == b.dtype and np.array_equal(a, b)


def cast(hint: Any, value: Any, name: str) -> Any:
    """As a handle does it, which has no part in it but to call itself."""
    handle = api.AssignablePropsBase.__new__(Handle)
    return handle._cast_value_recursive(hint, value, name)


class Handle(api.AssignablePropsBase[Any]):
    def _queue_update(self, name: str, value: Any) -> None:
        raise NotImplementedError


def parts(value: Any) -> tuple[np.ndarray, ...]:
    return value if isinstance(value, tuple) else (value,)


class Waiter:
    """Of the event loop, which alone may look at it."""

    def done(self) -> bool:
        raise RuntimeError("deque mutated during iteration")


def test_a_thread_that_sends_leaves_the_loops_waiters_alone() -> None:
    event: Any = ThreadSafeEvent()
    event._waiters.append(Waiter())
    apart(event.set)
    assert event.is_set()


def test_who_waits_wakes_by_a_set_on_the_loop_even_after_one_of_a_thread() -> None:
    async def wake() -> bool:
        event = ThreadSafeEvent()
        waiting = asyncio.create_task(event.wait())
        await asyncio.sleep(0.0)
        await asyncio.to_thread(event.set)
        assert event.is_set() and not waiting.done()
        event.set()
        return await waiting

    assert apart(asyncio.run, wake())


def test_every_browsers_messages_are_announced_so(place: Place) -> None:
    inside = place.server.viser._websock_server
    with Browser(place.server) as browser:
        place.page(browser)
        buffers = [inside._broadcast_buffer]
        buffers += [state.message_buffer for state in inside._client_state_from_id.values()]
        assert len(buffers) == 2
        assert all(isinstance(buffer.message_event, ThreadSafeEvent) for buffer in buffers)
