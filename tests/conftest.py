"""Settings for all tests."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

ROOT = Path(__file__).parents[1]

if sys.dont_write_bytecode:
    # The tests start hundreds of processes, and each would compile every module of ours anew: a
    # second of a processor. The virtual environment is no place that this was to keep clean.
    sys.dont_write_bytecode = False
    sys.pycache_prefix = str(Path(sys.prefix) / "bytecode")
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# The first call compiles, which no deadline per example allows for; the same examples each time.
settings.register_profile("flexgui", deadline=None, derandomize=True)
settings.load_profile("flexgui")

ARMS = """
from dataclasses import replace
from flexgui.core.arm.compiled import compile_arm, compile_wide_arm
from flexgui.core.arm.arm import Structure
from flexgui.core.effects import catalogue
from flexgui.core.scenario.stated_effects import candidate_structures
from tests.helpers import PAPER
softer = [replace(Structure.of(PAPER), elastic=soft) for soft in ((True, False), (False, True))]
for structure in [*candidate_structures(PAPER, list(catalogue().values())), *softer][{}::2]:
    compile_arm(structure), compile_wide_arm(structure)
"""
"""Every second one of the structures that a diagnosis tries, those with one elastic joint too: so
many tests need them that all processes, and the workers of each, would compile them at the same
time."""
COMPILED = "from {} import {} as kernel; kernel.compiled\n"
HALVES = (
    COMPILED.format("flexgui.core.simulate.rosenbrock", "integrate")
    + COMPILED.format("flexgui.core.simulate.piecewise", "piecewise")
    + ARMS.format(0),
    COMPILED.format("flexgui.core.simulate.along_motion", "followed")
    + COMPILED.format("flexgui.core.simulate.linear", "respond_lanes")
    + ARMS.format(1),
)
"""What nearly every test needs compiled, once per machine: each is half of the work, and neither
compiles what the other does."""
MARK = (
    "from flexgui.core.precompile import compile_kernels; "
    "from flexgui.core.progress import Silent; compile_kernels(Silent())"
)
"""Finds all of it there, and says so to the next start."""


def pytest_configure(config: pytest.Config) -> None:
    """Before xdist starts its workers, which would all compile the same at the same time."""
    if hasattr(config, "workerinput") or not config.getoption("numprocesses", None):
        return
    from flexgui.core.precompile import kernels_compiled

    if not kernels_compiled():
        halves = [subprocess.Popen([sys.executable, "-c", text], cwd=ROOT) for text in HALVES]
        for half in halves:
            half.wait()
        subprocess.run([sys.executable, "-c", MARK], cwd=ROOT)


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync "
    "--use-angle=swiftshader --enable-unsafe-swiftshader"
).split()


@contextmanager
def headless_browser() -> Iterator[Any]:
    """Without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """One browser for all tests of a process: its driver cannot be started twice."""
    if CHROMIUM is None:
        pytest.skip("no Chromium on this machine: the page is not looked at")
    pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with headless_browser() as browser:
        yield browser


@pytest.fixture(scope="session")
def job_pool() -> Iterator[Any]:
    """One warm worker for the tests of pages and sessions: loading what jobs need takes seconds."""
    from flexgui.jobs import JobPool
    from tests.jobs.helpers import EVEN, warm_readers

    warm_readers()
    with JobPool(1, EVEN) as pool:
        yield pool
