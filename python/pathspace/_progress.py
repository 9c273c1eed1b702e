"""How far a render or report is, as an object, as a bar, and in a notebook as a picture that grows."""

from __future__ import annotations

import html
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Optional, Union


@dataclass(frozen=True)
class Progress:
    """A moment of a render. What a callback raises ends the render, and comes out of the call that started it."""

    #: The part of the work that is done, from 0 to 1. While a pilot chooses an integrator, it is 0.
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


#: ``True`` for a bar on standard error, and in a notebook below the cell, with the picture as it comes; ``False`` or
#: None for nothing; or a function of a :class:`Progress`.
Listener = Union[bool, Callable[[Progress], object], None]
#: The same for a report: a function hears the part that is done, in [0, 1], and what is being done. What it raises ends
#: the report.
Hear = Union[bool, Callable[[float, str], object], None]

_WIDTH = 30


def listener(progress: Listener) -> tuple[Optional[Callable[..., object]], bool]:
    """``progress`` as the native part calls it, at most twenty times a second and at the end; and whether it wants to
    see pictures."""
    hear = _callable(progress)
    if hear is True:
        bar = _bar()
        return (lambda fraction, _spp, _seconds, _noise, line, png: bar.show(fraction, line, png)), bar.is_live
    if hear is None:
        return None, False
    return (lambda *moment: hear(Progress(*moment[:5]))), False


def reader(progress: Hear) -> Optional[Callable[[float, str], object]]:
    """The same for a report."""
    hear: Optional[Callable[[float, str], object]] = _callable(progress)
    if progress is True:
        bar = _bar()
        return lambda fraction, what: bar.show(fraction, f"{what}, {100 * fraction:.0f} %", None)
    return hear


def _callable(progress: Any) -> Any:
    if progress is None or progress is False:
        return None
    if progress is not True and not callable(progress):
        raise TypeError(f"progress is True, False or a function, not {progress!r}")
    return progress


class _Line:
    """A bar in a line of standard error."""

    is_live = False

    def show(self, fraction: float, line: str, _png: Optional[bytes]) -> None:
        done = round(_WIDTH * fraction)
        end = "\n" if fraction >= 1.0 else ""
        sys.stderr.write(f"\r[{'=' * done}{' ' * (_WIDTH - done)}] {line}\x1b[K{end}")
        sys.stderr.flush()


class _Cell:
    """A bar below the cell of a notebook, and a picture until the call returns the image."""

    is_live = True

    def __init__(self, display: Callable[..., Any]) -> None:
        self._display = display
        self._bar: Any = None
        self._picture: Any = None

    def show(self, fraction: float, line: str, png: Optional[bytes]) -> None:
        bar = f'<progress max="1" value="{fraction:.4f}"></progress> {html.escape(line)}'
        self._bar = self._shown(self._bar, {"text/html": bar, "text/plain": line})
        if png is not None:
            self._picture = self._shown(self._picture, {"image/png": png, "text/plain": "the image so far"})
        elif fraction >= 1.0 and self._picture is not None:
            self._shown(self._picture, {"text/plain": ""})

    def _shown(self, handle: Any, data: dict[str, object]) -> Any:
        if handle is None:
            return self._display(data, raw=True, display_id=True)
        handle.update(data, raw=True)
        return handle


def _bar() -> Union[_Line, _Cell]:
    display = notebook_display()
    return _Line() if display is None else _Cell(display)


def notebook_display() -> Optional[Callable[..., Any]]:
    """IPython's ``display`` where it shows pictures: in a notebook."""
    if "IPython" not in sys.modules:
        return None
    from IPython import get_ipython
    from IPython.display import display

    shell: Any = get_ipython()  # type: ignore[no-untyped-call, unused-ignore]
    return display if hasattr(shell, "kernel") else None
