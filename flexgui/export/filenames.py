"""File names from names that people gave."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence

LONGEST = 80


def slug(name: str) -> str:
    """Letters, digits, '.', '_' and '-' only, so that any file system takes it."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9._-]+", "_", plain).strip("._-")[:LONGEST] or "unnamed"


def unique_slugs(names: Sequence[str]) -> list[str]:
    """A slug for each name, numbered where two meet (capitals do not tell files apart)."""
    taken: set[str] = set()
    slugs = []
    for name in names:
        base = candidate = slug(name)
        number = 2
        while candidate.lower() in taken:
            candidate = f"{base}_{number}"
            number += 1
        taken.add(candidate.lower())
        slugs.append(candidate)
    return slugs
