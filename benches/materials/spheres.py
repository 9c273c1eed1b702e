"""Renders spheres of materials by roughness, and the same materials in white under an even white sky (a furnace); draws both and prints the numbers of the
furnaces. See `spheres`."""

import argparse
import os
import subprocess
import sys
from dataclasses import dataclass
from typing import Callable

import numpy as np
import OpenEXR
from PIL import Image, ImageDraw, ImageFont

import environment
from probes import GOLD, RED, pbr, sphere
from sheet import shown

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "peers"))
from scenes import Ball, Camera, Scene, quads, write_glb  # noqa: E402

ROUGHNESS = (0.0, 0.1, 0.25, 0.5, 0.75, 1.0)

# Rows that are left out of the whole figure, such as ("coated glass",) for a program that does not read a coat on what transmits: it warns, the warning is
# printed here, and the row shows plain glass.
LEFT_OUT = ()
# Needed by rows whose extensions are drafts.
DRAFTS = ("--drafts",)


@dataclass
class Row:
    # The material of a roughness, and of what becomes of its colours: themselves, or white. White also means that volumes do not absorb.
    material: Callable
    label: str
    # The furnace is told by channel, since not all of them are white.
    by_channel: bool = False
    # Analytic spheres have no tangents, which a grain needs.
    mesh: bool = False
    options: tuple = ()


def glass(r, tint, **layers):
    volume = {"thicknessFactor": 1.0, "attenuationDistance": 2.0, "attenuationColor": tint((0.75, 0.93, 0.85))}
    return pbr((1.0, 1.0, 1.0), 0.0, r, transmission={"transmissionFactor": 1.0}, volume=volume, ior={"ior": 1.5}, **layers)


def film(thickness, index):
    return {"iridescenceFactor": 1.0, "iridescenceIor": index, "iridescenceThicknessMaximum": thickness}


