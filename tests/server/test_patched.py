"""What we replace inside viser and plotly.js still is what it was when we did: after an update read
what changed, see whether the replacement still holds, and only then write the new digest here."""

from __future__ import annotations

import hashlib
import inspect
import tomllib
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from plotly.offline import get_plotlyjs
from viser import GuiApi, ViserServer, _assignable_props_api, _messages
from viser.infra import _async_message_buffer, _infra

from flexgui.server.front import AFTER_DRAWING, AFTER_REACTING

ROOT = Path(__file__).parents[2]
PATCHED: dict[str, tuple[Any, str]] = {
    "serve, by _served_with": (
        _infra.WebsockServer._background_worker, "59b19aac01fb31a3",
    ),
    "npt, by keep_hints": (
        _assignable_props_api.AssignablePropsBase._cast_value_recursive, "d6c2f32c36664ee7",
    ),
    "message_event, by let_threads_send": (
        _async_message_buffer.AsyncMessageBuffer, "a5346247208b3f6b",
    ),
    "_handle_incoming_message, by _report_errors": (
        _infra.WebsockMessageHandler._handle_incoming_message, "10ad01e6008ea965",
    ),
    "_thread_executor, by _report_errors": (
        ViserServer.__init__, "14c27c9c9808abeb",
    ),
    "_setup_plotly_js, by send_plotly": (
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
    [
        (AFTER_DRAWING, "_redrawFromAutoMarginCount?"),
        (AFTER_REACTING, '.emit("plotly_react"'),
    ],
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
    assert pin in project["dependencies"] and pin in constraints
