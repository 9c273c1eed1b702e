"""The four scenes, and four of the project's own, as meshes, and how each renderer is told about them.

Units are metres, y is up. Materials: ("diffuse", rgb), ("glass", ior), ("mirror", reflectance), ("lamp", radiance), which shines from its
front and is otherwise black, or ("gltf", a material's JSON), of which only pathspace is told. Images have SIDE × SIDE pixels, paths at most MAX_DEPTH edges.
"""

import functools
import json
import math
import os
import struct
from dataclasses import dataclass, field

import numpy as np

SIDE = 256
MAX_DEPTH = 12
WHITE, RED, GREEN, GRAY = (0.73, 0.73, 0.73), (0.65, 0.05, 0.05), (0.12, 0.45, 0.15), (0.5, 0.5, 0.5)


@dataclass
class Mesh:
    name: str
    material: str
    positions: np.ndarray  # (vertices, 3)
    triangles: np.ndarray  # (triangles, 3), counter-clockwise from the front
    normals: np.ndarray | None = None  # of smooth meshes
    uv: np.ndarray | None = None
    tangents: np.ndarray | None = None  # (vertices, 4), as glTF has them


@dataclass
class Ball:
    """An analytic sphere, which pathspace alone is told about."""

    name: str
    material: str
    center: tuple
    radius: float


@dataclass
class Camera:
    origin: tuple
    target: tuple
    fov: float  # degrees, of the square image


@dataclass
class Scene:
    name: str
    camera: Camera
    materials: dict
    meshes: list
    balls: list = field(default_factory=list)


def quads(name, material, corners):
    """A mesh of quadrilaterals, each of four corners."""
    positions = np.array(corners, np.float32).reshape(-1, 3)
    first = 4 * np.arange(len(positions) // 4)[:, None]
    triangles = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]], 1).reshape(-1, 3)
    return Mesh(name, material, positions, triangles.astype(np.int32))


def block(name, material, low, high):
    """An axis-aligned box with outward normals."""
    (a, b, c), (x, y, z) = low, high
    return quads(name, material, [
        [(a, b, c), (x, b, c), (x, b, z), (a, b, z)], [(a, y, c), (a, y, z), (x, y, z), (x, y, c)],
        [(a, b, c), (a, y, c), (x, y, c), (x, b, c)], [(a, b, z), (x, b, z), (x, y, z), (a, y, z)],
        [(a, b, c), (a, b, z), (a, y, z), (a, y, c)], [(x, b, c), (x, y, c), (x, y, z), (x, b, z)],
    ])


def sphere(name, material, center, radius, level):
    """An icosahedron, each triangle split in four `level` times, with smooth normals."""
    g = (1 + 5**0.5) / 2
    corners = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = "0 11 5,0 5 1,0 1 7,0 7 10,0 10 11,1 5 9,5 11 4,11 10 2,10 7 6,7 1 8,3 9 4,3 4 2,3 2 6,3 6 8,3 8 9,4 9 5,2 4 11,6 2 10,8 6 7,9 8 1"
    n = np.array(corners, float) / np.linalg.norm(corners[0])
    t = np.array([[int(i) for i in face.split()] for face in faces.split(",")])
    for _ in range(level):
        edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
        unique, of = np.unique(edges, axis=0, return_inverse=True)
        middle = n[unique[:, 0]] + n[unique[:, 1]]
        a, b, c = len(n) + of.reshape(3, -1)
        n = np.concatenate([n, middle / np.linalg.norm(middle, axis=1, keepdims=True)])
        p, q, r = t.T
        t = np.concatenate([np.stack(x, 1) for x in [(p, a, c), (q, b, a), (r, c, b), (a, b, c)]])
    return Mesh(name, material, (np.array(center) + radius * n).astype(np.float32), t.astype(np.int32), n.astype(np.float32))


def ring(name, material, inner, outer, height, segments):
    """An upright band on the floor: an outer and an inner wall with smooth normals, and a flat top."""
    angle = np.arange(segments) * 2 * np.pi / segments
    c, s, zero, one = np.cos(angle), np.sin(angle), np.zeros(segments), np.ones(segments)
    rims = [(outer, 0, (c, zero, s)), (outer, height, (c, zero, s)), (inner, 0, (-c, zero, -s)), (inner, height, (-c, zero, -s)),
            (outer, height, (zero, one, zero)), (inner, height, (zero, one, zero))]
    positions = np.concatenate([np.stack([r * c, np.full(segments, y), r * s], 1) for r, y, _ in rims])
    normals = np.concatenate([np.stack(normal, 1) for *_, normal in rims])
    i, j = np.arange(segments), (np.arange(segments) + 1) % segments

    def band(low, high, turned):
        corners = [low * segments + i, high * segments + i, high * segments + j, low * segments + j][:: -1 if turned else 1]
        return np.concatenate([np.stack([corners[0], corners[k], corners[k + 1]], 1) for k in (1, 2)])

    triangles = np.concatenate([band(0, 1, False), band(2, 3, True), band(4, 5, False)])
    return Mesh(name, material, positions.astype(np.float32), triangles.astype(np.int32), normals.astype(np.float32))


