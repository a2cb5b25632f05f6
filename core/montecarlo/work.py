"""One case of a study as text in, text out: nothing else travels to a worker."""

from __future__ import annotations

import json
import time
from typing import Any

from core.identify.predictor import single_threaded
from core.montecarlo.part import Case, Part
from core.montecarlo.rig import rig_of
from core.montecarlo.settings import StudySettings
from core.plugins import discover

FOLDER = "core.montecarlo.parts"


def parts() -> dict[str, Part]:
    """kind -> part, in their order."""
    found: dict[str, Part] = discover(FOLDER, Part).members
    return dict(sorted(found.items(), key=lambda pair: pair[1].order))


def order_text(settings: StudySettings, case: Case) -> str:
    """What a worker is sent."""
    order = {"settings": settings.model_dump_json(), "part": case.part, "key": case.key}
    return json.dumps({**order, "options": dict(case.options)})


def answer_text(order: str) -> str:
    """The record of one case: `answer` is what it found, `seconds` what it took."""
    said: dict[str, Any] = json.loads(order)
    begun = time.perf_counter()
    with single_threaded():
        answer = parts()[said["part"]].run(rig_of(said["settings"]), said["options"])
    seconds = time.perf_counter() - begun
    record = {"key": said["key"], "part": said["part"], "answer": answer, "seconds": seconds}
    return json.dumps(record, allow_nan=False)
