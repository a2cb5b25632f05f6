"""Monte Carlo study of the paper: estimates, validation, baselines and experiment advice."""
