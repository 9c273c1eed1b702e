"""Scenes from arrays are the glTF files that they say."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import program, run

import pathspace as ps

#: For arguments that a type checker would refuse.
UNTYPED: Any = ps

TRIANGLE = np.array([[-1.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, -1.0]])


def furnace(albedo: float) -> ps.Scene:
    """A triangle that fills the view under light from everywhere: its radiance is its albedo."""
    floor = ps.Mesh(1000 * TRIANGLE, material=ps.Material(albedo, specular=0.0))
    return ps.Scene([floor], camera=ps.Camera((0, 2, 0.001), (0, 0, 0)))


def test_a_furnace() -> None:
    image = furnace(0.6).render(width=16, spp=4, env_color=2.0, sampler="independent", max_depth=2)
    np.testing.assert_allclose(image.rgb.mean(), 1.2, rtol=2e-2)


def test_lamps_have_their_units() -> None:
    """The radiance of a Lambertian floor under each lamp, from its formula."""
    floor = ps.Mesh(1000 * TRIANGLE, material=ps.Material(0.5, specular=0.0))
    camera = ps.Camera((0, 1, 0), (0, 0, 0), up=(0, 0, -1), yfov=0.5)
    cosine, distance = math.cos(math.radians(30)), 3.0
    towards = np.array([math.sin(math.radians(30)), cosine, 0.0])
    lamps: list[tuple[Any, float]] = [
        (ps.Sun(-towards, (4.0, 8.0, 12.0)), 8.0 * cosine),
        (ps.PointLamp(distance * towards, (2.0, 4.0, 1.0)), 4.0 * cosine / distance**2),
        (ps.SpotLamp(distance * towards, -towards, 4.0, inner=10, outer=20), 4.0 * cosine / distance**2),
        (ps.SpotLamp(distance * towards, towards, 4.0, inner=10, outer=20), 0.0),
    ]
    for lamp, irradiance in lamps:
        image = ps.Scene([floor], lamps=[lamp], camera=camera)
        with_light = irradiance > 0.0
        if not with_light:
            with pytest.warns(ps.PathspaceWarning, match="black"):
                rgb = image.render(width=8, spp=2, integrator="path").rgb
        else:
            rgb = image.render(width=8, spp=2, integrator="path").rgb
        np.testing.assert_allclose(rgb[..., 1].mean(), 0.5 / math.pi * irradiance, rtol=2e-3)


def test_materials_are_what_they_say() -> None:
    mirror = ps.Mesh(1000 * TRIANGLE, material=ps.Material((0.9, 0.5, 0.1), metallic=1.0, roughness=0.0, name="mirror"))
    scene = ps.Scene([mirror], camera=ps.Camera((0, 2, 0.001), (0, 0, 0)))
    assert scene.materials == ["mirror"] and scene.triangles == 1 and scene.cameras == ["camera"]
    image = scene.render(width=8, spp=1, env_color=1.0, layers="classes")
    np.testing.assert_allclose(image.rgb[4, 4], (0.9, 0.5, 0.1), rtol=1e-3)
    # What the reader says of the file is said of the arrays.
    glass = ps.Material(1.0, transmission=1.0, roughness=0.0, ior=1.5, volume=True, name="glass")
    with pytest.warns(ps.PathspaceWarning, match="“glass”.*is not closed"):
        ps.Scene([ps.Mesh(TRIANGLE, material=glass)])


def test_numbers_may_be_numpys() -> None:
    one: Any = np.float32(1.0)
    true: Any = np.True_
    material = ps.Material(one / 2, metallic=one, roughness=one / 4, double_sided=true)
    camera = ps.Camera((0, 2, 0.001), (0, 0, 0), yfov=45 * one, aspect=2 * one)
    assert ps.Scene([ps.Mesh(TRIANGLE, np.arange(3, dtype=np.uint8)[None], material)], camera=camera).triangles == 1


def test_shading_normals_count() -> None:
    camera = ps.Camera((0, 1, 0), (0, 0, 0), up=(0, 0, -1), yfov=0.5)

    def brightness(normal: tuple[float, float, float] | None) -> float:
        normals = None if normal is None else np.tile(normal, (3, 1))
        floor = ps.Mesh(1000 * TRIANGLE, [[0, 1, 2]], ps.Material(0.5, specular=0.0), normals=normals)
        scene = ps.Scene([floor], lamps=[ps.Sun((-1, -1, 0), 1.0)], camera=camera)
        return float(scene.render(width=8, spp=2, integrator="path").rgb.mean())

    assert brightness((0, 7, 0)) == pytest.approx(brightness(None), rel=1e-5)
    # Towards the sun and away from it.
    assert brightness((0.3, 1, 0)) > brightness(None) > brightness((-0.3, 1, 0))


def test_the_file_renders_alike_by_the_program(tmp_path: Path) -> None:
    scene = furnace(0.3)
    scene.save(tmp_path / "furnace.glb")
    words = ["--width=12", "--spp=3", "--env-color=1,2,3", "-o", "image.exr"]
    assert run(program(), "render", "furnace.glb", *words, cwd=tmp_path).returncode == 0
    image = scene.render(width=12, spp=3, env_color=(1, 2, 3))
    assert image.encode("exr") == (tmp_path / "image.exr").read_bytes()
    with pytest.raises(ps.UsageError, match="loaded from a file"):
        ps.load(tmp_path / "furnace.glb").save(tmp_path / "again.glb")
    with pytest.raises(ps.OutputError, match="nowhere"):
        scene.save(tmp_path / "nowhere" / "furnace.glb")


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        ({"positions": TRIANGLE[:, :2]}, ps.UsageError, r"positions has the shape \(3, 2\), and \(n, 3\)"),
        ({"positions": TRIANGLE * [np.nan, 1, 1]}, ps.UsageError, "positions holds numbers that are not finite"),
        ({"positions": TRIANGLE * 1e300}, ps.UsageError, "32-bit floats"),
        ({"positions": TRIANGLE[:2]}, ps.UsageError, "not three for each triangle"),
        ({"positions": np.zeros((0, 3))}, ps.UsageError, "no vertices"),
        ({"positions": "triangle"}, TypeError, "no array of numbers"),
        ({"positions": TRIANGLE, "triangles": [[0, 1, 3]]}, ps.UsageError, "not among 0 … 2"),
        ({"positions": TRIANGLE, "triangles": [[0, 1, -1]]}, ps.UsageError, "not among 0 … 2"),
        ({"positions": TRIANGLE, "triangles": [[0.0, 1.0, 2.0]]}, TypeError, "triangles are integers"),
        ({"positions": TRIANGLE, "triangles": [0, 1, 2]}, ps.UsageError, r"triangles has the shape \(3,\)"),
        ({"positions": TRIANGLE, "normals": TRIANGLE[:2]}, ps.UsageError, r"normals has the shape \(2, 3\)"),
        ({"positions": TRIANGLE, "normals": 0 * TRIANGLE}, ps.UsageError, "length zero"),
        ({"positions": TRIANGLE, "material": ps.Material((1, 2))}, ps.UsageError, "base_color has the shape"),
        ({"positions": TRIANGLE, "material": ps.Material(emission=-1.0)}, ps.UsageError, "emission has negative"),
        ({"positions": TRIANGLE, "material": ps.Material(roughness=math.nan)}, ps.UsageError, "not finite"),
        ({"positions": TRIANGLE, "material": "glass"}, TypeError, "its material is a Material"),
        ({"positions": TRIANGLE, "triangles": []}, ps.UsageError, r"triangles has the shape \(0,\)"),
        ({"positions": TRIANGLE, "triangles": [[0, 1, 2], [0, 1]]}, TypeError, "triangles is no array of numbers"),
        ({"positions": TRIANGLE * 1j}, TypeError, "positions is no array of numbers, but of complex128"),
        ({"positions": np.ma.masked_less(TRIANGLE, 0.0)}, TypeError, "masked"),
        ({"positions": TRIANGLE, "material": UNTYPED.Material("red")}, TypeError, "base_color is no array of numbers"),
        ({"positions": TRIANGLE, "material": UNTYPED.Material(metallic="1")}, TypeError, "metallic is a number, not"),
        ({"positions": TRIANGLE, "material": ps.Material(transmission=1.5)}, ps.UsageError, "between 0 and 1, not 1.5"),
        ({"positions": TRIANGLE, "material": ps.Material(ior=0.5)}, ps.UsageError, "ior is at least 1"),
        ({"positions": TRIANGLE, "material": UNTYPED.Material(double_sided=1)}, TypeError, "double_sided is True or"),
        ({"positions": TRIANGLE * 1e38}, ps.UsageError, "the arrays make no scene: "),
    ],
)
def test_arrays_that_make_no_scene(arguments: dict[str, Any], error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        ps.Scene([ps.Mesh(**arguments)])


def test_what_else_makes_no_scene() -> None:
    mesh: Any = ps.Mesh(TRIANGLE)
    for lamp, error, said in (
        (ps.PointLamp((0, 0), 1.0), ps.UsageError, "lamp 0: position has the shape"),
        (ps.Sun((0, 0, 0), 1.0), ps.UsageError, "has no direction"),
        ("sun", TypeError, "a lamp is"),
        (UNTYPED.PointLamp((0, 1, 0), "bright"), TypeError, "lamp 0: intensity is no array of numbers"),
        (ps.SpotLamp((0, 1, 0), (0, -1, 0), 1.0, inner=50, outer=20), ps.UsageError, "0 ≤ inner ≤ outer ≤ 90"),
    ):
        with pytest.raises(error, match=said):
            ps.Scene([mesh], lamps=[lamp])  # type: ignore[list-item]
    with pytest.raises(ps.UsageError, match="along its up direction"):
        ps.Scene([mesh], camera=ps.Camera((0, 1, 0), (0, 0, 0)))
    for view, said in (({"yfov": 0.0}, "yfov is above 0"), ({"aspect": -1.0}, "aspect is above 0")):
        with pytest.raises(ps.UsageError, match=said):
            ps.Scene([mesh], camera=ps.Camera((0, 1, 0), (0, 0, 1), **view))
    with pytest.raises(ps.UsageError, match="nothing in the scene"):
        ps.Scene([])
    with pytest.raises(TypeError, match="made of Mesh"):
        ps.Scene([TRIANGLE])  # type: ignore[list-item]
