"""Scenarios: the one description of a piece of work that page and command line share."""
