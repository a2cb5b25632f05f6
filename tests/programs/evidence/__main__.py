"""`python -m tests.programs.evidence [PART ...]` runs parts and writes docs/evidence.md."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from flexgui.core.files import replacing
from tests.programs.evidence.frame import JOURNAL, PAGE, PICTURES, page, parts, pictures, run


def main() -> int:
    """2 for a part that does not exist."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    ask = argparse.ArgumentParser(prog="python -m tests.programs.evidence", description=__doc__)
    ask.add_argument("parts", nargs="*", help=f"of {', '.join(parts())}; all by default")
    ask.add_argument("--data", default=os.environ.get("FLEXGUI_DATA"), type=Path)
    ask.add_argument("--journal", default=JOURNAL, type=Path)
    ask.add_argument("--out", default=PAGE, type=Path)
    ask.add_argument("--workers", default=2, type=int)
    ask.add_argument("--write-only", action="store_true", help="the page of what is known")
    given = ask.parse_args()
    wrong = [name for name in given.parts if name not in parts()]
    if wrong:
        print(f"{wrong[0]} is no part; they are {', '.join(parts())}.", file=sys.stderr)
        return 2
    if not given.write_only:
        run(given.parts or list(parts()), given.data, given.journal, given.workers)
    for name, drawing in pictures(given.journal).items():
        _write(given.out.parent / PICTURES / name, drawing)
    before = given.out.read_text(encoding="utf-8") if given.out.exists() else ""
    _write(given.out, page(given.data, given.journal, before))
    print(f"Written: {given.out}")
    return 0


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    sys.exit(main())
