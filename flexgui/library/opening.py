"""A result that was saved, in a later process."""

from __future__ import annotations

from pathlib import Path

from flexgui.export.saved_run import read_run
from flexgui.library.diagnosis import Diagnosis
from flexgui.library.identification import Identification
from flexgui.library.project import Project
from flexgui.library.stated_project import folder_of_tables


def open(folder: str | Path) -> Identification | Diagnosis:  # noqa: A001
    """Open a result that `save` or an export has written; nothing is computed again.

    Args:
        folder: That of `save`, of `flexgui export` or of a report from the page, unpacked.

    Returns:
        The result as it was, with its project. Its recordings are sought where they were, seen from
        the folder, or in it; only new computations and the moving arm of a report need them.

    Raises:
        InputError: Where there is no saved result, or another version of FlexGUI wrote it.
    """
    run = read_run(Path(folder))
    source, kept = run.source(Path(folder)), None
    home = run.places(Path(folder))[0]
    if source.tables:
        kept = folder_of_tables({path.name: path.read_bytes() for path in source.tables})
        home = Path(kept.name)
    project = Project(run.scenario, home, source.data, kept, (run.scenario, run.text))
    kind = Identification if run.outcome.diagnosis is None else Diagnosis
    return kind(project, run.outcome)
