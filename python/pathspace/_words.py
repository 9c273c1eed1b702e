"""Keyword arguments become the words of the command line, which reads and checks them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from operator import index
from functools import lru_cache
from numbers import Real
from typing import Any

import numpy as np

from . import _native
from ._errors import UsageError

#: Options that say where a program writes or what it shows. From Python, these are methods and arguments.
_OF_THE_PROGRAM = frozenset(
    ["help", "output", "exposure", "tone", "white-balance", "progress", "display", "stats", "checkpoint"]
    + ["checkpoint-every", "shard", "frames", "fps", "quiet", "verbose", "json"]
)
#: Options that reading a scene takes; all others of ``render`` are for :meth:`Scene.render`.
_OF_FILES = frozenset("scene variant at animation limit allow-outside ignore-required drafts".split())


@lru_cache(maxsize=None)
def options(command: str) -> Mapping[str, bool]:
    """The keywords of a command, and whether each takes a value."""
    return {name: takes for name, takes in _all(command).items() if name.replace("_", "-") not in _OF_THE_PROGRAM}


@lru_cache(maxsize=None)
def _all(command: str) -> Mapping[str, bool]:
    """The same of the program's own as well."""
    return {name.replace("-", "_"): takes for name, takes, _ in _native.options(command)}


def load_options() -> frozenset[str]:
    """The keywords of :func:`pathspace.load`."""
    return frozenset(name.replace("-", "_") for name in _OF_FILES)


def render_options() -> frozenset[str]:
    """The keywords of :meth:`pathspace.Scene.render` that are options of the command line."""
    return frozenset(options("render")) - load_options()


def file_words(path: str | os.PathLike[str]) -> list[str]:
    """The name of a file as a word that is no option."""
    name = os.fsdecode(path)
    return [os.path.join(os.curdir, name) if name.startswith("-") else name]


def words(function: str, command: str, allowed: Iterable[str], given: Mapping[str, Any]) -> list[str]:
    """``given`` as words of ``command``: ``{"spp": 4}`` is ``["--spp=4"]``.

    Raises TypeError for a keyword that is not among ``allowed``, and for a value that no option is made of.
    """
    allowed = frozenset(allowed)
    takes_value = _all(command)
    result: list[str] = []
    for name, value in given.items():
        if name not in allowed:
            raise TypeError(f"{function}() got an unexpected keyword argument '{name}'")
        option = "--" + name.replace("_", "-")
        if value is None or (isinstance(value, (list, tuple, Mapping)) and not value):
            continue
        if not takes_value[name]:
            if not isinstance(value, (bool, np.bool_)):
                raise TypeError(f"{name} is True or False, not {value!r}")
            result += [option] if value else []
        elif isinstance(value, Mapping):
            result += [f"{option}={key}={_text(name, one)}" for key, one in value.items()]
        else:
            result.append(f"{option}={_text(name, value)}")
    return result


def whole(what: str, value: object) -> int:
    """A whole number from 0 to 2³² − 1. Raises TypeError for what is no integer."""
    if isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{what} is a whole number, not {value!r}")
    try:
        number = index(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{what} is a whole number, not {value!r}") from None
    if not 0 <= number < 1 << 32:
        raise UsageError(f"{what} is at least 0 and below 2³², not {number}")
    return number


#: The most numbers that an option takes as an array: more are an image or a mesh.
_MOST = 16


def _text(name: str, value: object) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return os.fsdecode(value)
    if isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} has a value, which is not {value!r}")
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (Real, np.floating)):
        return repr(float(value))
    if isinstance(value, Iterable) and not isinstance(value, (bytes, bytearray, np.ndarray)):
        return ",".join(_text(name, one) for one in value)
    if isinstance(value, np.ndarray) and value.ndim == 1 and value.size <= _MOST:
        return ",".join(_text(name, one) for one in value)
    raise TypeError(f"{name} is a string, a number or a sequence of them, not {value!r}")
