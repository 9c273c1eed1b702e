"""The reports: do integrators agree, how far is an image from another, and how fast do integrators converge."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np

from . import _native
from ._build import array
from ._errors import OutputError, UsageError
from ._image import Image
from ._progress import Hear, reader
from ._scene import Scene, load
from ._words import load_options, options, words

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from typing_extensions import Unpack

    from ._options import ConvergeOptions, VerifyOptions

#: A scene, or the file of one.
SceneLike = Union[Scene, str, os.PathLike[str]]
#: An image, an .exr file, or an array (height, width, 3).
ImageLike = Union[Image, str, os.PathLike[str], "NDArray[np.float32]"]


class _Dict:
    """A dataclass that can be a row of a table."""

    def to_dict(self) -> dict[str, Any]:
        """All fields by name, those of nested objects as well: ``pandas.DataFrame([x.to_dict() for x in …])``."""
        return asdict(self)  # type: ignore[call-overload,no-any-return]


@dataclass(frozen=True)
class Comparison(_Dict):
    """What two integrators say of one set of paths."""

    pair: tuple[str, str]
    #: Which paths: "all", or a class of them.
    paths: str
    #: The probability of means that differ as much as these if both have one expectation.
    p: Optional[float]
    #: The part of the image's mean that these paths are.
    share: Optional[float]
    #: By how much the means differ, as a part of the image's mean.
    difference: Optional[float]
    #: The smallest difference that would have been seen, as a part of the image's mean, and of these paths' mean.
    visible: Optional[float]
    visible_of_class: Optional[float]
    #: "agree", "disagree" or "undecided".
    verdict: str


@dataclass(frozen=True)
class Contestant(_Dict):
    """An integrator of a verification."""

    name: str
    spp: int
    #: Of its render.
    seconds: float
    #: The part of the image's mean that it cannot find.
    uncovered: float


@dataclass(frozen=True)
class VerifyReport(_Dict):
    """Whether integrators agree on a scene."""

    #: "agree", "disagree" or "undecided".
    outcome: str
    #: The answer in sentences.
    summary: Sequence[str]
    integrators: Sequence[Contestant]
    comparisons: Sequence[Comparison]
    #: Everything, as ``pathspace verify --json`` prints it (docs/verify.md).
    json: Mapping[str, Any]
    #: The images, the map of p-values and verify.json, by name.
    files: Mapping[str, bytes]

    def save(self, folder: Union[str, os.PathLike[str]]) -> None:
        """Writes the files of ``pathspace verify`` into a folder, which is made if it is not there."""
        try:
            FilePath(folder).mkdir(exist_ok=True)
            for name, contents in self.files.items():
                (FilePath(folder) / name).write_bytes(contents)
        except OSError as error:
            raise OutputError(f"cannot write '{os.fspath(folder)}': {error.strerror}") from error

    def to_dict(self) -> dict[str, Any]:
        """The fields but for ``json`` and ``files``."""
        return {name: value for name, value in super().to_dict().items() if name not in ("json", "files")}


@dataclass(frozen=True)
class Snapshot(_Dict):
    """The errors of an integrator at one moment."""

    spp: int
    seconds: float
    #: By the name of the metric: "mse", "relmse", "relmse-trimmed", "mape", "flip".
    errors: Mapping[str, float]

    def to_dict(self) -> dict[str, Any]:
        """A flat row: spp, seconds, and each error by its name."""
        return {"spp": self.spp, "seconds": self.seconds, **self.errors}


@dataclass(frozen=True)
class Measured(_Dict):
    """How an integrator has converged."""

    name: str
    #: The exponent of relMSE over time that fits; −1 without bias or correlation. None of too few snapshots.
    slope: Optional[float]
    #: 1/(relMSE · seconds), of that fit.
    efficiency: Optional[float]
    #: How many it traced in all.
    rays: int
    snapshots: Sequence[Snapshot]


@dataclass(frozen=True)
class ConvergeReport(_Dict):
    """How fast integrators converge on a scene."""

    integrators: Sequence[Measured]
    #: Everything, as the .json file of ``pathspace converge`` has it (docs/converge.md).
    json: Mapping[str, Any]
    #: The page with curves and images, and the table of all snapshots.
    html: str
    csv: str

    def rows(self) -> list[dict[str, Any]]:
        """A flat dict for each snapshot of each integrator: ``pandas.DataFrame(report.rows())``."""
        return [{"integrator": one.name, **shot.to_dict()} for one in self.integrators for shot in one.snapshots]

    def save(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes the page, one .html file that loads nothing."""
        try:
            FilePath(path).write_text(self.html, encoding="utf-8")
        except OSError as error:
            raise OutputError(f"cannot write '{os.fspath(path)}': {error.strerror}") from error

    def to_dict(self) -> dict[str, Any]:
        """The integrators with their snapshots."""
        return {"integrators": [one.to_dict() for one in self.integrators]}


@dataclass(frozen=True)
class Compared(_Dict):
    """How far an image is from what it is compared with."""

    #: "a" or "b".
    image: str
    #: By the name of the metric, each a mean over pixels and channels and 0 for equal images: docs/compare.md.
    errors: Mapping[str, float]
    #: By which part of the reference's mean luminance it is brighter.
    brighter: float

    def to_dict(self) -> dict[str, Any]:
        """A flat row."""
        return {"image": self.image, "brighter": self.brighter, **self.errors}


