"""What the model lacks."""
