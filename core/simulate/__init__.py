"""Simulation: the compiled non-linear simulator and the fast response of the linear model."""
