"""Challenges for people: recordings in which effects of a chosen size are hidden."""
