"""The command line program: ``pathspace`` and ``python -m pathspace``."""

from __future__ import annotations

import signal
import sys

from . import _native
from ._oidn import look_for_wheel


def main() -> None:
    """Runs the program with ``sys.argv`` and ends with its exit code (``pathspace --help`` lists them)."""
    # The program watches signals itself, and finishes the pass; Python's handler would add a KeyboardInterrupt.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    look_for_wheel()
    sys.exit(_native.main(["pathspace", *sys.argv[1:]]))
