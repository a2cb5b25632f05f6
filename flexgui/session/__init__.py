"""One person's work: the scenario, the live model, recordings, the running job, the last result.

No viewer in here: the page and the tests drive the same `Session`.
"""

from flexgui.session.session import Session
from flexgui.session.state import Services, Topic

__all__ = ["Services", "Session", "Topic"]
