"""Recordings: brought, simulated, checked."""
