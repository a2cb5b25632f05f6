"""The one way to say no to a message."""


class RefusedError(Exception):
    """A message that changes nothing; the text is for the log, or for the person if `tell`."""

    def __init__(self, why: str, *, tell: bool = False) -> None:
        super().__init__(why)
        self.tell = tell