X, Y, Z = 5.528, 5.488, 5.592
BOX_CAMERA = Camera((2.78, 2.73, -8.0), (2.78, 2.73, 0.0), 39.3077)
BOX_MATERIALS = {"white": ("diffuse", WHITE), "red": ("diffuse", RED), "green": ("diffuse", GREEN)}


def box_walls():
    return [
        quads("floor", "white", [[(0, 0, 0), (0, 0, Z), (X, 0, Z), (X, 0, 0)]]),
        quads("ceiling", "white", [[(0, Y, 0), (X, Y, 0), (X, Y, Z), (0, Y, Z)]]),
        quads("back", "white", [[(0, 0, Z), (0, Y, Z), (X, Y, Z), (X, 0, Z)]]),
        quads("right", "green", [[(0, 0, 0), (0, Y, 0), (0, Y, Z), (0, 0, Z)]]),
        quads("left", "red", [[(X, 0, 0), (X, 0, Z), (X, Y, Z), (X, Y, 0)]]),
    ]


def ceiling_lamp(x0, x1, z0, z1):
    y = Y - 0.002
    return quads("lamp", "lamp", [[(x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1)]])


def cornell():
    """The Cornell box with its two blocks."""
    meshes = box_walls()
    for name, base, h in [("short", [(1.30, 0.65), (0.82, 2.25), (2.40, 2.72), (2.90, 1.14)], 1.65),
                          ("tall", [(4.23, 2.47), (2.65, 2.96), (3.14, 4.56), (4.72, 4.06)], 3.30)]:
        sides = [[(xa, h, za), (xa, 0, za), (xb, 0, zb), (xb, h, zb)] for (xa, za), (xb, zb) in zip(base, base[1:] + base[:1])]
        meshes.append(quads(name, "white", [[(x, h, z) for x, z in base], *sides]))
    meshes.append(ceiling_lamp(2.13, 3.43, 2.27, 3.32))
    return Scene("cornell", BOX_CAMERA, {**BOX_MATERIALS, "lamp": ("lamp", (17.0, 12.0, 4.0))}, meshes)


def caustic_glass():
    """The Cornell box with a glass ball of 81,920 triangles below a lamp of a tenth of its side."""
    h = X / 20
    meshes = [*box_walls(), sphere("ball", "glass", (2.764, 1.5, 2.6), 1.0, 6), ceiling_lamp(X / 2 - h, X / 2 + h, Z / 2 - h, Z / 2 + h)]
    return Scene("caustic-glass", BOX_CAMERA, {**BOX_MATERIALS, "glass": ("glass", 1.5), "lamp": ("lamp", (76.0, 60.0, 30.0))}, meshes)


def caustic_small():
    """A mirror ring on a floor, lit by a lamp of two centimetres."""
    place = np.array([2.2, 2.8, 0.8])
    towards = -place / np.linalg.norm(place)
    u = np.cross(towards, (0, 1, 0))
    u *= 0.01 / np.linalg.norm(u)
    v = np.cross(towards, u)
    lamp = [place - u - v, place + u - v, place + u + v, place - u + v]
    if np.dot(np.cross(lamp[1] - lamp[0], lamp[2] - lamp[0]), towards) < 0:
        lamp.reverse()
    meshes = [quads("floor", "gray", [[(-6, 0, -6), (-6, 0, 6), (6, 0, 6), (6, 0, -6)]]), ring("ring", "mirror", 0.95, 1.0, 0.5, 512), quads("lamp", "lamp", [lamp])]
    materials = {"gray": ("diffuse", GRAY), "mirror": ("mirror", 1.0), "lamp": ("lamp", (6e4, 6e4, 6e4))}
    return Scene("caustic-small", Camera((0.0, 3.4, -4.2), (0.0, 0.0, 0.0), 38.0), materials, meshes)


