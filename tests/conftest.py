"""Settings for all tests."""

from hypothesis import settings

# The first call compiles, which no deadline per example allows for; the same examples each time.
settings.register_profile("flexgui", deadline=None, derandomize=True)
settings.load_profile("flexgui")
