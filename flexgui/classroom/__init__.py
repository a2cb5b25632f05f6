"""Challenges for a class: hidden effects and the board."""