@dataclass(frozen=True, eq=False)
class CompareReport(_Dict):
    """How far images are from each other."""

    #: A against B, or both against the reference.
    images: Sequence[Compared]
    #: The probability of images that differ as much as A and B if both have the same expectation; None without halves,
    #: for images smaller than 16 pixels along a side, and for denoised ones. Renders with one seed share their noise.
    p_of_no_bias: Optional[float]
    #: A minus B, (height, width, 3) float32.
    difference: NDArray[np.float32]

    def to_dict(self) -> dict[str, Any]:
        """The numbers, without the difference image."""
        return {"images": [one.to_dict() for one in self.images], "p_of_no_bias": self.p_of_no_bias}


def verify(scene: SceneLike, *, progress: Hear = None, **options: Unpack[VerifyOptions]) -> VerifyReport:
    """Checks that integrators agree on a scene, and says how small a bias would have been seen.

    The keywords are the options of ``pathspace verify`` with the same defaults: ``integrators``, ``time`` (60 s in
    all) or ``spp``, ``bias`` and so on. ``progress`` is True for a bar, or a function that hears the part that is done,
    in [0, 1], and what is being done. The interpreter's lock is released meanwhile, and Ctrl-C ends it.

    Raises as :meth:`pathspace.Scene.render`.
    """
    scene = _scene(scene)
    given = words("verify", "verify", _keywords("verify"), options)
    text, files = _native.verify(scene._loaded, given, reader(progress))
    found = json.loads(text)
    names = ("name", "spp", "seconds", "uncovered")
    integrators = [Contestant(**{name: one[name] for name in names}) for one in found["integrators"]]
    comparisons = [Comparison(**{**one, "pair": tuple(one["pair"])}) for one in found["comparisons"]]
    contents = {name: bytes(data) for name, data in files}
    return VerifyReport(found["outcome"], found["summary"], integrators, comparisons, found, contents)


def converge(
    scene: SceneLike, *, progress: Hear = None, **options: Unpack[ConvergeOptions]
) -> ConvergeReport:
    """Measures the error of integrators over time, against a long run or the image ``reference`` (an .exr file).

    The keywords are the options of ``pathspace converge`` with the same defaults: ``integrators``, ``time`` (20 s
    each) or ``spp``, and so on. ``progress`` is as for :func:`verify`. The interpreter's lock is released meanwhile,
    and Ctrl-C ends it.

    Raises as :meth:`pathspace.Scene.render`.
    """
    given = words("converge", "converge", _keywords("converge"), options)
    title = "scene" if isinstance(scene, Scene) else FilePath(scene).stem
    command = f"pathspace converge {title} {shlex.join(given)}".strip()
    text, html, csv = _native.converge(_scene(scene)._loaded, given, title, command, reader(progress))
    found = json.loads(text)

    def snapshot(one: Mapping[str, Any]) -> Snapshot:
        errors = {name: value for name, value in one.items() if name not in ("spp", "seconds")}
        return Snapshot(one["spp"], one["seconds"], errors)

    integrators = [
        Measured(one["name"], one["slope"], one["efficiency"], one["rays"], [snapshot(s) for s in one["snapshots"]])
        for one in found["integrators"]
    ]
    return ConvergeReport(integrators, found, html, csv)


def compare(a: ImageLike, b: ImageLike, reference: Optional[ImageLike] = None) -> CompareReport:
    """Says how far image ``a`` is from ``b``, or both from ``reference``: the numbers of ``pathspace compare``.

    Images come from renders, .exr files, or arrays (height, width, 3) of linear radiances. Raises
    :class:`pathspace.UsageError` for images of unlike sizes and for arrays that hold NaN or have a wrong shape,
    :class:`pathspace.InputError` for files that cannot be read, and TypeError for what is no image.
    """
    given = {"a": _pixels("a", a), "b": _pixels("b", b)}
    against = given["b"] if reference is None else _pixels("reference", reference)
    for name, pixels in {**given, "reference": against}.items():
        if pixels.shape != given["a"].shape:
            (h, w), (y, x) = given["a"].shape, pixels.shape
            raise UsageError(
                f"a has {w} × {h} pixels and {name} {x} × {y}: only images of one size can be compared"
            )
    rows = ["a"] if reference is None else ["a", "b"]
    compared = []
    for name in rows:
        errors, brighter = given[name].errors(against)
        compared.append(Compared(name, dict(errors), brighter))
    shape = (*given["a"].shape, 3)
    minuend, subtrahend = (np.frombuffer(pixels.rgb(), np.float32).reshape(shape) for pixels in given.values())
    return CompareReport(compared, given["a"].p_of_no_bias(given["b"]), minuend - subtrahend)


def _pixels(name: str, image: ImageLike) -> _native.Pixels:
    if isinstance(image, Image):
        # As in a file: only halves that were asked for count.
        halves = image.halves if "even.R" in image.data else None
        both = None if halves is None else (halves[0].tobytes(), halves[1].tobytes())
        return _native.Pixels(image.width, image.height, image.rgb.tobytes(), both, "denoised" in image.header)
    if isinstance(image, (str, os.PathLike)):
        return _native.Pixels.read(os.fspath(image))
    pixels = array(name, image, (None, None, 3)).astype(np.float32)
    if pixels.size == 0:
        raise UsageError(f"{name} has no pixels")
    return _native.Pixels(pixels.shape[1], pixels.shape[0], pixels.tobytes())


def _scene(scene: SceneLike) -> Scene:
    return scene if isinstance(scene, Scene) else load(scene)


def _keywords(command: str) -> frozenset[str]:
    return frozenset(options(command)) - load_options()