COAT = {"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.0}
CLOTH = {"sheenRoughnessFactor": 0.4}
DARK, SILVER = (0.14, 0.14, 0.14), (0.9, 0.9, 0.9)

ROWS = {
    "plastic": Row(lambda r, tint: pbr(tint((0.08, 0.22, 0.6)), 0.0, r), "plastic"),
    "metal": Row(lambda r, tint: pbr(tint(GOLD), 1.0, r), "metal\nof gold's colour"),
    "gold": Row(lambda r, tint: pbr(GOLD, 1.0, r) | {"extensions": {"PATHSPACE_materials_metal": {"name": "Au"}}}, "gold, measured", by_channel=True),
    "coat": Row(lambda r, tint: pbr(tint(RED), 0.0, r, clearcoat=COAT), "clear coat\nover red"),
    "sheen": Row(lambda r, tint: pbr(tint((0.3, 0.05, 0.12)), 0.0, r, sheen=CLOTH | {"sheenColorFactor": tint((0.9, 0.6, 0.7))}), "cloth:\nsheen over red"),
    "grain": Row(lambda r, tint: pbr(tint(SILVER), 1.0, r, anisotropy={"anisotropyStrength": 0.7}), "grain of 0.7\non metal", mesh=True),
    "film on metal": Row(lambda r, tint: pbr(tint(SILVER), 1.0, r, iridescence=film(400.0, 1.8)), "thin film\non metal", by_channel=True),
    "film on dielectric": Row(lambda r, tint: pbr(tint(DARK), 0.0, r, iridescence=film(400.0, 1.8)), "thin film\non dielectric", by_channel=True),
    "leaf": Row(lambda r, tint: pbr(tint((0.16, 0.4, 0.07)), 0.0, r, diffuse_transmission={
        "diffuseTransmissionFactor": 0.5, "diffuseTransmissionColorFactor": tint((0.55, 0.8, 0.15))}), "leaf: diffuse\ntransmission"),
    "glass": Row(glass, "glass"),
    "thin wall": Row(lambda r, tint: pbr(tint((0.85, 0.92, 0.98)), 0.0, r, transmission={"transmissionFactor": 1.0}), "thin wall"),
    "dispersion": Row(lambda r, tint: pbr((1.0, 1.0, 1.0), 0.0, r, transmission={"transmissionFactor": 1.0}, volume={"thicknessFactor": 1.0}, ior={"ior": 1.5},
                                          dispersion={"dispersion": 2.0}), "glass that\ndisperses"),
    "coated glass": Row(lambda r, tint: glass(r, tint, clearcoat=COAT), "clear coat\nover glass"),
    "sheen on glass": Row(lambda r, tint: glass(r, tint, sheen=CLOTH | {"sheenColorFactor": tint((0.9, 0.6, 0.7))}), "sheen\nover glass"),
    "film on glass": Row(lambda r, tint: glass(r, tint, iridescence=film(400.0, 1.8)), "thin film\non glass", by_channel=True),
    "draft coat": Row(lambda r, tint: pbr(tint(SILVER), 0.0, r, coat={"coatFactor": 1.0, "coatColorFactor": tint((0.9, 0.45, 0.1))}),
                      "coloured coat\nover white\n(draft)", options=DRAFTS),
    "fuzz": Row(lambda r, tint: pbr(tint((0.3, 0.05, 0.12)), 0.0, r, fuzz={"fuzzFactor": 1.0, "fuzzColorFactor": tint((0.9, 0.6, 0.7)), "fuzzRoughnessFactor": 0.4}),
                "fuzz over red\n(draft)", options=DRAFTS),
    "diffuse roughness": Row(lambda r, tint: pbr(tint((0.7, 0.45, 0.3)), 0.0, 1.0, specular={"specularFactor": 0.0}, diffuse_roughness={
        "diffuseRoughnessFactor": r}), "clay: roughness\nof the diffuse base\n(draft)", options=DRAFTS),
}

# From above the horizon, so that the floor is behind all of the sphere.
CAMERA = Camera((0.0, 2.0, 5.9), (0.0, -0.06, 0.0), 21.5)
FURNACE_CAMERA = Camera((0.0, 0.0, 6.2), (0.0, 0.0, 0.0), 19.0)
RINGS = 8
# A studio: grey, and brighter from above, from the right and from behind. Without colours, those of the films are their own.
LOBES = [((-0.4, 1.0, 0.2), 5.0, (0.7,) * 3), ((1.0, 0.35, -0.1), 12.0, (1.2,) * 3), ((0.0, 0.3, -1.0), 8.0, (0.5,) * 3)]
SKY, GROUND = np.full(3, 0.3), np.full(3, 0.12)
# So large that what is seen through glass has little noise, so small that smooth spheres show it as a dot.
LAMP, RADIANCE = Ball("lamp", "lamp", (-3.2, 4.8, 3.4), 1.0), 40.0
EXPOSURE = 0.6
# Many times what is shown as white: pictures are to be looked at, and without dots. Furnaces have no bound.
CLAMP = 10


def floor():
    """Squares of two greys, so that one sees what refracts and what reflects."""
    step, meshes = 0.5, []
    for parity, name in enumerate(("dark", "light")):
        places = [(i * step, j * step) for i in range(-24, 24) for j in range(-48, 16) if (i + j) % 2 == parity]
        meshes.append(quads(name, name, [[(x, -1.0, z), (x, -1.0, z + step), (x + step, -1.0, z + step), (x + step, -1.0, z)] for x, z in places]))
    return meshes


def scene(material, mesh, furnace):
    meshes = [sphere()] if mesh else []
    balls = [] if mesh else [Ball("ball", "material", (0.0, 0.0, 0.0), 1.0)]
    materials = {"material": ("gltf", material)}
    if furnace:
        return Scene("furnace", FURNACE_CAMERA, materials, meshes, balls)
    materials |= {"dark": ("diffuse", (0.2,) * 3), "light": ("diffuse", (0.5,) * 3), "lamp": ("lamp", (RADIANCE,) * 3)}
    return Scene("spheres", CAMERA, materials, [*meshes, *floor()], [*balls, LAMP])


class Spheres:
    def __init__(self, arguments):
        self.a = arguments
        os.makedirs(self.a.folder, exist_ok=True)
        self.environment = self.path("environment.hdr")
        environment.write(self.environment, environment.radiance(LOBES, SKY, GROUND))

    def path(self, name):
        return os.path.join(self.a.folder, name)

    def render(self, name, row, roughness, furnace):
        """The pixels. A warning of the program is printed once for each row."""
        plain = f"{name.replace(' ', '-')}-{roughness:g}{'-furnace' if furnace else ''}"
        # A render that is stopped writes what it has, which is not to be kept.
        out, part = self.path(f"{plain}.exr"), self.path("part.exr")
        if not (self.a.keep and os.path.exists(out)):
            file = self.path(f"{plain}.glb")
            tint = (lambda colour: [1.0] * 3) if furnace else list
            write_glb(scene(row.material(roughness, tint), row.mesh, furnace), file)
            if furnace:
                # Light that grazes nearly smooth glass goes round in it until its facets let it out; `bdpt` would connect all of those vertices.
                side, options = self.a.furnace_side, ["-i", "path", "--spp", str(self.a.furnace_spp), "--env-color", "1", "--max-depth", "255"]
            else:
                side, options = self.a.side, ["-i", "bdpt", "--spp", str(self.a.spp), "--noise", str(self.a.noise), "--clamp", str(CLAMP), "--env", self.environment]
            command = [self.a.program, "render", file, "--width", str(side), "--height", str(side), *options, *row.options, "-o", part]
            done = subprocess.run(command, capture_output=True, text=True)
            said = [line for line in done.stderr.splitlines() if "warning" in line and "--noise" not in line]
            if done.returncode:
                raise SystemExit(f"{name}: {done.stderr.strip()}")
            os.replace(part, out)
            if said and not furnace and roughness == ROUGHNESS[-1]:
                print(f"{name}: " + "; ".join(said), file=sys.stderr, flush=True)
        with OpenEXR.File(out) as file:
            return np.array(file.channels()["RGB"].pixels, np.float64)

    def furnace(self, name, row, roughness):
        """The mean over the pixels wholly inside the sphere, and the least and the greatest of the rings: of the mean of the channels, or by channel."""
        image = self.render(name, row, roughness, True)
        if not row.by_channel:
            image = image.mean(-1, keepdims=True)
        cosine = cosines(len(image))
        inside = np.isfinite(cosine)
        ring = np.where(inside, np.minimum(np.nan_to_num(cosine) * RINGS, RINGS - 1), -1).astype(int)
        rings = np.array([image[ring == i].mean(0) for i in range(RINGS)])
        return image[inside].mean(0), rings.min(), rings.max()

    def run(self):
        names = [name for name in ROWS if name not in LEFT_OUT] if self.a.rows == "all" else self.a.rows.split(",")
        for name in names:
            if name not in ROWS:
                raise SystemExit(f"{name} is none of {', '.join(ROWS)}")
        print("| | " + " | ".join(f"{r:g}" for r in ROUGHNESS) + " |\n" + "|---" * (len(ROUGHNESS) + 1) + "|")
        pictures, numbers = {}, {}
        for name in names:
            for r in ROUGHNESS:
                pictures[name, r] = shown(self.render(name, ROWS[name], r, False), EXPOSURE)
                numbers[name, r] = told(ROWS[name], *self.furnace(name, ROWS[name], r))
            print(f"| {' '.join(ROWS[name].label.split())} | " + " | ".join("{}: {}".format(*numbers[name, r]) for r in ROUGHNESS) + " |", flush=True)
        draw(names, pictures, numbers, self.a.picture)


def told(row, means, least, greatest):
    mean = " ".join(f"{x:.2f}" for x in means) if row.by_channel else f"{means[0]:.3f}"
    return mean, f"{least:.3f} to {greatest:.3f}"


def cosines(side):
    """Of the angle at which the furnace's camera sees the sphere in the middle of each pixel; not a number where a corner of the pixel misses it."""
    distance, extent = FURNACE_CAMERA.origin[2], np.tan(np.radians(FURNACE_CAMERA.fov / 2))

    def squared(x):
        """Of the sine, of pixels' coordinates."""
        t = (2 * x / side - 1) * extent
        slope = t[None, :] ** 2 + t[:, None] ** 2
        return distance**2 * slope / (1 + slope)

    corner = squared(np.arange(side + 1.0))
    outermost = np.maximum.reduce([corner[:-1, :-1], corner[1:, :-1], corner[:-1, 1:], corner[1:, 1:]])
    middle = squared(np.arange(side) + 0.5)
    return np.where(outermost < 1, np.sqrt(np.maximum(1 - middle, 0)), np.nan)


def draw(names, pictures, numbers, file):
    """A table: a row of pictures, and their numbers below them."""
    fonts = {size: ImageFont.load_default(size) for size in (12, 14, 16)}
    side = len(next(iter(pictures.values())))  # of kept images, not always that of the options
    gap, left, top, below = 8, 150, 50, 44
    sheet = Image.new("RGB", (left + len(ROUGHNESS) * (side + gap) + gap, top + len(names) * (side + below)), "white")
    pen = ImageDraw.Draw(sheet)
    black, grey = (20, 20, 20), (90, 90, 90)
    middle = lambda j: left + j * (side + gap) + side / 2
    pen.text((left + (len(ROUGHNESS) * (side + gap) - gap) / 2, 4), "roughness", black, fonts[16], anchor="ma")
    for j, r in enumerate(ROUGHNESS):
        pen.text((middle(j), 26), f"{r:g}", black, fonts[16], anchor="ma")
    for i, name in enumerate(names):
        y = top + i * (side + below)
        pen.multiline_text((left - 12, y + side / 2), ROWS[name].label, black, fonts[14], anchor="rm", align="right")
        for j, r in enumerate(ROUGHNESS):
            sheet.paste(Image.fromarray(pictures[name, r]), (left + j * (side + gap), y))
            mean, extremes = numbers[name, r]
            pen.text((middle(j), y + side + 3), mean, black, fonts[14], anchor="ma")
            pen.text((middle(j), y + side + 20), extremes, grey, fonts[12], anchor="ma")
    sheet.save(file, optimize=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", default="target/release/pathspace", help="that of this tree")
    parser.add_argument("--rows", default="all", help=f"some of {', '.join(ROWS)}")
    parser.add_argument("--side", type=int, default=96, help="pixels of a picture")
    parser.add_argument("--spp", type=int, default=1024, help="of a picture at most")
    parser.add_argument("--noise", type=float, default=0.05, help="relative, at which a picture is done")
    parser.add_argument("--furnace-side", type=int, default=512, help="pixels; the outermost ring is two wide")
    parser.add_argument("--furnace-spp", type=int, default=16)
    parser.add_argument("--keep", action="store_true", help="images of an earlier run are kept")
    parser.add_argument("--picture", metavar="FILE", default="docs/figures/materials.png")
    parser.add_argument("--folder", default="target/spheres")
    Spheres(parser.parse_args()).run()


if __name__ == "__main__":
    main()
