"""Challenges for a class: hidden effects, the board, hand-ins and their grades."""
