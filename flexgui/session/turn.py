"""Whose turn it is to compute or draw for a slider.

Python runs one thread at a time. Thirty sessions that take turns of some milliseconds are each
served sooner than thirty that are interrupted by one another all the time.
"""

from __future__ import annotations

import threading

TURN = threading.Semaphore(1)
"""Held for some milliseconds; never while compiling, reading a file or waiting for a browser."""
