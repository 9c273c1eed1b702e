"""Where Open Image Denoise is, if a package of this Python has it."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from . import _native


def look_for_wheel() -> None:
    """Tells the native part where the package ``pyoidn`` is installed, if it is; nothing of it is imported."""
    spec = find_spec("pyoidn")
    if spec is not None and spec.origin is not None:
        _native.look_among(Path(spec.origin).parents[1])
