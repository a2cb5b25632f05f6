"""Models with effects, fitted: the one estimator of diagnoses, laws and experiments."""
