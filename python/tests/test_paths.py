"""Paths from Python are the definition's: against NumPy, the program's own account, and the fast form."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from conftest import SCENES, program, run

import pathspace as ps

# Diffuse and specular, with merges; glossy under lamps without extent; and a map around instances.
SAMPLED: list[tuple[str, dict[str, Any]]] = [
    ("cornell-spheres", {"integrator": "vcm"}),
    ("mis-plates", {"integrator": "bdpt"}),
    ("outdoor", {"integrator": "bdpt", "env": SCENES / "outdoor-sky.hdr"}),
]
PATHS = 10_000


def sampled(name: str, options: dict[str, Any], n: int) -> list[ps.Path]:
    """Random paths of a scene, from pixels all over a small image."""
    scene = ps.load(SCENES / f"{name}.glb")
    side, paths = 4, []
    height = scene.prepare(width=side, **options).size[1]
    pixels = [(x, y) for y in range(height) for x in range(side)]
    for pixel in pixels:
        paths += scene.paths(pixel, math.ceil(n / len(pixels)), passes=2000, width=side, **options)
    return paths


def geometry_term(path: ps.Path, i: int) -> float:
    """G by the formula, from places and normals alone."""
    a, b = path.vertices[i], path.vertices[i + 1]
    p, q = a.place, b.place
    if path.merged is not None and path.merged[0] == i:
        p = path.merged[1]
    if a.is_direction or b.is_direction:
        direction, squared = (q if b.is_direction else p), 1.0
    else:
        direction, squared = q - p, float((q - p) @ (q - p))
    direction = direction / np.linalg.norm(direction)

    def cosine(vertex: ps.Vertex) -> float:
        has_normal = not vertex.is_direction and vertex.normal.any()
        return abs(float(vertex.normal @ direction)) if has_normal else 1.0

    return float(path.visibility[i]) * cosine(a) * cosine(b) / squared


@pytest.mark.parametrize(("name", "options"), SAMPLED)
def test_random_paths_are_the_definitions(name: str, options: dict[str, Any]) -> None:
    paths = sampled(name, options, PATHS)
    assert len(paths) >= 0.9 * PATHS
    kinds, off = set(), 0
    for path in paths:
        assert path.value is not None and path.technique is not None
        table = path.techniques()
        assert abs(table["w"].sum() - 1.0) < 1e-6
        kinds.add(type(path.technique))

        # The fast form, which shares nothing with the definition, has found it with w F/(n p).
        own = row(path, table)
        assert own["p"] > 0.0 and own["w"] == path.weight(path.technique)
        expected = path.contribution() * own["w"] / (own["n"] * own["p"])
        found = path.value * path.survival
        # Grazing angles, short edges and the rims of mirrors magnify its 32-bit roundings.
        off += not np.allclose(found, expected, rtol=2e-3, atol=0.0)

    assert off <= 0.003 * len(paths), f"{off} of {len(paths)} paths"
    assert ps.Merge in kinds or options["integrator"] != "vcm"

    # In NumPy, the places have the 32-bit roundings of the file's coordinates, as the definition's have.
    for path in paths[::5]:
        for i in range(path.edges):
            assert path.geometry_term(i) == pytest.approx(geometry_term(path, i), rel=1e-4)


def row(path: ps.Path, table: Any) -> Any:
    """The row of the technique that has found a path."""
    kind, t = kind_and_t(path)
    (own,) = table[(table["kind"] == kind) & (table["t"] == t)]
    return own


def kind_and_t(path: ps.Path) -> tuple[str, int]:
    """The technique that has found a path as the table and the program write it."""
    technique = path.technique
    if isinstance(technique, ps.Merge):
        return "merge", technique.at + 1
    assert isinstance(technique, tuple)
    return "strategy", technique[1]


@pytest.mark.parametrize("name", ["cornell-spheres", "mis-plates", "caustic-sphere"])
def test_the_program_says_the_same_of_every_path(name: str) -> None:
    """`pathspace trace` lists all paths of a pixel: Python finds the same ones, and says the same of each."""
    spp, side, pixel = 25, 6, (2, 3)
    words = ["--pixel=2,3", f"--spp={spp}", f"--width={side}", "--height=6", "--top=1000", "--json", "-i", "vcm"]
    done = run(program(), "trace", str(SCENES / f"{name}.glb"), *words)
    assert done.returncode == 0, done.stderr
    traced = json.loads(done.stdout)["largest"]
    assert 20 < len(traced) < 1000
    scene = ps.load(SCENES / f"{name}.glb")
    paths = scene.paths(pixel, 100_000, passes=spp, width=side, height=6, integrator="vcm")
    assert len(paths) == len(traced)

    def key(raster: Any, value: Any, found: tuple[str, int], merged: Any) -> tuple[object, ...]:
        return (*np.concatenate([raster, value]).astype(np.float32).tolist(), *found, *merged)

    def place_of_merge(path: ps.Path) -> Any:
        return () if path.merged is None else path.merged[1]

    by_value = {key(path.raster, path.value, kind_and_t(path), place_of_merge(path)): path for path in paths}
    assert len(by_value) == len(paths)
    for one in traced:
        # The box filter is 1 in its pixel.
        found = (one["technique"]["kind"], one["technique"]["t"])
        path = by_value[key(one["raster"], one["value"], found, one["merged"]["place"] if one["merged"] else ())]
        assert path.path_class == one["class"]
        np.testing.assert_allclose(path.throughput(), one["throughput"], rtol=1e-12)
        np.testing.assert_allclose(path.contribution(), one["contribution"], rtol=1e-12)
        for vertex, place in zip(path.vertices, one["vertices"]):
            np.testing.assert_allclose(vertex.place, place["place"], rtol=1e-12)
            assert vertex.material == place["material"]
        for i, edge in enumerate(one["edges"]):
            assert path.geometry_term(i) == pytest.approx(edge["G"], rel=1e-12)
        has = [share for share in one["techniques"] if share["n"] > 0]
        table = path.techniques()
        table = table[table["n"] > 0]
        for share, mine in zip(has, table):
            assert (share["technique"]["s"], share["technique"]["t"]) == (mine["s"], mine["t"])
            np.testing.assert_allclose([mine["p"], mine["n"], mine["w"]], [share["p"], share["n"], share["w"]], 1e-9)


def room() -> ps.Scene:
    """A Lambertian floor, and a lamp above it that faces down: the example of the library's documentation."""
    floor = ps.Mesh([(-4, 0, -4), (0, 0, 4), (4, 0, -4)], material=ps.Material(0.8, specular=0.0, name="floor"))
    lamp = ps.Mesh([(-1, 2, -1), (1, 2, -1), (0, 2, 1)], material=ps.Material(0.0, specular=0.0, emission=5.0))
    camera = ps.Camera((0, 1, 6), (0, 0, 0), yfov=math.degrees(0.7), aspect=4 / 3)
    return ps.Scene([floor, lamp], lamps=[ps.PointLamp((1, 1.5, 0), 3.0)], camera=camera)


