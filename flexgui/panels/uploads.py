"""What files a person may bring, in words."""

from __future__ import annotations

from flexgui.session import Services

MEGA = 1e6


def upload_hint(services: Services) -> str:
    """For the buttons that take a file."""
    limit = services.upload_limit_bytes / MEGA
    return (
        f"CSV, Parquet, MAT, HDF5, TDMS, MDF4, MCAP, ROS 2 db3 or NPZ, several at once; or a "
        f"scenario (TOML, or its zip). At most {limit:.0f} MB each."
    )
