"""Images: what a render makes."""

from __future__ import annotations

import os
import tempfile
import webbrowser
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Optional, Union

import numpy as np

from . import _native
from ._oidn import look_for_wheel
from ._options import Look
from ._progress import notebook_display
from ._words import words

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from numpy.typing import NDArray

#: The keywords that say how a .png file looks.
_LOOK = frozenset(Look.__annotations__)


class Image:
    """An image with its layers, halves and header, as :meth:`pathspace.Scene.render` returns it.

    Arrays have the shape (height, width, 3) and type float32; row 0 is the top one. They are read-only: copy them to
    change them. Values are linear radiances in the
    units of the scene's lights, with the primaries of Rec. 709. With ``crop``, only its pixels are there.
    """

    def __init__(self, native: _native.Picture) -> None:
        self._native = native

    @property
    def height(self) -> int:
        """Rows."""
        return self._native.shape[0]

    @property
    def width(self) -> int:
        """Columns."""
        return self._native.shape[1]

    @property
    def crop(self) -> tuple[int, int, int, int]:
        """x0, y0, x1, y1: which pixels x0 ≤ x < x1, y0 ≤ y < y1 of the whole image these are."""
        return self._native.crop

    @cached_property
    def rgb(self) -> NDArray[np.float32]:
        """The image, (height, width, 3) float32: bit by bit what :meth:`save` writes to an .exr file."""
        return self._colours(self._native.rgb())

    @cached_property
    def alpha(self) -> Optional[NDArray[np.float32]]:
        """With ``transparent=True`` the coverage in [0, 1], (height, width) float32; else None. ``rgb`` is
        premultiplied by it."""
        alpha = self._native.alpha()
        return None if alpha is None else np.frombuffer(alpha, np.float32).reshape(self._native.shape)

    @cached_property
    def layers(self) -> Mapping[str, NDArray[np.float32]]:
        """The layers of ``layers`` and ``layer`` by their names, (height, width, 3) float32 each."""
        return {name: self._colours(pixels) for name, pixels in self._native.layers()}

    @cached_property
    def data(self) -> Mapping[str, NDArray[np.float32] | NDArray[np.uint32]]:
        """The channels of ``data`` by their names in the .exr file, such as ``depth.Z`` (metres) or ``id.material``;
        (height, width) float32, or uint32 for numbers of things."""
        channels = self._native.data()
        return {name: np.frombuffer(all, kind).reshape(self._native.shape) for name, kind, all in channels}

    @cached_property
    def halves(self) -> Optional[tuple[NDArray[np.float32], NDArray[np.float32]]]:
        """The images of the even and of the odd samples, which are independent unless the sampler is ``sobol``; None of
        fewer than two samples per pixel."""
        halves = self._native.halves()
        return None if halves is None else (self._colours(halves[0]), self._colours(halves[1]))

    @cached_property
    def variance(self) -> Optional[NDArray[np.float32]]:
        """The variance of ``rgb`` per pixel and channel as the halves tell it, ((even − odd)/2)², in squared units of
        ``rgb``; None of fewer than two samples per pixel. One pixel's is as noisy as its image: average over many."""
        variance = self._native.variance()
        return None if variance is None else self._colours(variance)

    @cached_property
    def header(self) -> Mapping[str, str]:
        """Everything that changes pixels and how many samples there are: the attributes ``pathspace.NAME`` of the
        .exr file by NAME. The integrator is ``header["integrator"]``."""
        return dict(self._native.header)

    @property
    def spp(self) -> int:
        """Samples per pixel."""
        return int(self.header["spp"])

    @property
    def seconds(self) -> float:
        """The time that the passes took, in seconds."""
        return self._native.seconds

    @property
    def statistics(self) -> Mapping[str, int]:
        """How many samples were taken, and how many rays of each kind were traced."""
        names = ("samples", "camera_rays", "light_rays", "visibility_rays")
        return dict(zip(names, self._native.statistics))

    def save(self, path: Union[str, os.PathLike[str]], **look: Unpack[Look]) -> None:
        """Writes the file that ``pathspace render`` writes for the same settings, to the byte.

        An .exr file holds everything, without loss. How a .png file shows the image, the options of the command line
        say: ``exposure`` (radiances times 2^``exposure``; automatic if None), ``tone`` ("none", "filmic" or "agx") and
        ``white_balance`` (kelvin). Raises :class:`pathspace.UsageError` for other names, and
        :class:`pathspace.OutputError` where nothing can be written.
        """
        self._native.write(os.fspath(path), words("save", "render", _LOOK, look))

    def encode(self, format: str, **look: Unpack[Look]) -> bytes:
        """The bytes of that file, for ``format`` "exr" or "png"."""
        return self._native.encode(format, words("encode", "render", _LOOK, look))

    def denoise(self, oidn: Union[str, os.PathLike[str], None] = None) -> Image:
        """The image without its noise, by Open Image Denoise: to look at, not to measure, as the result is biased.

        Albedo and normals guide the filter if the image was rendered with ``data=["albedo", "normals"]``; without them
        it is a :class:`pathspace.PathspaceWarning` that colours alone do. ``layers["noisy"]`` of the new image is this
        one's ``rgb``, and ``header["denoised"]`` says by what it was denoised. Everything else, halves and variance
        included, is that of the image as rendered.

        ``oidn`` is the library or its folder; without it, the one that the environment variable ``OIDN_LIBRARY`` names,
        the system's, or the one of the package ``pyoidn``. Raises :class:`pathspace.UsageError` if there is none, and
        for an image that is denoised already.
        """
        look_for_wheel()
        return Image(self._native.denoise(oidn))

    def show(self, **look: Unpack[Look]) -> None:
        """Shows the image, as :meth:`save` would: in a notebook as its output, elsewhere in whatever opens .png
        files."""
        png = self.encode("png", **look)
        display = notebook_display()
        if display is not None:
            display({"image/png": png, "text/plain": repr(self)}, raw=True)
            return
        with tempfile.NamedTemporaryFile(prefix="pathspace-", suffix=".png", delete=False) as file:
            file.write(png)
        webbrowser.open(FilePath(file.name).as_uri())

    def _repr_png_(self) -> bytes:
        return self.encode("png")

    def __repr__(self) -> str:
        return f"<Image {self.width}×{self.height}, {self.header['integrator']}, {self.spp} spp>"

    def _colours(self, pixels: bytes) -> NDArray[np.float32]:
        return np.frombuffer(pixels, np.float32).reshape(*self._native.shape, 3)