def test_a_path_by_hand() -> None:
    scene = room()
    path = scene.path([(0, 0, 0), (0.1, 2, -0.2)], width=64)
    assert path.path_class == "CDL" and path.edges == 2 and path.value is None and path.survival == 1.0
    assert [vertex.event for vertex in path.vertices] == ["camera", "diffuse", "light"]
    assert path.vertices[1].material == "floor"
    np.testing.assert_allclose(path.vertices[0].place, (0, 1, 6), atol=1e-6)
    np.testing.assert_allclose(path.visibility, 1.0)
    # T = f G, by hand, and F = W_e G T L_e.
    g = 2.0**2 / (0.1**2 + 2.0**2 + 0.2**2) ** 2
    assert path.geometry_term(1) == pytest.approx(g, rel=1e-6)
    np.testing.assert_allclose(path.throughput(), 0.8 / math.pi * g, rtol=1e-6)
    assert path.contribution()[0] > 0.0
    # Both walks begin alike at the camera; then (0, 3) draws a direction by its cosine, and (1, 2) a light, of which
    # there are two, and a place on its triangle.
    by_direction = path.geometry_term(1) / math.pi
    chosen = path.pdf((1, 2)) / path.pdf((0, 3)) * by_direction * 2.0
    assert 0.0 < chosen < 1.0

    for settings in None, "bdpt", "path", "hybrid", scene.prepare(integrator="vcm", width=64):
        table = path.techniques(settings)
        assert table.dtype == ps.TECHNIQUES
        assert table["w"].sum() == pytest.approx(1.0, abs=1e-6)
        assert [tuple(x) for x in table[["s", "t"]][:3]] == [(0, 3), (1, 2), (2, 1)]
    # The power heuristic, from n and p; without another word the path's own weights are these.
    table = path.techniques("bdpt")
    np.testing.assert_array_equal(path.techniques()["w"], table["w"])
    squares = (table["n"] * table["p"]) ** 2
    np.testing.assert_allclose(table["w"], squares / squares.sum(), rtol=1e-5)
    assert path.weight((2, 1), "path") == 0.0
    merge = path.techniques(scene.prepare(integrator="vcm", width=64))
    (merged,) = merge[merge["kind"] == "merge"]
    expected = math.pi * merged["radius"] ** 2 * path.pdf(ps.Merge(1))
    assert merged["p"] == pytest.approx(expected, rel=1e-6)


