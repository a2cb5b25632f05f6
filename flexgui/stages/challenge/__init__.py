"""A hidden effect to be found."""
