"""Faults of recordings, found before anything is fitted: evidence, size, channel, mend."""
