"""Exceptions, with the messages that the program gives."""


class Error(Exception):
    """Anything that trimray refuses or fails at."""


class SceneError(Error, ValueError):
    """A scene or a file that it names is wrong; one line for each fault, all faults at once."""


class InputError(Error, ValueError):
    """Other input is wrong."""


class OutputError(Error, OSError):
    """A file cannot be written."""


class OutOfMemoryError(Error, MemoryError):
    """The work would need more memory than there is; it was not begun."""


class WorkError(Error, RuntimeError):
    """The work failed otherwise."""


class SceneWarning(UserWarning):
    """Something about a scene may not be as its author meant it."""
