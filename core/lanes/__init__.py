"""Arithmetic on LANES numbers at once, for compiled code that runs several systems side by side."""
