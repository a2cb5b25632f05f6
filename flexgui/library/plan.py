"""The next experiments of a project: frozen, shown in notebooks, written as files to play."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from flexgui.core.experiments.design import Design, ParameterDeviation
from flexgui.core.experiments.design_files import references
from flexgui.core.recording.recording import Recording
from flexgui.export.export_files import seen_by
from flexgui.export.plan_files import SCENARIO, write_plan
from flexgui.library.shown import paragraphs
from flexgui.sentences.experiments import plan_paragraphs

if TYPE_CHECKING:
    import pandas as pd

    from flexgui.library.project import Project


@dataclass(frozen=True, repr=False)
class Plan:
    """Experiments within the rig's limits, and what they will decide."""

    project: Project
    _design: Design

    @property
    def words(self) -> tuple[str, ...]:
        """What to play and what it shows, a paragraph each."""
        return plan_paragraphs(self._design)

    @property
    def deviations(self) -> tuple[ParameterDeviation, ...]:
        """Of each parameter, before and after."""
        return self._design.deviations

    @property
    def decides(self) -> bool:
        """Whether the two effects that were asked about will be distinguished."""
        return self._design.decides

    @property
    def references(self) -> tuple[Recording, ...]:
        """What to play, one recording of references per experiment."""
        return tuple(references(c, self._design) for c in self._design.chosen)

    def to_dataframe(self) -> pd.DataFrame:
        """Tabulate the deviations, a row per parameter, SI units."""
        rows = [
            (d.estimate.name, d.estimate.value, d.before, d.after, d.estimate.unit)
            for d in self.deviations
        ]
        return pd.DataFrame(rows, columns=["parameter", "value", "before", "after", "unit"])

    def export(self, folder: str | Path) -> Path:
        """Write references to play, what to expect, and a scenario that reads the recordings back.

        Args:
            folder: Made where it is missing.

        Returns:
            The path of the scenario.
        """
        out, p = Path(folder), self.project
        write_plan(p.scenario, self._design, out, seen_by(out, p.folder, p.data))
        return out / SCENARIO

    def __repr__(self) -> str:
        return "\n".join(self.words)

    def _repr_html_(self) -> str:
        return str(paragraphs(self.words))
