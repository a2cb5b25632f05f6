"""Tables and figures of a Monte Carlo study, as pure functions of its summary."""
