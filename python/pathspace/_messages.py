"""Where the program's lines go: warnings to :mod:`warnings`, the rest to :mod:`logging`."""

from __future__ import annotations

import logging
import warnings

from ._errors import PathspaceWarning

_PREFIX = "warning: "
_log = logging.getLogger("pathspace")


def heard(lines: list[str]) -> None:
    """Passes on what the native part has said, before the call that made it say so returns."""
    for line in lines:
        if line.startswith(_PREFIX):
            # This function, that of the package, and then who called it.
            warnings.warn(line[len(_PREFIX) :], PathspaceWarning, stacklevel=3)
        else:
            _log.info("%s", line)
