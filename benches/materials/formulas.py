"""What the pages of glTF's extensions say a probe looks like, integrated over the environment by quadrature: a sphere sees nothing else.

The formulas are those of the specification's appendix B and of the extensions' implementation notes. Metal alone is compensated for what facets reflect to
each other (Kulla & Conty 2017), which pathspace and Cycles have and the pages leave out. Radiance is of pixel centres, every STEP pixels, where the sphere is met
at a cosine of at least LEAST.
"""

import functools
import math

import numpy as np

import environment

STEP, LEAST = 12, 0.25


# What is smoother is too narrow for the cells of the environment.
SMOOTHEST = 0.2


def has(material):
    """Whether the formulas cover the material: nothing that mirrors, or that lets light into the sphere."""
    extensions, pbr = material.get("extensions", {}), material.get("pbrMetallicRoughness", {})
    coat = extensions.get("KHR_materials_clearcoat", {}).get("clearcoatRoughnessFactor", 1.0)
    legacy = 1 - extensions.get("KHR_materials_pbrSpecularGlossiness", {}).get("glossinessFactor", 0.0)
    opaque = not {"KHR_materials_transmission", "KHR_materials_diffuse_transmission"} & extensions.keys()
    return opaque and min(pbr.get("roughnessFactor", 1.0), coat, legacy) >= SMOOTHEST - 1e-9


def power5(cos):
    return np.clip(1 - cos, 0, 1) ** 5


def schlick(f0, f90, cos):
    return f0 + (f90 - f0) * power5(cos)[..., None]


def ggx(d, x, y):
    """D · V of appendix B, and of KHR_materials_anisotropy where α differs along the axes."""
    h, v, l = d["h"], d["v"], d["l"]
    a2 = x * y
    f = (y * h[..., 0]) ** 2 + (x * h[..., 1]) ** 2 + (a2 * h[..., 2]) ** 2
    w2 = a2 / f
    stretched = lambda w: np.sqrt((x * w[..., 0]) ** 2 + (y * w[..., 1]) ** 2 + w[..., 2] ** 2)
    visible = 0.5 / (l[..., 2] * stretched(v) + v[..., 2] * stretched(l))
    return (a2 * w2 * w2 / np.pi * visible)[..., None]


@functools.cache
def facet_albedos(x, y, cosines=24, angles=9, n=96):
    """∫ D V cos θ' dω' over cos θ and the angle from the axis in [0, π/2], and its cosine-weighted mean."""
    z, p = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(4 * n) + 0.5) / (4 * n) * 2 * np.pi, indexing="ij")
    r = np.sqrt(1 - z * z)
    l = np.stack([r * np.cos(p), r * np.sin(p), z], -1)
    grid = (np.arange(cosines) + 0.5) / cosines
    table = np.empty((cosines, angles))
    for i, c in enumerate(grid):
        for j in range(angles):
            a, s = j / (angles - 1) * np.pi / 2, math.sqrt(1 - c * c)
            v = np.array([s * math.cos(a), s * math.sin(a), c])
            h = l + v
            d = {"l": l, "v": np.broadcast_to(v, l.shape), "h": h / np.linalg.norm(h, axis=-1, keepdims=True)}
            table[i, j] = min((ggx(d, x, y)[..., 0] * z).mean() * 2 * np.pi, 1.0)
    inner = np.ones(angles)
    inner[[0, -1]] = 0.5
    return table, float((table @ inner / inner.sum() * grid).mean() * 2)


def between_facets(d, x, y, f0):
    """f of a metal's light that meets several facets."""
    table, mean = facet_albedos(x, y)
    cosines, angles = table.shape

    def albedo(w):
        u = np.clip(w[..., 2] * cosines - 0.5, 0, cosines - 1.001)
        v = np.arctan2(abs(w[..., 1]), abs(w[..., 0])) / (np.pi / 2) * (angles - 1) * 0.9999
        i, j = u.astype(int), v.astype(int)
        u, v = u - i, v - j
        return (table[i, j] * (1 - u) + table[i + 1, j] * u) * (1 - v) + (table[i, j + 1] * (1 - u) + table[i + 1, j + 1] * u) * v

    average = f0 + (1 - f0) / 21
    tint = average**2 * mean / (1 - average * (1 - mean))
    return ((1 - albedo(d["v"])) * (1 - albedo(d["l"])) / (np.pi * max(1 - mean, 1e-9)))[..., None] * tint


def charlie(d, roughness):
    """D · V of KHR_materials_sheen, with the visibility of the paper; E by `sheen_albedo`."""
    alpha = roughness**2
    sin2 = 1 - d["h"][..., 2] ** 2
    distribution = (2 + 1 / alpha) * sin2 ** (0.5 / alpha) / (2 * np.pi)
    return distribution / (4 * d["v"][..., 2] * d["l"][..., 2] * (1 + sheen_lambda(d["v"][..., 2], alpha) + sheen_lambda(d["l"][..., 2], alpha)))


