"""The arm of the sliders."""
