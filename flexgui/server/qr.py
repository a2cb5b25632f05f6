"""An address as a picture in the terminal."""

from __future__ import annotations

import io


def qr_text(address: str) -> str:
    """A QR code of half blocks, light on dark, for a terminal that can show them."""
    import segno

    out = io.StringIO()
    segno.make(address, error="m", micro=False).terminal(out, compact=True, border=2)
    return out.getvalue().rstrip("\n")
