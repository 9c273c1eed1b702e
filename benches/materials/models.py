"""The public models: where each is below the assets' folder, from where it is seen, and further options of pathspace."""

import json
import math
import subprocess
from dataclasses import dataclass, field

import numpy as np

FOV = 30.0


@dataclass
class Model:
    path: str
    towards: tuple = (0.0, 0.12, 1.0)  # from the model to the camera
    zoom: float = 1.0
    options: list = field(default_factory=list)


EXTENSIONS = "khronos-extensions"
BOARD, THREE_QUARTERS = (0.0, 0.12, 1.0), (0.6, 0.45, 1.0)


def of(name, towards=BOARD, suffix="glb", folder=EXTENSIONS, **others):
    return Model(f"{folder}/{name}/{name}.{suffix}", towards, **others)


MODELS = {
    "ClearCoatTest": of("ClearCoatTest"),
    "ClearCoatCarPaint": of("ClearCoatCarPaint", THREE_QUARTERS),
    "AnisotropyStrengthTest": of("AnisotropyStrengthTest"),
    "AnisotropyRotationTest": of("AnisotropyRotationTest"),
    "IridescenceSuzanne": of("IridescenceSuzanne"),
    "SheenCloth": of("SheenCloth", THREE_QUARTERS, "gltf"),
    "ToyCar": of("ToyCar", THREE_QUARTERS, "gltf"),
    "SpecularTest": of("SpecularTest"),
    "EmissiveStrengthTest": of("EmissiveStrengthTest"),
    "AttenuationTest": of("AttenuationTest"),
    "TransmissionTest": of("TransmissionTest"),
    "TransmissionRoughnessTest": of("TransmissionRoughnessTest"),
    "MosquitoInAmber": of("MosquitoInAmber", THREE_QUARTERS, "gltf"),
    "GlassVaseFlowers": of("GlassVaseFlowers", THREE_QUARTERS),
    "NegativeScaleTest": of("NegativeScaleTest", options=["--cull-backfaces"]),
    "MultiUVTest": of("MultiUVTest", THREE_QUARTERS),
    "TwoSidedPlane": of("TwoSidedPlane", (0.3, 1.0, 0.6), "gltf"),
    "NormalTangentTest": Model("khronos/NormalTangentTest.glb"),
    "AlphaBlendModeTest": Model("khronos/AlphaBlendModeTest.glb"),
    "TextureCoordinateTest": of("TextureCoordinateTest", (0.0, 0.0, 1.0), "gltf", "khronos"),
    "TextureSettingsTest": of("TextureSettingsTest", (0.0, 0.0, 1.0), "gltf", "khronos", options=["--cull-backfaces"]),
    "BoxVertexColors": of("BoxVertexColors", THREE_QUARTERS, "gltf", "khronos"),
    "TextureTransformTest": Model("draco-testdata/KhronosSampleModels/TextureTransformTest/glTF/TextureTransformTest.gltf", (0.0, 0.0, 1.0)),
    "VertexColorTest": Model("draco-testdata/VertexColorTest/glTF/VertexColorTest.gltf"),
    "UnlitTest": Model("draco-testdata/KhronosSampleModels/UnlitTest/glTF/UnlitTest.gltf"),
    "CommonMaterials": Model("blender-io/04_common_materials/04_common_materials.gltf", THREE_QUARTERS),
}


def view(pathspace, file, model):
    """Where a camera of FOV stands and at what it looks so that the model's bounds just fit."""
    facts = json.loads(subprocess.run([pathspace, "info", "--json", file], check=True, capture_output=True, text=True).stdout)
    bounds = facts["geometry"]["bounds"]
    low, high = (np.array(bounds[key], float) + facts["geometry"]["centre"] for key in ("min", "max"))
    target = (low + high) / 2
    corners = np.array([[(low, high)[k >> i & 1][i] for i in range(3)] for k in range(8)]) - target
    z = np.array(model.towards) / np.linalg.norm(model.towards)
    x = np.cross((0, 1, 0), z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    across = np.maximum(abs(corners @ x), abs(corners @ y)) / math.tan(math.radians(FOV / 2))
    distance = (corners @ z + across).max() * 1.04 / model.zoom
    return target + z * distance, target