def indirect():
    """A room whose far half has a shaded lamp that shines at the ceiling, seen from the near half through a doorway."""
    w, h, d, z, t = 6.0, 3.0, 6.0, 3.0, 0.1
    left, right, top = 3.6, 4.5, 2.3
    meshes = [
        quads("floor", "white", [[(0, 0, 0), (0, 0, d), (w, 0, d), (w, 0, 0)]]),
        quads("ceiling", "white", [[(0, h, 0), (w, h, 0), (w, h, d), (0, h, d)]]),
        quads("far", "white", [[(0, 0, d), (0, h, d), (w, h, d), (w, 0, d)]]),
        quads("near", "white", [[(0, 0, 0), (w, 0, 0), (w, h, 0), (0, h, 0)]]),
        quads("right", "green", [[(0, 0, 0), (0, h, 0), (0, h, d), (0, 0, d)]]),
        quads("left", "red", [[(w, 0, 0), (w, 0, d), (w, h, d), (w, h, 0)]]),
        block("wall-a", "white", (0, 0, z), (left, h, z + t)),
        block("wall-b", "white", (right, 0, z), (w, h, z + t)),
        block("wall-c", "white", (left, top, z), (right, h, z + t)),
        block("crate", "white", (1.2, 0, 1.6), (2.1, 0.9, 2.4)),
    ]
    x, z, r, low, high, e = 1.6, 4.6, 0.15, 1.4, 1.8, 0.02
    shade = [((x - r - e, low, z - r), (x - r, high, z + r)), ((x + r, low, z - r), (x + r + e, high, z + r)), ((x - r, low, z - r - e), (x + r, high, z - r)),
             ((x - r, low, z + r), (x + r, high, z + r + e)), ((x - r, low - e, z - r), (x + r, low, z + r))]
    meshes += [block(f"shade-{i}", "white", *corners) for i, corners in enumerate(shade)]
    e, y = 0.10, low + 0.01
    meshes.append(quads("lamp", "lamp", [[(x - e, y, z - e), (x - e, y, z + e), (x + e, y, z + e), (x + e, y, z - e)]]))
    materials = {"white": ("diffuse", WHITE), "red": ("diffuse", RED), "green": ("diffuse", GREEN), "lamp": ("lamp", (800.0, 700.0, 500.0))}
    return Scene("indirect", Camera((3.0, 1.5, 0.05), (3.0, 1.25, 3.0), 75.0), materials, meshes)


def committed(name):
    """A scene of `scenes/` made of what every renderer here knows, in a square image: its balls become 81,920 triangles."""
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "scenes", f"{name}.glb"), "rb") as file:
        content = file.read()
    length = struct.unpack_from("<I", content, 12)[0]
    document, data = json.loads(content[20 : 20 + length]), content[28 + length :]

    def material(m):
        pbr, extensions = m["pbrMetallicRoughness"], m.get("extensions", {})
        if strength := extensions.get("KHR_materials_emissive_strength"):
            return "lamp", tuple(x * strength["emissiveStrength"] for x in m["emissiveFactor"])
        if "KHR_materials_transmission" in extensions:
            return "glass", extensions["KHR_materials_ior"]["ior"]
        if pbr["metallicFactor"] == 1.0 and pbr["roughnessFactor"] == 0.0:
            return "mirror", pbr["baseColorFactor"][0]
        assert extensions["KHR_materials_specular"] == {"specularFactor": 0.0}, m
        return "diffuse", tuple(pbr["baseColorFactor"][:3])

    def array(index):
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        kind, width = {5126: "<f4", 5123: "<u2", 5125: "<u4"}[accessor["componentType"]], {"VEC3": 3, "SCALAR": 1}[accessor["type"]]
        return np.frombuffer(data, kind, accessor["count"] * width, view.get("byteOffset", 0) + accessor.get("byteOffset", 0)).reshape(-1, width)

    plain = lambda name: name.replace(" ", "-")
    names = [plain(m["name"]) for m in document["materials"]]
    meshes, camera = [], None
    for node in document["nodes"]:
        ball = node.get("extensions", {}).get("PATHSPACE_sphere")
        if "camera" in node:
            m = np.array(node["matrix"]).reshape(4, 4)
            fov = math.degrees(document["cameras"][node["camera"]]["perspective"]["yfov"])
            camera = Camera(tuple(m[3, :3]), tuple(m[3, :3] - m[2, :3]), fov)
        elif ball:
            meshes.append(sphere(plain(node["name"]), names[ball["material"]], node["translation"], ball["radius"], 6))
        else:
            assert not {"matrix", "translation", "rotation", "scale"} & node.keys(), node
            for i, primitive in enumerate(document["meshes"][node["mesh"]]["primitives"]):
                positions = array(primitive["attributes"]["POSITION"])
                normals = array(primitive["attributes"]["NORMAL"]) if "NORMAL" in primitive["attributes"] else None
                triangles = array(primitive["indices"]).reshape(-1, 3).astype(np.int32)
                meshes.append(Mesh(f"{plain(node['name'])}-{i}", names[primitive["material"]], positions, triangles, normals))
    return Scene(name, camera, {plain(m["name"]): material(m) for m in document["materials"]}, meshes)


