"""What of a session can change; a subscriber hears the topic and reads the session."""

from enum import Enum


class Topic(Enum):
    """One part of a session's state."""

    SCENARIO = "scenario"
    LIVE = "live"
    """The model of the sliders was computed anew."""
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
