"""Small state records of a session, the topics that notify of changes, and which parts of the page
are outdated by a fault. Subscribers get a topic and read the session."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum

WORK_STAGES = ("Arm", "Data", "Identify", "Compare", "Diagnose", "Export")
"""The main stages, in order."""
STAGES = (*WORK_STAGES, "Study", "Challenge")
"""With the two stages beside them."""


BUSY = "A computation is running; stop it or wait."


@dataclass(frozen=True)
class LiveSettings:
    """Slider values that are not part of a scenario."""

    theta2: float = math.pi / 3.0
    """rad, the working point of the live model."""
    exaggeration: float = 10.0
    """How much larger the deflection is drawn."""
    snr_db: float | None = 20.0
    """Signal-to-noise ratio of what is simulated; None: no noise."""
    mode: int | None = None
    """The bending mode that is played, from 0."""


@dataclass(frozen=True)
class Cursor:
    """The cursor of the time-line, for plots and arm."""

    recording: str = ""
    time: float = 0.0
    """s from the recording's first sample."""
    playing: bool = False
    speed: float = 1.0
    error: float = 1.0
    """How many times farther from the model the measured arm is drawn."""


@dataclass(frozen=True)
class Message:
    """A sentence for the person; only the newest is shown."""

    text: str
    bad: bool = False
    number: int = 0


class Topic(Enum):
    """One part of a session's state."""

    SCENARIO = "scenario"
    LIVE = "live"
    """The model of the sliders was computed again."""
    STAGE = "stage"
    """Another stage of the work is shown."""
    RECORDINGS = "recordings"
    RUN = "run"
    OUTCOME = "outcome"
    DIAGNOSIS = "diagnosis"
    """What could be missing, and what was added."""
    DEMONSTRATION = "demonstration"
    """What one effect would do."""
    CHALLENGE = "challenge"
    STUDY = "study"
    """The Monte Carlo study: its settings, how it stands, what it has found."""
    TOUR = "tour"
    KEPT = "kept"
    """Earlier work is offered, or no longer."""
    CURSOR = "cursor"
    MESSAGE = "message"


class PagePart(Enum):
    """Parts of the page that are updated separately, named for messages."""

    MODEL = "the model of the sliders"
    PLAYBACK = "the playback"
    CURSOR = "the cursor"
    RESULT = "the result"
    CHECK = "the check of the recordings"
    STUDY = "the study's tables and plots"
    PAGE = "the page"
    FRAME = "stages, message and tour"
    ARM = "the arm"
    PLOTS = "plots and tables"
    LATE_PLOTS = "plots that take long"
    INPUTS = "the inputs"


Subscriber = Callable[[Topic], None]
log = logging.getLogger(__name__)
INTERNAL_FAULT = "a fault of FlexGUI, not of what you did; its log has the details"


class Faults:
    """The parts that an internal fault kept from being updated: they show an older state."""

    def __init__(self, changed: Callable[[], None]) -> None:
        self.outdated: frozenset[PagePart] = frozenset()
        self.closed = False
        """Whether the page is gone, so that a failure does not matter."""
        self._changed = changed
        self._lock = threading.Lock()

    @contextmanager
    def watch(self, part: PagePart) -> Iterator[None]:
        """Catches every error inside: the part is outdated until the block succeeds."""
        try:
            yield
        except Exception:
            self.fail(part)
        else:
            self._note(part, failed=False)

    def fail(self, part: PagePart) -> None:
        """Called in an `except`: marks the part as outdated."""
        level = logging.DEBUG if self.closed or part in self.outdated else logging.ERROR
        log.log(level, "%s: failed", part.value, exc_info=True)
        self._note(part, failed=True)

    def _note(self, part: PagePart, failed: bool) -> None:
        with self._lock:
            changed = failed != (part in self.outdated)
            self.outdated = self.outdated | {part} if failed else self.outdated - {part}
        if changed:
            self._changed()
