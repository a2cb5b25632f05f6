"""The arm: its geometry, its shape functions and its symbolic statement."""
