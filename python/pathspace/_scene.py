"""Scenes: what is rendered."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Optional, Union

from . import _native
from ._build import Camera, Lamp, Mesh, glb, vector
from ._errors import InputError, OutputError, UsageError
from ._image import Image
from ._oidn import look_for_wheel
from ._options import PathOptions, ViewOptions
from ._paths import Path, Settings
from ._progress import Listener, listener
from ._words import file_words, load_options, render_options, whole, words

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from numpy.typing import ArrayLike

    from ._options import LoadOptions, RenderOptions


def load(path: Union[str, os.PathLike[str]], **options: Unpack[LoadOptions]) -> Scene:
    """Reads a glTF 2.0 scene, .gltf or .glb.

    The keywords are those options of ``pathspace render`` that reading takes: ``scene``, ``variant``, ``at``
    (seconds), ``animation``, ``limit`` (a dict), ``allow_outside``, ``ignore_required`` and ``drafts``. What the file
    asks for and does not get is a :class:`pathspace.PathspaceWarning`.

    Raises :class:`pathspace.InputError` if there is no such file, or it cannot be rendered, and
    :class:`pathspace.UsageError` for a scene, variant or animation that it does not have.
    """
    return Scene._of(_native.Scene.load(file_words(path) + words("load", "render", load_options(), options)))


class Scene:
    """A scene, which any number of threads may render at once.

    ``Scene(meshes, lamps=…, camera=…)`` makes one of arrays: it writes the glTF file that they describe and reads it,
    so that everything docs/gltf.md says holds, and :meth:`save` keeps the file for the command line. Without a
    camera, one frames the whole scene; without any light, light of radiance 1 comes from everywhere.

    Raises :class:`pathspace.UsageError` for arrays of a wrong shape, with numbers that are not finite, or with indices
    of vertices that are not there.
    """

    _loaded: _native.Scene
    _glb: Optional[bytes]
    _named: dict[Any, Settings]

    def __init__(
        self, meshes: Iterable[Mesh], *, lamps: Iterable[Lamp] = (), camera: Optional[Camera] = None
    ) -> None:
        self._glb = glb(list(meshes), list(lamps), camera)
        self._named = {}
        with tempfile.TemporaryDirectory(prefix="pathspace-") as folder:
            file = FilePath(folder) / "scene.glb"
            file.write_bytes(self._glb)
            try:
                self._loaded = _native.Scene.load(file_words(file))
            except InputError as error:
                # The file is gone, and its author has never seen it.
                sentence = str(error).replace(f"{file}", "the scene's file")
                raise UsageError(f"the arrays make no scene: {sentence}") from None

    @classmethod
    def _of(cls, native: _native.Scene) -> Scene:
        scene = cls.__new__(cls)
        scene._loaded = native
        scene._glb = None
        scene._named = {}
        return scene

    def save(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes a scene that was made of arrays as a .glb file; one that was loaded has its file already."""
        if self._glb is None:
            raise UsageError("this scene was loaded from a file, which is still there")
        try:
            FilePath(path).write_bytes(self._glb)
        except OSError as error:
            raise OutputError(f"cannot write '{os.fspath(path)}': {error.strerror}") from error

    @property
    def hash(self) -> str:
        """SHA-256 of all bytes that were read, in hexadecimal: ``header["scene"]`` of its images."""
        return self._loaded.hash

    @property
    def cameras(self) -> Sequence[str]:
        """The names of its cameras, for ``render(camera=…)``."""
        return self._loaded.cameras

    @property
    def materials(self) -> Sequence[str]:
        """The names of its materials."""
        return self._loaded.materials

    @property
    def warnings(self) -> Sequence[str]:
        """What its file asks for and does not get."""
        return self._loaded.warnings

    @property
    def triangles(self) -> int:
        """The number of its triangles, those of instances counted as often as they are there."""
        return self._loaded.triangles

    def render(self, *, progress: Listener = False, **options: Unpack[RenderOptions]) -> Image:
        """Renders the scene, and returns the image that ``pathspace render`` makes with the same options, to the bit.

        The keywords are the options of the command line, with ``_`` for ``-`` and the same defaults:
        ``render(integrator="bdpt", spp=64, width=512, layers=["classes"])``. An option that is True is given; a
        sequence is joined by commas (``look_at=(0, 1, 4, 0, 1, 0)``), a dict becomes several options
        (``layer={"caustics": "C.*[DG]S+L"}``), a number of seconds is a time. docs/options.md
        explains them. Files come from :meth:`Image.save` instead of ``output``; checkpoints and
        shards are for the command line, but ``resume`` goes on from one.

        ``progress`` is True for a bar, in a notebook with the picture as it comes, or a function of a
        :class:`pathspace.Progress`. The interpreter's lock is
        released while rays are traced, and Ctrl-C ends a render on the main thread after the pass that it comes in.
        As on the command line, the trees over the scene are built for each render.

        Raises :class:`pathspace.UsageError` with the sentence of the command line for options that make no sense,
        :class:`pathspace.InputError` for files that cannot be read, and TypeError for keywords that are no options.
        """
        given = words("render", "render", render_options(), options)
        if options.get("denoise"):
            look_for_wheel()
        return Image(_native.render(self._loaded, given, *listener(progress)))

    def prepare(self, **options: Unpack[RenderOptions]) -> Settings:
        """Prepares what :meth:`render` would render with these options, for questions about paths: which techniques it
        has, and how it weighs them. Weights that know of variance are measured here."""
        given = words("prepare", "render", render_options(), options)
        return Settings(_native.prepare(self._loaded, given), _view(options))

    def paths(
        self, pixel: tuple[int, int], n: int = 100, *, passes: int = 256, **options: Unpack[RenderOptions]
    ) -> list[Path]:
        """The first ``n`` paths that a render with these options brings to a pixel (column, row); fewer if so many
        ``passes`` over the image have no more. Always the same ones.

        They come with the weight rule of that render: :meth:`Path.techniques` explains each. Raises
        :class:`pathspace.UsageError` for a pixel that the image does not have.
        """
        if len(pixel) != 2:
            raise UsageError(f"pixel is (column, row), not {pixel!r}")
        x, y = (whole("pixel", one) for one in pixel)
        n, passes = whole("n", n), whole("passes", passes)
        given = words("paths", "render", render_options() - {"crop"}, options)
        found = _native.sample_paths(self._loaded, [*given, f"--crop={x},{y},{x + 1},{y + 1}"], (x, y), n, passes)
        return [Path(path, self, _view(options), None) for path in found]

    def path(
        self,
        points: Iterable[ArrayLike],
        sky: Optional[ArrayLike] = None,
        settings: Optional[Settings] = None,
        **options: Unpack[RenderOptions],
    ) -> Path:
        """A path by hand: from the middle of the lens (p_0) over these places, (3,) each, in metres and the coordinates
        of the file.

        At each place there is a surface within a thousandth of the way there, or, at the last one, a point light or
        spot. With ``sky``, a direction, the path goes on to the sun or environment there. V of each edge is what the
        scene says; where something is between, the contribution is zero. On a smooth mirror or glass the path takes
        the delta lobe of the side on which it goes on, as if its directions matched.

        ``settings``, or the ``options`` of :meth:`prepare`, say which camera and image size, and which weights are
        the path's own: by default those of ``bdpt``, plain. Raises :class:`pathspace.UsageError` where there is no
        surface.
        """
        if settings is None:
            given: Any = {"integrator": "bdpt", "weights": "plain", **options}
            settings = self.prepare(**given)
        elif options:
            raise TypeError("path() takes settings or options, not both")
        self._check(settings)
        places = [vector(f"place {i}", point) for i, point in enumerate(points)]
        laid = _native.lay(settings._native, places, None if sky is None else vector("sky", sky))
        return Path(laid, self, settings._view, settings)

    def _prepared_by_name(self, integrator: str, view: Mapping[str, Any]) -> Settings:
        """An integrator with plain weights, prepared once."""
        key = (integrator, repr(sorted(view.items())))
        if key not in self._named:
            given = {**view, "integrator": integrator, "weights": "plain"}
            self._named[key] = self.prepare(**given)
        return self._named[key]

    def _check(self, settings: Settings) -> None:
        """Refuses what was not prepared for this scene."""
        if not isinstance(settings, Settings):
            raise TypeError(f"settings come from Scene.prepare, not {settings!r}")
        if settings._native.hash != self.hash:
            raise UsageError("the settings are those of another scene")

    def __repr__(self) -> str:
        return f"<Scene of {self.triangles} triangles, {len(self.cameras)} cameras, {self.hash[:12]}>"


def _view(options: Mapping[str, Any]) -> dict[str, Any]:
    """Those of the options that any integrator takes."""
    names = {*ViewOptions.__annotations__, *PathOptions.__annotations__} - {"lights"}
    return {name: value for name, value in options.items() if name in names}
