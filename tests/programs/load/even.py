"""The command whose workers are not nice, and load nothing before their first job.

`python -m tests.programs.load.even serve …`

A worker steps back behind everything else on the machine, so that the page answers first. Where
other programs keep every core busy it gets a twentieth of one, and what a test waits for then
depends on who else is at work. Warming up takes seconds of a processor, which servers that are
given no job would spend for nothing; the others spend them on their first one.
"""

from __future__ import annotations

from flexgui.cli import main
from flexgui.jobs import file_jobs, messages

if __name__ == "__main__":
    for each in (messages.DEFAULT, file_jobs.SETTINGS):
        object.__setattr__(each, "niceness", 0)
        object.__setattr__(each, "warm_up", None)
    main()
