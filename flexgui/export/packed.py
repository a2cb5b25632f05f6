"""Text that travels compressed in a page and is unpacked by the browser: a third of its size."""

from __future__ import annotations

import base64
import gzip
from functools import cache

from markupsafe import Markup
from plotly.offline import get_plotlyjs


def packed(text: str) -> Markup:
    """gzip in base64, safe inside a script element; the same text gives the same bytes."""
    return Markup(base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode("ascii"))


@cache
def packed_plotly() -> Markup:
    """plotly.js; `unpack` of report.js runs it."""
    return packed(get_plotlyjs())
