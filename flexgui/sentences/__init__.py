"""What a reader is told, word for word, from the facts that `core` returns."""
