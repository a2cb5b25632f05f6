"""The noise of what is compared: from which source, how it reaches the outputs, and its colour."""
