"""Drawing what is hidden in the plain rigs: `python -m tests.programs.sample.draw`, once.

How much an effect shows is weighed with the program's own means, so a second drawing by a changed
program would hide something else; the sample reads the file instead.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from flexgui.core.challenge.detectability import UnreachableError
from tests.programs.sample.cases import TRUTH
from tests.programs.studies.plain_matrix import COUNTS
from tests.programs.studies.plain_matrix_hidden import Sight, hide
from tests.programs.studies.plain_matrix_rigs import drawn

CASES, EFFECTS = 8, 3
RECORDINGS, SAMPLES = 5, 3000
"""At most, so that a case takes seconds."""


def main() -> None:
    """The first seeds that fit and can be posed."""
    found: dict[str, Any] = {}
    seed = 0
    while len(found) < CASES:
        seed += 1
        count, rig = COUNTS[(seed - 1) % len(COUNTS)], drawn(seed)
        recordings = len(rig.postures) - 1
        small = recordings <= RECORDINGS and recordings * rig.rate * rig.seconds <= SAMPLES
        if not small or not 0 <= count <= EFFECTS:
            continue
        try:
            truth = hide(Sight(rig), count, np.random.default_rng([seed, 2]))
        except UnreachableError as error:
            print(seed, error)
            continue
        values = {name: float(value) for name, value in truth.values.items()}
        found[str(seed)] = {"hidden": list(truth.kinds), "values": values}
        print(seed, found[str(seed)], flush=True)
    TRUTH.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
