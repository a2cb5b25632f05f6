"""The workbench around `core`: command line, report and page."""

__version__ = "0.1.0"
