"""Diagnose: find missing effects."""