SCENES = {"cornell": cornell, "caustic-glass": caustic_glass, "caustic-small": caustic_small, "indirect": indirect}
SCENES |= {name: functools.partial(committed, name) for name in ("cornell-spheres", "veach-room", "pool", "bulb")}


# For pathspace: GLB.


def gltf_material(name, kind, value):
    if kind == "gltf":
        return {"name": name, **value}
    pbr = {"metallicFactor": 0.0, "roughnessFactor": 1.0, "baseColorFactor": [0.0, 0.0, 0.0, 1.0]}
    extensions, material = {}, {"name": name, "pbrMetallicRoughness": pbr}
    if kind in ("diffuse", "lamp"):
        extensions["KHR_materials_specular"] = {"specularFactor": 0.0}  # Lambert's law and nothing else
    if kind == "diffuse":
        pbr["baseColorFactor"] = [*value, 1.0]
        material["doubleSided"] = True
    elif kind == "lamp":
        material["emissiveFactor"] = [x / max(value) for x in value]
        extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": max(value)}
    elif kind == "mirror":
        pbr.update(metallicFactor=1.0, roughnessFactor=0.0, baseColorFactor=[value, value, value, 1.0])
        material["doubleSided"] = True
    elif kind == "glass":
        pbr.update(roughnessFactor=0.0, baseColorFactor=[1.0, 1.0, 1.0, 1.0])
        extensions.update(KHR_materials_transmission={"transmissionFactor": 1.0}, KHR_materials_ior={"ior": value},
                          KHR_materials_volume={"thicknessFactor": 1.0})
    return {**material, "extensions": extensions} if extensions else material


def camera_matrix(camera):
    """Column by column, as glTF has it: x to the right, y up, z backwards."""
    origin, target = np.array(camera.origin), np.array(camera.target)
    z = (origin - target) / np.linalg.norm(origin - target)
    x = np.cross((0, 1, 0), z)
    x /= np.linalg.norm(x)
    columns = [(*x, 0), (*np.cross(z, x), 0), (*z, 0), (*origin, 1)]
    return [float(v) for column in columns for v in column]


def write_glb(scene, path):
    data, views, accessors = b"", [], []
    materials = list(scene.materials)

    def accessor(array, component, kind):
        nonlocal data
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        data += array.tobytes()
        extent = {"min": array.min(0).tolist(), "max": array.max(0).tolist()} if kind == "VEC3" else {}
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind, **extent})
        return len(accessors) - 1

    meshes = []
    for mesh in scene.meshes:
        attributes = {"POSITION": accessor(mesh.positions, 5126, "VEC3")}
        if mesh.normals is not None:
            attributes["NORMAL"] = accessor(mesh.normals, 5126, "VEC3")
        if mesh.uv is not None:
            attributes["TEXCOORD_0"] = accessor(mesh.uv, 5126, "VEC2")
        if mesh.tangents is not None:
            attributes["TANGENT"] = accessor(mesh.tangents, 5126, "VEC4")
        indices = accessor(mesh.triangles.astype("<u4").ravel(), 5125, "SCALAR")
        meshes.append({"name": mesh.name, "primitives": [{"attributes": attributes, "indices": indices, "material": materials.index(mesh.material)}]})
    nodes = [{"name": mesh.name, "mesh": i} for i, mesh in enumerate(scene.meshes)]
    for ball in scene.balls:
        extension = {"radius": ball.radius, "material": materials.index(ball.material)}
        nodes.append({"name": ball.name, "translation": list(ball.center), "extensions": {"PATHSPACE_sphere": extension}})
    nodes.append({"name": "camera", "camera": 0, "matrix": camera_matrix(scene.camera)})
    described = [gltf_material(name, *scene.materials[name]) for name in materials]
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes, "meshes": meshes,
        "materials": described, "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(data)}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": math.radians(scene.camera.fov), "aspectRatio": 1.0, "znear": 0.01}}],
        "extensionsUsed": sorted({name for thing in described + nodes for name in thing.get("extensions", {})}),
    }
    if not meshes:
        for key in ("meshes", "accessors", "bufferViews", "buffers"):  # glTF has no empty arrays
            del document[key]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as out:
        out.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data)))
        out.write(struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data)


