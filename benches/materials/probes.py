"""Spheres of one material each, told to all renderers by the same numbers: glTF's, and those of Mitsuba's `principled` that mean the same."""

import os
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "peers"))
from scenes import Camera, Mesh, Scene, write_glb  # noqa: E402

CAMERA = Camera((0.0, 1.2, 4.4), (0.0, 0.0, 0.0), 29.0)
GOLD, RED, WHITE = [0.95, 0.64, 0.35], [0.7, 0.12, 0.08], [0.8, 0.8, 0.8]


def sphere(columns=192, rows=96):
    """A unit sphere with texture coordinates and tangents to the east; v = 0 at the top."""
    u, v = np.meshgrid(np.arange(columns + 1) / columns, np.arange(rows + 1) / rows)
    phi, theta = 2 * np.pi * u.ravel(), np.pi * v.ravel()
    n = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], 1)
    tangents = np.stack([np.cos(phi), 0 * phi, -np.sin(phi), 1 + 0 * phi], 1)
    i, j = (x.ravel() for x in np.meshgrid(np.arange(columns), np.arange(rows)))
    a = j * (columns + 1) + i
    b, c, d = a + columns + 1, a + columns + 2, a + 1
    # The triangles at the poles have one corner less than the quadrilaterals between.
    triangles = np.concatenate([np.stack([a, b, c], 1)[j < rows - 1], np.stack([a, c, d], 1)[j > 0]])
    float32 = lambda x: x.astype(np.float32)
    return Mesh("ball", "material", float32(n), triangles.astype(np.int32), float32(n), float32(np.stack([u.ravel(), v.ravel()], 1)), float32(tangents))


def pbr(colour, metallic, roughness, **extensions):
    """A material of glTF's metallic-roughness model, with KHR_materials_… extensions by the rest of their names."""
    material = {"pbrMetallicRoughness": {"baseColorFactor": [*colour, 1.0], "metallicFactor": metallic, "roughnessFactor": roughness}}
    if extensions:
        material["extensions"] = {f"KHR_materials_{name}": value for name, value in extensions.items()}
    return material


def principled(colour, metallic, roughness, **others):
    """Mitsuba's: `specular` 0.5 is the index 1.5."""
    rgb = {"type": "rgb", "value": colour}
    return {"type": "principled", "base_color": rgb, "metallic": metallic, "roughness": roughness, "specular": 0.5, **others}


def brushed(roughness, strength):
    """The roughness and `anisotropic` of `principled` whose α are α_y = roughness² and α_x = mix(α_y, 1, strength²)."""
    y = roughness**2
    x = y + (1 - y) * strength**2
    return (x * y) ** 0.25, (1 - y / x) / 0.9


def metal(roughness):
    return pbr(GOLD, 1.0, roughness), principled(GOLD, 1.0, roughness)


def grain(roughness, strength, rotation):
    rough, anisotropic = brushed(roughness, strength)
    gltf = pbr(GOLD, 1.0, roughness, anisotropy={"anisotropyStrength": strength, "anisotropyRotation": rotation})
    # Mitsuba's has no rotation, and no more than 0.9 of its own measure.
    return gltf, principled(GOLD, 1.0, rough, anisotropic=anisotropic) if rotation == 0.0 and anisotropic <= 1.0 else None


def glass(roughness, colour=(1.0, 1.0, 1.0), distance=None):
    volume = {"thicknessFactor": 1.0}
    if distance:
        volume |= {"attenuationDistance": distance, "attenuationColor": [0.9, 0.5, 0.3]}
    gltf = pbr(colour, 0.0, roughness, transmission={"transmissionFactor": 1.0}, volume=volume, ior={"ior": 1.5})
    plain = {"type": "dielectric", "int_ior": 1.5} if roughness == 0 else {"type": "roughdielectric", "distribution": "ggx", "alpha": roughness**2, "int_ior": 1.5}
    return gltf, plain if tuple(colour) == (1.0, 1.0, 1.0) and not distance else None


def layer(colour, metallic, roughness, **extensions):
    return pbr(colour, metallic, roughness, **extensions), None


