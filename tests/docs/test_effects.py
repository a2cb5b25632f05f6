"""docs/effects.md shows each effect of the catalogue as it is."""

from __future__ import annotations

from docs.tools.gallery import PAGE, PICTURES, page
from flexgui.core.effects import catalogue

MOST_BYTES = 2_000_000


def test_the_page_is_fresh() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "run: python docs/tools/gallery.py"


def test_there_is_one_small_picture_of_each_effect() -> None:
    files = [path for path in PICTURES.iterdir() if path.suffix == ".svg"]
    assert {path.stem for path in files} == set(catalogue())
    assert sum(path.stat().st_size for path in files) < MOST_BYTES
