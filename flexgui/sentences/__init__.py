"""Sentences for readers, from the facts that `core` returns."""
