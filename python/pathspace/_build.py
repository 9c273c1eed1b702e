"""Scenes from arrays: meshes, materials, lamps and a camera, and the glTF file that they are."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np

from ._errors import UsageError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Material:
    """What a surface is made of, as glTF's metallic-roughness model names it. Colours are linear, in [0, 1].

    ``Material(base_color=0.8, specular=0)`` is Lambertian, ``Material(metallic=1, roughness=0)`` a mirror,
    ``Material(transmission=1, roughness=0, volume=True)`` glass.
    """

    base_color: Union[float, Sequence[float]] = 0.8
    metallic: float = 0.0
    roughness: float = 1.0
    specular: float = 1.0
    #: Index of refraction.
    ior: float = 1.5
    transmission: float = 0.0
    #: Whether the surface bounds a volume, which refracts, or is a thin wall.
    volume: bool = False
    #: Emitted radiance of the front, a number or RGB.
    emission: Union[float, Sequence[float]] = 0.0
    #: Whether both sides emit, and neither is hidden by ``cull_backfaces``.
    double_sided: bool = False
    name: str = ""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of one material. Lengths in metres, y upwards."""

    #: Vertices, (n, 3) float.
    positions: ArrayLike
    #: Indices of vertices, (m, 3) int, counter-clockwise as seen from the front; None for every three in a row.
    triangles: Optional[ArrayLike] = None
    material: Material = field(default_factory=Material)
    #: Shading normals, (n, 3) float, or None for flat triangles.
    normals: Optional[ArrayLike] = None
    name: str = ""


@dataclass(frozen=True)
class PointLamp:
    """A point that shines alike in all directions, never seen itself. The intensity is in W/sr (or candela)."""

    position: ArrayLike
    intensity: Union[float, Sequence[float]]


@dataclass(frozen=True)
class SpotLamp:
    """A point that shines into a cone along a direction: fully up to the half angle ``inner``, in degrees, and not
    beyond ``outer``."""

    position: ArrayLike
    direction: ArrayLike
    intensity: Union[float, Sequence[float]]
    inner: float = 0.0
    outer: float = 45.0


@dataclass(frozen=True)
class Sun:
    """Parallel light that travels along a direction. The irradiance of a surface that faces it is in W/m² (or lux)."""

    direction: ArrayLike
    irradiance: Union[float, Sequence[float]]


Lamp = Union[PointLamp, SpotLamp, Sun]


@dataclass(frozen=True)
class Camera:
    """A pinhole at ``position`` that looks at ``target``."""

    position: ArrayLike
    target: ArrayLike
    up: ArrayLike = (0.0, 1.0, 0.0)
    #: The vertical field of view, degrees.
    yfov: float = 45.0
    #: Width over height of the image, where a render is told one of them alone.
    aspect: float = 4.0 / 3.0


def array(what: str, values: ArrayLike, shape: tuple[Optional[int], ...]) -> NDArray[np.float64]:
    """Finite numbers of this shape, of which None is any length. Raises TypeError for what is no number."""
    result = _numbers(what, values).astype(np.float64)
    fits = result.ndim == len(shape) and all(want in (None, got) for want, got in zip(shape, result.shape))
    if not fits:
        wanted = ", ".join("n" if length is None else str(length) for length in shape)
        raise UsageError(f"{what} has the shape {result.shape}, and ({wanted}{',' * (len(shape) == 1)}) is needed")
    if not np.isfinite(result).all():
        raise UsageError(f"{what} holds numbers that are not finite")
    return result


def _numbers(what: str, values: ArrayLike) -> NDArray[Any]:
    """An array of real numbers, of whatever type and shape."""
    if np.ma.is_masked(values):
        raise TypeError(f"{what} has numbers that are masked")
    try:
        result = np.asarray(values)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{what} is no array of numbers: {error}") from None
    if result.dtype.kind not in "biuf":
        raise TypeError(f"{what} is no array of numbers, but of {result.dtype}")
    return result


def _number(what: str, value: object) -> float:
    """One finite number."""
    if isinstance(value, (str, bytes)) or np.ndim(value) != 0:  # type: ignore[arg-type]
        raise TypeError(f"{what} is a number, not {value!r}")
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise TypeError(f"{what} is a number, not {value!r}") from None
    if not np.isfinite(number):
        raise UsageError(f"{what} is not finite")
    return number


def _part(what: str, value: object) -> float:
    """A number in [0, 1]."""
    number = _number(what, value)
    if not 0.0 <= number <= 1.0:
        raise UsageError(f"{what} is between 0 and 1, not {number}")
    return number


def _flag(what: str, value: object) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{what} is True or False, not {value!r}")
    return bool(value)


def vector(what: str, values: ArrayLike) -> tuple[float, float, float]:
    """A vector (3,)."""
    x, y, z = array(what, values, (3,)).tolist()
    return (x, y, z)


def _unit(what: str, values: ArrayLike) -> NDArray[np.float64]:
    v = array(what, values, (3,))
    length = float(np.linalg.norm(v))
    if length == 0.0:
        raise UsageError(f"{what} has no direction: all of it is zero")
    return v / length