def sheen_lambda(cos, alpha):
    t = (1 - alpha) ** 2
    mix = lambda rough, smooth: rough + (smooth - rough) * t
    a, b, c = mix(21.5473, 25.3245), mix(3.82987, 3.32435), mix(0.19823, 0.16801)
    e, g = mix(-1.97760, -1.27393), mix(-4.32054, -4.85967)
    curve = lambda x: a / (1 + b * x**c) + e * x + g
    return np.where(cos < 0.5, np.exp(curve(np.minimum(cos, 0.5))), np.exp(2 * curve(0.5) - curve(np.clip(1 - cos, 0, 0.5))))


def sheen_albedo(cos, roughness):
    """∫ f cos θ' dω', looked up in a table over cos θ."""
    n = 200
    cosines = (np.arange(n) + 0.5) / n
    phi = (np.arange(n) + 0.5) / n * np.pi
    z, p = np.meshgrid(cosines, phi, indexing="ij")
    r = np.sqrt(1 - z * z)
    l = np.stack([r * np.cos(p), r * np.sin(p), z], -1)
    grid = np.linspace(0.02, 1, 64)
    sums = []
    for c in grid:
        v = np.broadcast_to(np.array([math.sqrt(1 - c * c), 0, c]), l.shape)
        h = v + l
        h = h / np.linalg.norm(h, axis=-1, keepdims=True)
        sums.append((charlie({"h": h, "v": v, "l": l}, roughness) * z).mean() * 2 * np.pi)
    return np.interp(cos, grid, sums)


def film(base_f0, ior, thickness, cos1, outside=1.0):
    """F_iridescence of KHR_materials_iridescence, with cos θ₂ in the optical path as in Belcour & Barla 2017."""
    cos2 = np.sqrt(1 - (outside / ior) ** 2 * (1 - cos1**2))
    r0 = ((ior - outside) / (ior + outside)) ** 2
    r12 = (r0 + (1 - r0) * power5(cos1))[..., None]
    t121 = 1 - r12
    root = np.sqrt(np.minimum(base_f0 + 0.0001, 0.9999))
    base = (1 + root) / (1 - root)
    r1 = ((base - ior) / (base + ior)) ** 2
    r23 = r1 + (1 - r1) * power5(cos2)[..., None]
    phase = (0 if ior < outside else np.pi) + np.where(base < ior, np.pi, 0.0)
    r123 = np.clip(r12 * r23, 1e-5, 0.9999)
    rs = t121**2 * r23 / (1 - r123)
    result, amplitude = r12 + rs, rs - t121
    for m in (1, 2):
        amplitude = amplitude * np.sqrt(r123)
        result = result + amplitude * 2 * sensitivity((m * 2 * ior * thickness * cos2)[..., None], m * phase)
    return np.clip(result, 0, None)


def sensitivity(path, shift):
    phase = 2 * np.pi * path * 1e-9
    gaussian = lambda value, place, var: value * np.sqrt(2 * np.pi * var) * np.cos(place * phase + shift) * np.exp(-(phase**2) * var) / 1.0685e-7
    x = gaussian(5.4856e-13, 1.6810e6, 4.3278e9) + gaussian(9.7470e-14, 2.2399e6, 4.5282e9)
    y, z = gaussian(4.4201e-13, 1.7953e6, 9.3046e9), gaussian(5.2481e-13, 2.2084e6, 6.6121e9)
    to_rgb = np.array([[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]])
    # Each channel of the shift has a sum of its own.
    return np.stack([to_rgb[k, 0] * x[..., k] + to_rgb[k, 1] * y[..., k] + to_rgb[k, 2] * z[..., k] for k in range(3)], -1)


