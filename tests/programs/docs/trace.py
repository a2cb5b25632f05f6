"""The own functions and files that a slider's move, a recording, a job and an export pass.

`python -m tests.programs.docs.trace` prints counts and files in their order; docs/architecture.md
holds what it printed.
"""

from __future__ import annotations

import asyncio
import inspect
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
OWN = tuple(str(ROOT / room) for room in ("core", "flexgui"))
MOVES = 5
"""Of a slider; the first after the page's start also makes what is made once."""
SETTLED = 2.0
"""s after which a page has drawn what it was asked to."""


class Trace:
    """Which own functions ran, in the order of their first call; all threads."""

    def __init__(self) -> None:
        self._on = False
        self._codes: dict[CodeType, None] = {}
        self.idle: set[CodeType] = set()
        """What runs while nobody does anything; it is no part of any way."""
        threading.setprofile(self._called)
        sys.setprofile(self._called)

    def _called(self, frame: FrameType, event: str, _: Any) -> None:
        if self._on and event == "call":
            self._codes.setdefault(frame.f_code)

    @contextmanager
    def at_rest(self) -> Iterator[None]:
        """Note what runs without a cause."""
        self._codes.clear()
        self._on = True
        yield
        self._on = False
        self.idle = set(self._codes)

    @contextmanager
    def named(self, title: str) -> Iterator[None]:
        """Print what ran meanwhile."""
        self._codes.clear()
        self._on = True
        yield
        self._on = False
        own = [c for c in self._codes if c.co_filename.startswith(OWN) and c not in self.idle]
        own = [c for c in own if c.co_name not in ("<module>", "<genexpr>", "<lambda>")]
        own = [c for c in own if not c.co_name.startswith("<")]
        # The body of a class runs when its module is imported; it is no function.
        own = [c for c in own if c.co_flags & inspect.CO_OPTIMIZED]
        files = list(dict.fromkeys(c.co_filename for c in own))
        print(f"\n## {title}: {len(own)} functions in {len(files)} files")
        for name in files:
            mine = [c.co_qualname for c in own if c.co_filename == name]
            print(f"{Path(name).relative_to(ROOT)}: {', '.join(mine)}")


PATIENCE = 300.0
"""s for a small identification, with the worker's first compilation before it."""


async def slider(trace: Trace, port: int, session: Any) -> None:
    """One browser without a screen moves θ2, then starts an identification."""
    from tests.programs.load.crowd import THETA2, Member
    from tests.server.helpers import action

    member = Member(1, 1, port)
    await member.arrive(PATIENCE)
    await asyncio.sleep(SETTLED)
    for k in range(MOVES):
        await member.set(THETA2, 40.0 + k)
        await asyncio.sleep(SETTLED)
    with trace.at_rest():
        await asyncio.sleep(SETTLED)
    with trace.named("A slider's move"):
        await member.set(THETA2, 77.0)
        await asyncio.sleep(SETTLED)
    await member.set("Action", action("stage", "Identify"))
    await member.set("Population", 8)
    await member.set("Generations", 2)
    await asyncio.sleep(SETTLED)
    with trace.named("A job, on the side of the page"):
        await member.set("Start identification", True)
        async with asyncio.timeout(PATIENCE):
            while session.identification.outcome is None:
                await asyncio.sleep(0.1)
        await asyncio.sleep(SETTLED)
    await member.leave()


def page(trace: Trace) -> None:
    """A viser server with a page in this process, its workers beside it."""
    from flexgui.jobs import JobPool
    from flexgui.session.session import Session
    from tests.page.conftest import Desktop, offered

    with JobPool(1) as pool, tempfile.TemporaryDirectory() as folder:
        desktop = Desktop(offered(pool))
        desktop.session = Session("trace", Path(folder), desktop.services)
        asyncio.run(slider(trace, desktop.server.get_port(), desktop.session))
        desktop.server.stop()
        desktop.session.close()


def headless(trace: Trace) -> None:
    """What a worker does, a recording's way to the ladder, and an export."""
    import flexgui as fg

    short = fg.load("mujoco/coulomb_friction")
    document = short.scenario.model_dump(exclude_unset=True)
    rig = short.with_settings(
        recordings=document["recordings"][:1],
        diagnose={"candidates": ["coulomb_friction", "viscous_friction"], "max_effects": 1},
    )
    plain = rig.with_settings(diagnose=None)
    for _ in range(2):  # once to compile and load
        with trace.named("A job, in its worker"):
            plain.identify()
    with trace.named("A recording's way to the ladder"):
        found = rig.diagnose()
    with tempfile.TemporaryDirectory() as out, trace.named("An export of what was computed"):
        found.export(out)


if __name__ == "__main__":
    watched = Trace()
    headless(watched)
    page(watched)
