"""Where the program's lines go: warnings to :mod:`warnings`, the rest to :mod:`logging`."""

from __future__ import annotations

import logging
import sys
import warnings

from ._errors import PathspaceWarning

_PREFIX = "warning: "
_log = logging.getLogger("pathspace")


def _caller() -> int:
    """How many frames up the first is that is not of this package, counted from the one that asks."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__package__") == __package__:
        level, frame = level + 1, frame.f_back
    return level


def heard(lines: list[str]) -> None:
    """Passes on what the native part has said, before the call that made it say so returns."""
    for line in lines:
        if line.startswith(_PREFIX):
            warnings.warn(line[len(_PREFIX) :], PathspaceWarning, stacklevel=_caller())
        else:
            _log.info("%s", line)