def reflected(material, d):
    """f towards both directions on one side of the surface, 1/sr."""
    extension = lambda name: material.get("extensions", {}).get(f"KHR_materials_{name}", {})
    pbr = material.get("pbrMetallicRoughness", {})
    colour, metallic, roughness = np.array(pbr.get("baseColorFactor", [1] * 4)[:3]), pbr.get("metallicFactor", 1.0), pbr.get("roughnessFactor", 1.0)
    ior, specular = extension("ior").get("ior", 1.5), extension("specular")
    f90 = specular.get("specularFactor", 1.0)
    f0 = np.minimum(((ior - 1) / (ior + 1)) ** 2 * np.array(specular.get("specularColorFactor", [1.0] * 3)), 1) * f90
    if legacy := extension("pbrSpecularGlossiness"):
        colour, metallic, roughness = np.array(legacy["diffuseFactor"][:3]), 0.0, 1 - legacy["glossinessFactor"]
        f0, f90 = np.array(legacy["specularFactor"]), 1.0
    y = roughness**2
    grain = extension("anisotropy")
    x = y + (1 - y) * grain.get("anisotropyStrength", 0.0) ** 2
    turned = d if not grain.get("anisotropyRotation") else {key: turn(w, grain["anisotropyRotation"]) for key, w in d.items()}
    facets = ggx(turned, x, y)
    cos = (d["v"] * d["h"]).sum(-1)
    dielectric, metal = schlick(f0, f90, cos), schlick(colour, 1.0, cos)
    if thin := extension("iridescence"):
        by_film = lambda base: film(base, thin["iridescenceIor"], thin["iridescenceThicknessMaximum"], cos)
        dielectric, metal = by_film(f0), by_film(colour)
    under = 1 - dielectric.max(-1, keepdims=True)
    f = (1 - metallic) * (dielectric * facets + under * colour / np.pi) + metallic * (metal * facets + between_facets(turned, x, y, colour))
    if sheen := extension("sheen"):
        tint, rough = np.array(sheen["sheenColorFactor"]), sheen["sheenRoughnessFactor"]
        albedo = np.maximum(sheen_albedo(d["v"][..., 2], rough), sheen_albedo(d["l"][..., 2], rough))
        f = f * (1 - tint.max() * albedo)[..., None] + tint * charlie(d, rough)[..., None]
    if coat := extension("clearcoat"):
        alpha = coat.get("clearcoatRoughnessFactor", 0.0) ** 2
        weight = coat["clearcoatFactor"] * (0.04 + 0.96 * power5(d["v"][..., 2]))[..., None]
        f = f * (1 - weight) + ggx(d, alpha, alpha) * weight
    return f


def turn(w, angle):
    """Into axes that are turned counter-clockwise."""
    c, s = math.cos(angle), math.sin(angle)
    return np.stack([c * w[..., 0] + s * w[..., 1], c * w[..., 1] - s * w[..., 0], w[..., 2]], -1)


def pixels(camera, side):
    """Columns, rows, and frames (t, b, n) and directions to the camera of the pixels whose centre meets the sphere."""
    origin, target = np.array(camera.origin), np.array(camera.target)
    z = (origin - target) / np.linalg.norm(origin - target)
    x = np.cross((0, 1, 0), z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    places = np.arange(STEP // 2, side, STEP)
    column, row = (a.ravel() for a in np.meshgrid(places, places))
    scale = math.tan(math.radians(camera.fov / 2))
    ray = ((2 * (column + 0.5) / side - 1) * scale)[:, None] * x + ((1 - 2 * (row + 0.5) / side) * scale)[:, None] * y - z
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    b = ray @ origin
    inside = b * b - (origin @ origin - 1)
    met = inside > 0
    column, row, ray = column[met], row[met], ray[met]
    n = origin + ((-b - np.sqrt(np.maximum(inside, 0)))[met])[:, None] * ray
    seen = (-ray * n).sum(1) >= LEAST
    column, row, ray, n = column[seen], row[seen], ray[seen], n[seen]
    t = np.stack([n[:, 2], 0 * n[:, 0], -n[:, 0]], 1)
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    return column, row, np.stack([t, np.cross(n, t), n], 1), -ray


def radiance(material, camera, side, down=4):
    """Columns, rows and radiance; the environment in cells of `down` × `down` texels."""
    image = environment.stored()
    height, width = image.shape[0] // down, image.shape[1] // down
    cells = image.reshape(height, down, width, down, 3).mean((1, 3)).reshape(-1, 3)
    theta, phi = (np.arange(height) + 0.5) / height * np.pi, (np.arange(width) + 0.5 - width / 2) / width * 2 * np.pi
    sin, cos = np.sin(theta)[:, None], np.cos(theta)[:, None]
    towards = np.stack(np.broadcast_arrays(sin * np.cos(phi), cos, sin * np.sin(phi)), -1).reshape(-1, 3)
    light = cells * np.broadcast_to(sin * (np.pi / height) * (2 * np.pi / width), (height, width)).reshape(-1, 1)
    column, row, frames, to_camera = pixels(camera, side)
    result = np.zeros((len(column), 3))
    for k, (frame, v) in enumerate(zip(frames, to_camera)):
        l, v = towards @ frame.T, frame @ v
        above = l[:, 2] > 1e-4
        d = {"l": l[above], "v": np.broadcast_to(v, (above.sum(), 3))}
        h = d["l"] + d["v"]
        d["h"] = h / np.linalg.norm(h, axis=1, keepdims=True)
        result[k] = (reflected(material, d) * light[above] * d["l"][:, 2:]).sum(0)
    return column, row, result + np.array(material.get("emissiveFactor", [0.0] * 3))
