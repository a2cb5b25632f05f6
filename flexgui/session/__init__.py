"""One person's work: the scenario, the live model, recordings, the running job, the last result.

It needs no page: the page and the tests use the same `Session`.
"""
