"""The path-space core by hand: paths, their throughput, densities and weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import index
from typing import TYPE_CHECKING, Any, Literal, Optional, Union

import numpy as np

from . import _native
from ._errors import UsageError
from ._words import whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._scene import Scene


@dataclass(frozen=True)
class Merge:
    """A technique: a camera subpath and a light subpath that nearly meet at p_``at``."""

    at: int


#: A strategy (s, t) with s vertices from a light and t from the camera, a :class:`Merge`, or "area" for area sampling.
Technique = Union[tuple[int, int], Merge, Literal["area"]]

#: What :meth:`Path.techniques` has of each: its kind ("strategy", "merge", "area"), s and t (of a merge at p_i, t is
#: i + 1), n samples in a pass, their density p, the radius of a merge in metres (else NaN), the variance factor v that
#: weights know of, and its weight w.
TECHNIQUES = np.dtype(
    [("kind", "U8"), ("s", "i4"), ("t", "i4"), ("n", "f8"), ("p", "f8"), ("radius", "f8"), ("v", "f8"), ("w", "f8")]
)


@dataclass(frozen=True, eq=False)
class Vertex:
    """A vertex p_i of a path."""

    #: "camera", "diffuse", "glossy", "specular" or "light".
    event: str
    #: The name of the material, None where there is no surface.
    material: Optional[str]
    #: Where it is, (3,) float64, metres in the coordinates of the file; or the unit direction that it is.
    place: NDArray[np.float64]
    #: N_g and N_s, (3,) float64, unit; of the lens N_g is the viewing direction. Zero where there is no surface.
    normal: NDArray[np.float64]
    shading_normal: NDArray[np.float64]
    #: Whether the place is a direction: at infinity, or on the film of an orthographic camera.
    is_direction: bool
    #: How much of the surface is there, in [0, 1].
    alpha: float


_EVENTS = {"C": "camera", "D": "diffuse", "G": "glossy", "S": "specular", "L": "light"}


class Settings:
    """A render that is prepared and not begun: which techniques it has, how often each samples, and how it weighs.

    :meth:`pathspace.Scene.prepare` makes it. Radii of merges are those of the first pass.
    """

    def __init__(self, native: _native.Settings, view: dict[str, Any]) -> None:
        self._native = native
        self._view = view

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the image in pixels."""
        return self._native.size

    def __repr__(self) -> str:
        return f"<Settings {' '.join(self._native.words)}>"


