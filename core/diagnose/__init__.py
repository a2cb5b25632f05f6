"""From what a model misses to the physical effect that is missing."""
