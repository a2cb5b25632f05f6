"""Outcome -> a folder with a report, `result.json`, tables and the model."""
