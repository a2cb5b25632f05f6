"""The next experiment: what to play on the rig, within its limits, and what that will decide."""
