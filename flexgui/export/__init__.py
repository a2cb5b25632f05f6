"""Outcome -> a folder with a report, `result.json`, tables and the model."""

from flexgui.export.folder import check_writable
from flexgui.export.outcome import export_outcome

__all__ = ["check_writable", "export_outcome"]
