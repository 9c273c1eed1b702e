"""How far a render is, as an object and as a bar."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Optional, Union


@dataclass(frozen=True)
class Progress:
    """A moment of a render. What a callback raises ends the render, and comes out of the call that started it."""

    #: The part of the work that is done, from 0 to 1.
    fraction: float
    #: Samples per pixel so far.
    spp: int
    #: Seconds since the first pass began.
    seconds: float
    #: The relative mean square error as the two half images tell it, or None while they cannot.
    noise: Optional[float]
    #: All of this and the speed, as the command line shows it.
    line: str

    def __str__(self) -> str:
        return self.line


#: ``True`` for a bar on standard error, ``False`` for nothing, or a function of a :class:`Progress`.
Listener = Union[bool, Callable[[Progress], object]]

_WIDTH = 30


def listener(progress: Listener) -> Callable[[float, int, float, Optional[float], str], object] | None:
    """``progress`` as the native part calls it: at most twenty times a second, and at the end."""
    if progress is False:
        return None
    if progress is not True and not callable(progress):
        raise TypeError(f"progress is True, False or a function, not {progress!r}")
    hear: Callable[[Progress], object] = _bar if progress is True else progress
    return lambda *moment: hear(Progress(*moment))


def _bar(moment: Progress) -> None:
    done = round(_WIDTH * moment.fraction)
    end = "\n" if moment.fraction >= 1.0 else ""
    sys.stderr.write(f"\r[{'=' * done}{' ' * (_WIDTH - done)}] {moment.line}\x1b[K{end}")
    sys.stderr.flush()
