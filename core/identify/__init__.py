"""Identification: from recordings to parameters with their uncertainty."""
