"""The one error that a user is meant to read."""


class InputError(ValueError):
    """Wrong input. The sentence names the file, column or setting and what to do.

    It is shown without a traceback.
    """
