from __future__ import annotations

import pytest

from tests.check.rigs import Rig, independent, simulated


@pytest.fixture(scope="session")
def rigs() -> list[Rig]:
    """A simulated rig and one of the independent engine, three recordings each."""
    return [simulated(3), independent("nothing", 3)]
