"""The benchmark from the command line: `python -m tests.programs.bench [--quick]`."""

from __future__ import annotations

import sys

from tests.programs.bench import main

if __name__ == "__main__":
    sys.exit(main(quick="--quick" in sys.argv[1:]))
