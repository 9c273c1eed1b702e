"""Scenes: what is rendered."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Union

from . import _native
from ._image import Image
from ._progress import Listener, listener
from ._words import file_words, load_options, render_options, words

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import LoadOptions, RenderOptions


def load(path: Union[str, os.PathLike[str]], **options: Unpack[LoadOptions]) -> Scene:
    """Reads a glTF 2.0 scene, .gltf or .glb.

    The keywords are those options of ``pathspace render`` that reading takes: ``scene``, ``variant``, ``limit`` (a
    dict), ``allow_outside`` and ``ignore_required``. What the file asks for and does not get is a
    :class:`pathspace.PathspaceWarning`.

    Raises :class:`pathspace.InputError` if there is no such file, or it cannot be rendered, and
    :class:`pathspace.UsageError` for a scene or variant that it does not have.
    """
    return Scene._of(_native.Scene.load(file_words(path) + words("load", "render", load_options(), options)))


class Scene:
    """A scene, which any number of threads may render at once."""

    _native: _native.Scene

    @classmethod
    def _of(cls, native: _native.Scene) -> Scene:
        scene = cls.__new__(cls)
        scene._native = native
        return scene

    @property
    def hash(self) -> str:
        """SHA-256 of all bytes that were read, in hexadecimal: ``header["scene"]`` of its images."""
        return self._native.hash

    @property
    def cameras(self) -> Sequence[str]:
        """The names of its cameras, for ``render(camera=…)``."""
        return self._native.cameras

    @property
    def materials(self) -> Sequence[str]:
        """The names of its materials."""
        return self._native.materials

    @property
    def warnings(self) -> Sequence[str]:
        """What its file asks for and does not get."""
        return self._native.warnings

    @property
    def triangles(self) -> int:
        """The number of its triangles, those of instances counted as often as they are there."""
        return self._native.triangles

    def render(self, *, progress: Listener = False, **options: Unpack[RenderOptions]) -> Image:
        """Renders the scene, and returns the image that ``pathspace render`` makes with the same options, to the bit.

        The keywords are the options of the command line, with ``_`` for ``-`` and the same defaults:
        ``render(integrator="bdpt", spp=64, width=512, layers=["classes"])``. An option that is True is given; a
        sequence is joined by commas (``look_at=(0, 1, 4, 0, 1, 0)``), a dict becomes several options
        (``layer={"caustics": "C.*[DG]S+L"}``), a number of seconds is a time. ``pathspace.options()`` lists them, and
        docs/options.md explains them. Files come from :meth:`Image.save` instead of ``output``; checkpoints and
        shards are for the command line, but ``resume`` goes on from one.

        ``progress`` is True for a bar, or a function of a :class:`pathspace.Progress`. The interpreter's lock is
        released while rays are traced, and Ctrl-C ends the render after the pass that it comes in.

        Raises :class:`pathspace.UsageError` with the sentence of the command line for options that make no sense,
        :class:`pathspace.InputError` for files that cannot be read, and TypeError for keywords that are no options.
        """
        given = words("render", "render", render_options(), options)
        return Image(_native.render(self._native, given, listener(progress)))

    def __repr__(self) -> str:
        return f"<Scene of {self.triangles} triangles, {len(self.cameras)} cameras, {self.hash[:12]}>"
