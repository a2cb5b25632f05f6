"""Challenges: find a hidden effect."""
