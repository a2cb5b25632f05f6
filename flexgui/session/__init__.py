"""One person's work: the scenario, the live model, recordings, the running job, the last result.

No viewer in here: the page and the tests drive the same `Session`.
"""