def legacy(diffuse, specular, glossiness):
    model = {"diffuseFactor": [*diffuse, 1.0], "specularFactor": specular, "glossinessFactor": glossiness}
    return {"extensions": {"KHR_materials_pbrSpecularGlossiness": model}}, None


# Name: the material of glTF, and Mitsuba's or None.
PROBES = {
    "diffuse": (pbr(WHITE, 0.0, 1.0, specular={"specularFactor": 0.0}), {"type": "diffuse", "reflectance": {"type": "rgb", "value": WHITE}}),
    "mirror": (pbr([1.0] * 3, 1.0, 0.0), {"type": "conductor", "material": "none"}),
    "metal-0.3": metal(0.3),
    "metal-0.6": metal(0.6),
    "metal-1": metal(1.0),
    "dielectric-0.1": (pbr(RED, 0.0, 0.1), {"type": "plastic", "diffuse_reflectance": {"type": "rgb", "value": RED}, "int_ior": 1.5, "nonlinear": False}),
    "dielectric-0.5": (pbr(RED, 0.0, 0.5), principled(RED, 0.0, 0.5)),
    "dielectric-1": (pbr(RED, 0.0, 1.0), principled(RED, 0.0, 1.0)),
    "ior-2": layer(RED, 0.0, 0.2, ior={"ior": 2.0}),
    "specular-half": layer(RED, 0.0, 0.2, specular={"specularFactor": 0.5}),
    "specular-colour": layer(RED, 0.0, 0.2, specular={"specularColorFactor": [0.2, 1.0, 0.4]}),
    "grain-0.3-0.7": grain(0.3, 0.7, 0.0),
    "grain-0.3-0.7-45": grain(0.3, 0.7, np.pi / 4),
    "grain-0.3-0.7-90": grain(0.3, 0.7, np.pi / 2),
    "grain-0.5-0.5": grain(0.5, 0.5, 0.0),
    "coat-red": layer(RED, 0.0, 0.6, clearcoat={"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.1}),
    "coat-half-red": layer(RED, 0.0, 0.6, clearcoat={"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.1}),
    "coat-rough-gold": layer(GOLD, 1.0, 0.3, clearcoat={"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.5}),
    "sheen-black-0.3": layer([0.0] * 3, 0.0, 1.0, specular={"specularFactor": 0.0}, sheen={"sheenColorFactor": [1.0] * 3, "sheenRoughnessFactor": 0.3}),
    "sheen-black-0.7": layer([0.0] * 3, 0.0, 1.0, specular={"specularFactor": 0.0}, sheen={"sheenColorFactor": [1.0] * 3, "sheenRoughnessFactor": 0.7}),
    "sheen-red-0.5": layer(RED, 0.0, 1.0, sheen={"sheenColorFactor": [0.6] * 3, "sheenRoughnessFactor": 0.5}),
    "film-metal-300": layer(GOLD, 1.0, 0.2, iridescence={"iridescenceFactor": 1.0, "iridescenceIor": 1.5, "iridescenceThicknessMaximum": 300.0}),
    "film-black-500": layer([0.0] * 3, 0.0, 0.2, iridescence={"iridescenceFactor": 1.0, "iridescenceIor": 1.8, "iridescenceThicknessMaximum": 500.0}),
    "passage": layer(WHITE, 0.0, 1.0, specular={"specularFactor": 0.0}, diffuse_transmission={
        "diffuseTransmissionFactor": 0.6, "diffuseTransmissionColorFactor": [0.9, 0.6, 0.2]}),
    "glass-0": glass(0.0),
    "glass-0.4": glass(0.4),
    "glass-red": glass(0.0, RED),
    "amber": glass(0.0, distance=1.0),
    "thin": layer(RED, 0.0, 0.0, transmission={"transmissionFactor": 1.0}),
    "legacy": legacy([0.2, 0.3, 0.1], [0.4, 0.2, 0.1], 0.8),
    "emission-under-coat": ({**pbr([0.0] * 3, 0.0, 1.0, clearcoat={"clearcoatFactor": 1.0}), "emissiveFactor": [1.0, 0.5, 0.2]}, None),
}


def write(name, path):
    """The probe's scene as a glb."""
    write_glb(Scene(name, CAMERA, {"material": ("gltf", PROBES[name][0])}, [sphere()]), path)