def _color(what: str, values: Union[float, Sequence[float]]) -> NDArray[np.float64]:
    v = _numbers(what, values)
    v = array(what, np.repeat(v, 3) if v.ndim == 0 else v, (3,))
    if (v < 0.0).any():
        raise UsageError(f"{what} has negative numbers")
    return v


def glb(meshes: Sequence[Mesh], lamps: Sequence[Lamp], camera: Optional[Camera]) -> bytes:
    """The file of a scene."""
    file = _File()
    for i, mesh in enumerate(meshes):
        if not isinstance(mesh, Mesh):
            raise TypeError(f"a scene is made of Mesh, not {mesh!r}")
        file.add_mesh(mesh.name or f"mesh {i}", mesh)
    for i, lamp in enumerate(lamps):
        file.add_lamp(f"lamp {i}", lamp)
    if camera is not None:
        file.add_camera(camera)
    return file.encoded()


class _File:
    """A glTF document and its buffer, as they grow."""

    def __init__(self) -> None:
        self.nodes: list[dict[str, Any]] = []
        self.json: dict[str, Any] = {"asset": {"version": "2.0", "generator": "pathspace for Python"}}
        self.buffer = b""
        self.extensions: set[str] = set()

    def _append(self, list_name: str, item: dict[str, Any]) -> int:
        items: list[dict[str, Any]] = self.json.setdefault(list_name, [])
        items.append(item)
        return len(items) - 1

    def _extension(self, name: str, item: dict[str, Any]) -> dict[str, Any]:
        self.extensions.add(name)
        return {name: item}

    def _accessor(self, numbers: NDArray[Any], kind: str, **more: object) -> int:
        data = numbers.tobytes()
        view = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data)}
        self.buffer += data
        component = {"f": 5126, "u": 5125}[numbers.dtype.kind]
        accessor = {"bufferView": self._append("bufferViews", view), "componentType": component, "type": kind}
        count = len(numbers) if kind == "VEC3" else numbers.size
        return self._append("accessors", {**accessor, "count": count, **more})

    def add_mesh(self, name: str, mesh: Mesh) -> None:
        with np.errstate(over="ignore"):
            positions = array(f"{name}: positions", mesh.positions, (None, 3)).astype("<f4")
        if len(positions) == 0 or not np.isfinite(positions).all():
            raise UsageError(f"{name}: positions has no vertices, or some beyond what 32-bit floats hold")
        counted = np.arange(len(positions))
        triangles = counted if mesh.triangles is None else _numbers(f"{name}: triangles", mesh.triangles)
        if mesh.triangles is None and len(positions) % 3 != 0:
            raise UsageError(f"{name}: positions has {len(positions)} vertices, not three for each triangle")
        if mesh.triangles is not None:
            if triangles.dtype.kind not in "iu" and triangles.size > 0:
                raise TypeError(f"{name}: triangles are integers, not {triangles.dtype}")
            array(f"{name}: triangles", triangles, (None, 3))
        if len(triangles) == 0 or triangles.min() < 0 or triangles.max() >= len(positions):
            raise UsageError(f"{name}: triangles has none, or vertices that are not among 0 … {len(positions) - 1}")
        bounds = {"min": positions.min(0).tolist(), "max": positions.max(0).tolist()}
        attributes = {"POSITION": self._accessor(positions, "VEC3", **bounds)}
        if mesh.normals is not None:
            normals = array(f"{name}: normals", mesh.normals, (len(positions), 3))
            lengths = np.linalg.norm(normals, axis=1, keepdims=True)
            if (lengths == 0.0).any():
                raise UsageError(f"{name}: normals has vectors of length zero")
            attributes["NORMAL"] = self._accessor((normals / lengths).astype("<f4"), "VEC3")
        indices = self._accessor(triangles.astype("<u4").ravel(), "SCALAR")
        primitive = {"attributes": attributes, "indices": indices, "material": self._material(name, mesh.material)}
        self.nodes.append({"name": name, "mesh": self._append("meshes", {"name": name, "primitives": [primitive]})})

    def _material(self, mesh: str, material: Material) -> int:
        if not isinstance(material, Material):
            raise TypeError(f"{mesh}: its material is a Material, not {material!r}")
        color = _color(f"{mesh}: base_color", material.base_color)
        emission = _color(f"{mesh}: emission", material.emission)
        strength = float(emission.max())
        names = ("metallic", "roughness", "specular", "transmission")
        metallic, roughness, specular, transmission = (
            _part(f"{mesh}: {name}", getattr(material, name)) for name in names
        )
        ior = _number(f"{mesh}: ior", material.ior)
        if ior < 1.0 and ior != 0.0:
            raise UsageError(f"{mesh}: ior is at least 1, or 0 for a mirror under any angle, not {ior}")
        extensions = {
            **self._extension("KHR_materials_specular", {"specularFactor": specular}),
            **self._extension("KHR_materials_ior", {"ior": ior}),
        }
        if transmission > 0.0:
            factor = {"transmissionFactor": transmission}
            extensions.update(self._extension("KHR_materials_transmission", factor))
        if _flag(f"{mesh}: volume", material.volume):
            extensions.update(self._extension("KHR_materials_volume", {"thicknessFactor": 1.0}))
        if strength > 1.0:
            factor = {"emissiveStrength": strength}
            extensions.update(self._extension("KHR_materials_emissive_strength", factor))
        surface = {"metallicFactor": metallic, "roughnessFactor": roughness}
        described = {
            "name": material.name or f"material of {mesh}",
            "pbrMetallicRoughness": {"baseColorFactor": [*color.tolist(), 1.0], **surface},
            "emissiveFactor": (emission / max(strength, 1.0)).tolist(),
            "doubleSided": _flag(f"{mesh}: double_sided", material.double_sided),
            "extensions": extensions,
        }
        return self._append("materials", described)

    def add_lamp(self, name: str, lamp: Lamp) -> None:
        node: dict[str, Any] = {"name": name}
        light: dict[str, Any]
        if isinstance(lamp, Sun):
            color, light = _color(f"{name}: irradiance", lamp.irradiance), {"type": "directional"}
        elif isinstance(lamp, SpotLamp):
            color = _color(f"{name}: intensity", lamp.intensity)
            degrees = [_number(f"{name}: {which}", getattr(lamp, which)) for which in ("inner", "outer")]
            if not 0.0 <= degrees[0] <= degrees[1] <= 90.0 or degrees[1] == 0.0:
                needed = "0 ≤ inner ≤ outer ≤ 90 degrees, and an outer above 0"
                raise UsageError(f"{name}: {needed} are needed, not {degrees}")
            inner, outer = np.radians(degrees).tolist()
            light = {"type": "spot", "spot": {"innerConeAngle": inner, "outerConeAngle": outer}}
        elif isinstance(lamp, PointLamp):
            color, light = _color(f"{name}: intensity", lamp.intensity), {"type": "point"}
        else:
            raise TypeError(f"a lamp is a PointLamp, a SpotLamp or a Sun, not {lamp!r}")
        if not isinstance(lamp, Sun):
            node["translation"] = vector(f"{name}: position", lamp.position)
        if not isinstance(lamp, PointLamp):
            node["rotation"] = _rotation(-_unit(f"{name}: direction", lamp.direction))
        strength = float(color.max())
        described = {**light, "intensity": strength, "color": (color / (strength or 1.0)).tolist()}
        lights = self.json.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        lights.append(described)
        node["extensions"] = self._extension("KHR_lights_punctual", {"light": len(lights) - 1})
        self.nodes.append(node)

    def add_camera(self, camera: Camera) -> None:
        if not isinstance(camera, Camera):
            raise TypeError(f"the camera is a Camera, not {camera!r}")
        position = array("camera: position", camera.position, (3,))
        back = _unit("camera: target minus position", position - array("camera: target", camera.target, (3,)))
        right = np.cross(array("camera: up", camera.up, (3,)), back)
        if np.linalg.norm(right) < 1e-6:
            raise UsageError("camera: it looks along its up direction")
        right /= np.linalg.norm(right)
        columns = np.eye(4)
        columns[:3, 0], columns[:3, 1], columns[:3, 2], columns[:3, 3] = right, np.cross(back, right), back, position
        yfov = _number("camera: yfov", camera.yfov)
        if not 0.0 < yfov < 180.0:
            raise UsageError(f"camera: yfov is above 0 and below 180 degrees, not {yfov}")
        if (aspect := _number("camera: aspect", camera.aspect)) <= 0.0:
            raise UsageError(f"camera: aspect is above 0, not {aspect}")
        view = {"yfov": float(np.radians(yfov)), "aspectRatio": aspect, "znear": 0.01}
        index = self._append("cameras", {"type": "perspective", "perspective": view, "name": "camera"})
        self.nodes.append({"name": "camera", "camera": index, "matrix": columns.T.ravel().tolist()})

    def encoded(self) -> bytes:
        """Both chunks of a .glb file."""
        document = {**self.json, "nodes": self.nodes, "scene": 0, "scenes": [{"nodes": list(range(len(self.nodes)))}]}
        if not self.nodes:
            raise UsageError("there is nothing in the scene")
        if self.extensions:
            document["extensionsUsed"] = sorted(self.extensions)
        if self.buffer:
            document["buffers"] = [{"byteLength": len(self.buffer)}]
        text = json.dumps(document, allow_nan=False).encode()
        chunks = [(b"JSON", text + b" " * (-len(text) % 4))]
        if self.buffer:
            chunks.append((b"BIN\0", self.buffer))
        body = b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks)
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _rotation(z: NDArray[np.float64]) -> list[float]:
    """The unit quaternion x, y, z, w that turns +z to the unit vector ``z``."""
    w = 1.0 + float(z[2])
    if w < 1e-12:
        return [1.0, 0.0, 0.0, 0.0]
    q = np.array([-z[1], z[0], 0.0, w])
    return [float(x) for x in q / np.linalg.norm(q)]
