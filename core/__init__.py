"""The physics and the mathematics of flexible robot arms, with no user interface in it."""