# For Mitsuba and LuxCore: PLY, and a dictionary or properties.


def write_ply(mesh, path):
    columns = [mesh.positions] + ([] if mesh.normals is None else [mesh.normals])
    names = ["x", "y", "z"] + ([] if mesh.normals is None else ["nx", "ny", "nz"])
    faces = np.empty(len(mesh.triangles), [("corners", "u1"), ("indices", "<i4", 3)])
    faces["corners"], faces["indices"] = 3, mesh.triangles
    properties = "".join(f"property float {name}\n" for name in names)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.positions)}\n{properties}element face {len(faces)}\n"
    with open(path, "wb") as out:
        out.write((head + "property list uchar int vertex_indices\nend_header\n").encode())
        out.write(np.concatenate(columns, 1).astype("<f4").tobytes() + faces.tobytes())


def mitsuba_scene(scene, folder, integrator):
    import mitsuba as mi

    camera = scene.camera
    to_world = mi.ScalarTransform4f().look_at(origin=list(camera.origin), target=list(camera.target), up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": SIDE, "height": SIDE, "pixel_format": "rgb", "component_format": "float32", "rfilter": {"type": "box"}}
    result = {
        "type": "scene", "integrator": {"type": integrator, "max_depth": MAX_DEPTH},
        "sensor": {"type": "perspective", "fov": camera.fov, "near_clip": 0.01, "far_clip": 1000.0, "to_world": to_world, "film": film,
                   "sampler": {"type": "independent"}},
    }
    colour = lambda value: {"type": "rgb", "value": list(value)}
    for name, (kind, value) in scene.materials.items():
        bsdf = {
            "diffuse": lambda: {"type": "twosided", "inner": {"type": "diffuse", "reflectance": colour(value)}},
            "glass": lambda: {"type": "dielectric", "int_ior": value, "ext_ior": 1.0},
            "mirror": lambda: {"type": "twosided", "inner": {"type": "conductor", "material": "none", "specular_reflectance": colour([value] * 3)}},
            "lamp": lambda: {"type": "diffuse", "reflectance": colour([0.0] * 3)},
        }[kind]()
        result[f"material-{name}"] = {**bsdf, "id": f"material-{name}"}
    for mesh in scene.meshes:
        kind, value = scene.materials[mesh.material]
        shape = {"type": "ply", "filename": f"{folder}/{mesh.name}.ply", "face_normals": mesh.normals is None,
                 "bsdf": {"type": "ref", "id": f"material-{mesh.material}"}}
        if kind == "lamp":
            shape["emitter"] = {"type": "area", "radiance": colour(value)}
        result[f"shape-{mesh.name}"] = shape
    return result


def luxcore_scene(scene, folder):
    three = lambda value: " ".join(f"{x:g}" for x in value)
    camera = scene.camera
    lines = ["scene.camera.type = perspective", f"scene.camera.lookat.orig = {three(camera.origin)}", f"scene.camera.lookat.target = {three(camera.target)}",
             "scene.camera.up = 0 1 0", f"scene.camera.fieldofview = {camera.fov:g}", "scene.camera.autofocus.enable = 0", "scene.camera.lensradius = 0",
             "scene.camera.screenwindow = -1 1 -1 1"]
    for name, (kind, value) in scene.materials.items():
        described = {
            "diffuse": lambda: ["type = matte", f"kd = {three(value)}"],
            "glass": lambda: ["type = glass", "kr = 1 1 1", "kt = 1 1 1", f"interiorior = {value:g}", "exteriorior = 1"],
            "mirror": lambda: ["type = mirror", f"kr = {three([value] * 3)}"],
            "lamp": lambda: ["type = matte", "kd = 0 0 0", f"emission = {three(value)}"],
        }[kind]()
        lines += [f"scene.materials.{name}.{line}" for line in described]
    for mesh in scene.meshes:
        lines += [f"scene.shapes.{mesh.name}.type = mesh", f"scene.shapes.{mesh.name}.ply = {folder}/{mesh.name}.ply",
                  f"scene.objects.{mesh.name}.shape = {mesh.name}", f"scene.objects.{mesh.name}.material = {mesh.material}"]
    return "\n".join(lines) + "\n"
