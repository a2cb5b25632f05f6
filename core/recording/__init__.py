"""Recordings: reading, checking, converting to SI, writing."""
