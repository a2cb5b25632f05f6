"""The one error that a user is meant to read."""


class InputError(ValueError):
    """Bad input, said in one sentence.

    The sentence names the file, the column or the setting that is wrong and says what to do.
    Whoever meets this error shows its text and nothing else: no traceback.
    """
