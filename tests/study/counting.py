"""Work that takes no time, where only the book-keeping is tested."""

from __future__ import annotations

import json
import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.studies.study_run import kept

UNLUCKY, MORTAL = 13, 66
"""Fails; kills the process that works on it, as a system that is short of memory does."""


@dataclass(frozen=True)
class Number:
    """Stands for a case."""

    value: int
    mark: str = ""
    """A file; where it exists, a mortal number was tried before and does no harm."""

    @property
    def key(self) -> str:
        return f"n{self.value}"


def answer_text(order: str) -> str:
    return json.dumps(kept(Number(**json.loads(order)), squared))


def squared(case: Number) -> dict[str, Any]:
    if case.value == UNLUCKY:
        raise ValueError("unlucky")
    if case.value == MORTAL and not Path(case.mark).is_file():
        if case.mark:
            Path(case.mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return {"key": case.key, "square": case.value**2}


def slow_answer_text(order: str) -> str:
    """As the other, slowly enough to be interrupted."""
    time.sleep(0.2)
    return answer_text(order)