def test_a_path_to_a_lamp_without_extent_and_one_in_shadow() -> None:
    scene = room()
    path = scene.path([(0, 0, 0), (1, 1.5, 0)])
    distance = 1.0 + 1.5**2
    np.testing.assert_allclose(path.throughput(), 0.8 / math.pi * (1.5 / math.sqrt(distance)) / distance, rtol=1e-6)
    assert path.pdf((0, 3)) == 0.0 and path.pdf((1, 2)) > 0.0
    # From behind the lamp's triangle, the floor below it is hidden.
    hidden = ps.Mesh([(-4, 1, -4), (0, 1, 4), (4, 1, -4)], material=ps.Material(0.5))
    camera = ps.Camera((0, 3, 6), (0, 0, 0))
    floor = ps.Mesh([(-4, 0, -4), (0, 0, 4), (4, 0, -4)])
    scene = ps.Scene([floor, hidden], lamps=[ps.PointLamp((0, 2, 0), 1.0)], camera=camera)
    shadowed = scene.path([(0, 0, 0), (0, 2, 0)])
    assert shadowed.visibility[1] == 0.0 and not shadowed.contribution().any()


def test_a_path_over_a_mirror_to_the_sky() -> None:
    mirror = ps.Mesh([(-9, 0, -9), (0, 0, 9), (9, 0, -9)], material=ps.Material(0.9, metallic=1.0, roughness=0.0))
    scene = ps.Scene([mirror], camera=ps.Camera((0, 1, 4), (0, 0, 0)))
    path = scene.path([(0, 0, 0)], sky=(0, 1, -4), env_color=(1, 2, 3), width=16)
    assert path.path_class == "CSL" and path.vertices[-1].is_direction
    # Schlick's Fresnel term of a metal: F_0 + (1 − F_0)(1 − cos θ)⁵.
    cosine = 1.0 / math.sqrt(1.0 + 4.0**2)
    np.testing.assert_allclose(path.throughput(), 0.9 + 0.1 * (1.0 - cosine) ** 5, rtol=1e-5)
    assert path.contribution()[2] == pytest.approx(3 * path.contribution()[0], rel=1e-6)


def test_what_is_no_path() -> None:
    scene = room()
    with pytest.raises(ps.UsageError, match="there is no surface at"):
        scene.path([(0, 1, 0), (0, 2, 0)])
    with pytest.raises(ps.UsageError, match="at least one place"):
        scene.path([])
    with pytest.raises(ps.UsageError, match=r"place 0 has the shape \(2,\)"):
        scene.path([(0, 0)])
    with pytest.raises(ps.UsageError, match="not finite"):
        scene.path([(0, 0, float("nan"))])
    path = scene.path([(0, 0, 0), (0, 2, 0)])
    with pytest.raises(IndexError):
        path.geometry_term(2)
    with pytest.raises(ps.UsageError, match="s = 3 and t = 3"):
        path.pdf((3, 3))
    with pytest.raises(ps.UsageError, match="a technique is"):
        path.pdf("bdpt")  # type: ignore[arg-type]
    for at in 0, 2, 99:
        with pytest.raises(ps.UsageError, match="between its ends"):
            path.pdf(ps.Merge(at))
    with pytest.raises(IndexError):
        path.geometry_term(-1)
    untyped: Any = ps
    techniques: Any = (("1", "2"), untyped.Merge(1.0))
    for technique in techniques:
        with pytest.raises(TypeError, match="whole number"):
            path.pdf(technique)
    other = ps.Scene([ps.Mesh([(-4, 0, -4), (0, 0, 4), (4, 0, -4)])]).prepare(integrator="path")
    for ask in (lambda: path.techniques(other), lambda: scene.path([(0, 0, 0)], settings=other)):
        with pytest.raises(ps.UsageError, match="another scene"):
            ask()
    with pytest.raises(ps.UsageError, match="reaches beyond the image of 32"):
        scene.paths((32, 0), width=32)
    with pytest.raises(ps.UsageError, match="pixel is at least 0"):
        scene.paths((-1, 0))
    with pytest.raises(TypeError, match="pixel is a whole number"):
        scene.paths((1.5, 0))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="settings come from"):
        path.techniques(3)  # type: ignore[arg-type]
    with pytest.raises(ps.UsageError, match="invalid value 'nosuch'"):
        path.techniques("nosuch")
