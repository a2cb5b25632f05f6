"""A hidden size comes back from noisy recordings, within its interval."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.effects import effect
from tests.effects.helpers import KINDS, primary, recover

INTERVAL = 3.0
"""Standard deviations; some forty sizes are recovered, each from the same noise."""

SURE = 0.15
"""Of the size: an interval that holds everything would prove nothing."""

WHITE = (0.9, 1.1)
"""Mean square of what remains, in units of the noise: four thousand samples scatter by 0.02."""


@pytest.mark.parametrize("kind", [kind for kind in KINDS if primary(effect(kind))])
def test_a_hidden_size_is_recovered_within_its_interval(kind: str) -> None:
    found = recover(kind)
    assert WHITE[0] < found.misfit < WHITE[1]
    assert np.all(found.std < SURE * np.abs(found.truth))
    assert np.all(found.deviations < INTERVAL)
