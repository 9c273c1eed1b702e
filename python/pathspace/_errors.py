"""What goes wrong. The sentences are those of the command line."""


class Error(Exception):
    """Every failure that pathspace foresees. A wrong type is a :class:`TypeError` instead."""


class UsageError(Error, ValueError):
    """Options or arrays that make no sense, by themselves or with this scene (the program's exit code 2)."""


class InputError(Error, OSError):
    """A file that cannot be read, or not be rendered (exit code 3)."""


class OutputError(Error, OSError):
    """A file that cannot be written (exit code 4)."""


class PathspaceWarning(UserWarning):
    """An image or a file is not what was asked for: what the program's ``warning:`` lines say."""