class Path:
    """A path p̄ = p_0 p_1 … p_n: p_0 on the lens, p_n on a light.

    Everything about it comes from its definition, in float64, and from nothing that rendering uses: the lecture's
    formulas, evaluated slowly. :meth:`pathspace.Scene.path` lays one by hand, :meth:`pathspace.Scene.paths` takes those
    that a render finds.
    """

    def __init__(self, native: _native.Path, scene: Scene, view: dict[str, Any], settings: Optional[Settings]) -> None:
        self._native = native
        self._scene = scene
        self._view = view
        self._settings = settings

    @property
    def edges(self) -> int:
        """n, the length of the path."""
        return self._native.edges

    @property
    def path_class(self) -> str:
        """Heckbert's letters, camera first, as in "CDSSL"."""
        return self._native.class_

    @property
    def raster(self) -> tuple[float, float]:
        """Where it arrives on the image, in pixels from the upper left corner."""
        return self._native.raster

    @property
    def wavelength(self) -> Optional[float]:
        """In nm, of a path that a render has found in a scene that disperses; else None. What a dispersed path carries
        of it, c(λ)/p(λ), is in :meth:`contribution`; a path laid by hand has indices of refraction at 587.6 nm."""
        return self._native.wavelength

    @cached_property
    def vertices(self) -> Sequence[Vertex]:
        """p_0 … p_n."""
        return [
            Vertex(_EVENTS[event], material, np.array(place), np.array(n), np.array(n_s), is_direction, alpha)
            for event, material, place, n, n_s, is_direction, alpha in self._native.vertices()
        ]

    @property
    def visibility(self) -> NDArray[np.float64]:
        """V(p_i↔p_{i+1}) of each edge, (n,) float64 in [0, 1]."""
        return np.array(self._native.visibility)

    @property
    def merged(self) -> Optional[tuple[int, NDArray[np.float64]]]:
        """Of a path that a merge has found: the index of the vertex where, and the place beside it at which the light's
        subpath ended."""
        merged = self._native.merged()
        return None if merged is None else (merged[0], np.array(merged[1]))

    @property
    def technique(self) -> Optional[Technique]:
        """What has found the path; None if nothing has."""
        found = self._native.found
        return None if found is None else _technique(*found[0])

    @property
    def value(self) -> Optional[NDArray[np.float32]]:
        """What the render that has found it adds to the sum of all passes: w F/(n p), divided by :attr:`survival`, by
        the fast form; (3,) float32. None of a path that was laid by hand."""
        found = self._native.found
        return None if found is None else np.array(found[1], np.float32)

    @property
    def survival(self) -> float:
        """The probability with which Russian roulette let both walks come so far; 1 of a path laid by hand."""
        found = self._native.found
        return 1.0 if found is None else found[2]

    def throughput(self) -> NDArray[np.float64]:
        """T(p̄) = Π f̂(p_{i+1}→p_i→p_{i−1}) G(p_{i+1}↔p_i) over i = 1 … n−1: the fraction of the light at p_n that
        reaches p_0, with respect to area measure; (3,) float64 in (sr m²)^(1−n)."""
        return np.array(self._native.throughput())

    def geometry_term(self, i: int) -> float:
        """G(p_i↔p_{i+1}) = V |cos θ_i| |cos θ_{i+1}| / |p_i − p_{i+1}|², in 1/m²; with a cosine and a distance of 1
        where an end is a direction. IndexError if there is no such edge."""
        if not 0 <= (edge := index(i)) < self.edges:
            raise IndexError(f"the path has the edges 0 to {self.edges - 1}")
        return self._native.geometry_term(edge)

    def contribution(self) -> NDArray[np.float64]:
        """F(p̄)/h = W_e(p_1→p_0) G(p_0↔p_1) T(p̄) L_e(p_n→p_{n−1}): the measurement contribution without the pixel's
        filter h, (3,) float64, with respect to the product area measure of all vertices."""
        return np.array(self._native.contribution())

    def pdf(self, technique: Technique, settings: Union[Settings, str, None] = None) -> float:
        """The density with which a technique finds this path, zero if it cannot.

        With respect to the product area measure of all vertices: 1/m² for each of them, 1/sr for one at infinity,
        coefficients of deltas for pinholes, point lights and specular lobes. Of a :class:`Merge`, it is the product of
        both walks' densities, in which p_i counts twice; times πr² it is the ``p`` of :meth:`techniques`. Walks
        sample by the BSDF unless ``settings`` have another rule.

        Raises :class:`pathspace.UsageError` if s + t is not the number of vertices.
        """
        return self._native.pdf(self._written(technique), None if settings is None else self._prepared(settings))

    def techniques(self, settings: Union[Settings, str, None] = None) -> NDArray[np.void]:
        """All techniques for paths of this length with n, p and w: a structured array of :data:`TECHNIQUES`.

        First (s,t) by rising s, then merges. ``p`` has the measure of :meth:`pdf`, and of a merge the factor πr², so
        that F/(n p) is the estimate of each. The weights are those of ``settings``, the name of an integrator (with
        its own rule but plain weights), or by default the render that found the path, or that it was laid for; over
        the techniques they sum to 1 if any of them can find the path.
        """
        is_found = settings is None and self._native.found is not None
        rows = self._native.techniques(None if is_found else self._prepared(settings))
        none = float("nan")
        return np.array([(*row[:5], none if row[5] is None else row[5], *row[6:]) for row in rows], TECHNIQUES)

    def weight(self, technique: Technique, settings: Union[Settings, str, None] = None) -> float:
        """w of a technique, in [0, 1]: its row of :meth:`techniques`. Zero if the settings do not have it."""
        kind, s, t = self._written(technique)
        table = self.techniques(settings)
        rows = table[(table["kind"] == kind) & (table["s"] == s) & (table["t"] == t)]
        if len(rows) == 0 and kind != "area":
            raise UsageError(f"a path of {self.edges + 1} vertices has no technique {technique!r}")
        return float(rows["w"].sum())

    def _prepared(self, settings: Union[Settings, str, None]) -> _native.Settings:
        if isinstance(settings, str):
            settings = self._scene._prepared_by_name(settings, self._view)
        if settings is None:
            settings = self._settings
        if not isinstance(settings, Settings):
            raise TypeError(f"settings come from Scene.prepare, or are the name of an integrator, not {settings!r}")
        self._scene._check(settings)
        return settings._native

    def _written(self, technique: Technique) -> tuple[str, int, int]:
        if isinstance(technique, Merge):
            at = whole("where a path merges", technique.at)
            if not 1 <= at < self.edges:
                raise UsageError(f"a path of {self.edges} edges merges at a vertex between its ends, not at p_{at}")
            return ("merge", self.edges - at, at + 1)
        if technique == "area":
            return ("area", 0, 0)
        if isinstance(technique, tuple) and len(technique) == 2:
            s, t = (whole("a number of vertices", count) for count in technique)
            return ("strategy", s, t)
        raise UsageError(f"a technique is (s, t), Merge(i) or 'area', not {technique!r}")

    def __repr__(self) -> str:
        return f"<Path {self.path_class} of {self.edges} edges>"


def _technique(kind: str, s: int, t: int) -> Technique:
    if kind == "area":
        return "area"
    return (s, t) if kind == "strategy" else Merge(t - 1)
