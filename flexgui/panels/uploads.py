"""What files a person may bring, in words."""

from __future__ import annotations

from flexgui.session import Services

MEGA = 1e6


def upload_hint(services: Services) -> str:
    """For the buttons that take a file."""
    limit = services.upload_limit_bytes / MEGA
    return f"CSV, CSV.gz, Parquet or MAT; or a scenario (TOML, or its zip). At most {limit:.0f} MB."
