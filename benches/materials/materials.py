"""Renders probes and models by all renderers and prints how far apart they are: see `run`."""

import argparse
import json
import os
import subprocess
import sys

import numpy as np

import environment
import formulas
import principled
import sheet
from models import FOV, MODELS, view
from probes import CAMERA, PROBES, write

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "peers"))
from scenes import Camera, camera_matrix  # noqa: E402

DEPTH = 16
# Renderers that differ by more here do not show the same environment, exposure or camera.
CHECKS, CHECKED = ("diffuse", "mirror"), 0.01


class Materials:
    def __init__(self, arguments):
        self.a = arguments
        self.by = arguments.by.split(",")
        os.makedirs(self.a.folder, exist_ok=True)
        self.environment = self.path("environment.hdr")
        environment.write(self.environment)

    def path(self, name):
        return os.path.join(self.a.folder, name)

    def pathspace(self, file, camera, options, out):
        look = ",".join(f"{x:.9g}" for x in (*camera.origin, *camera.target, camera.fov))
        subprocess.run([
            self.a.pathspace, "render", file, "-i", "path", f"--look-at={look}", "--env", self.environment, "--width", str(self.a.side), "--height",
            str(self.a.side), "--spp", str(self.a.spp), "--max-depth", str(DEPTH), "--threads", "2", "-q", *options, "-o", out], check=True)

    def cycles(self, file, camera, out, corrected):
        if os.path.exists(out):
            os.unlink(out)
        job = {"file": file, "environment": self.environment, "camera": camera_matrix(camera), "fov": camera.fov, "side": self.a.side, "spp": self.a.spp,
               "depth": DEPTH, "corrected": corrected, "out": out}
        done = subprocess.run([os.environ["CYCLES_PYTHON"], os.path.join(HERE, "blender.py"), json.dumps(job)], capture_output=True, text=True)
        if done.returncode or not os.path.exists(out):
            said = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
            print(f"{os.path.basename(file)}: NOT RENDERED by Cycles: {said[-1] if said else done.returncode}", flush=True)
            return False
        return True

    def compare(self, name, by, ours, theirs):
        """Prints and returns the mean and the greatest difference of blocks; writes the sheet."""
        a, b = read(ours), read(theirs)
        difference, signed = sheet.differences(a, b)
        said = subprocess.run([self.a.pathspace, "compare", ours, theirs, "--json"], check=True, capture_output=True, text=True).stdout
        flip = json.loads(said)["images"][0]["flip"]
        sheet.write(self.path(f"{name}-{by}.png"), a, b, self.a.scale)
        worst = np.unravel_index(difference.argmax(), difference.shape)
        print(f"{name:26} {by:8} {difference.mean():7.2%} {signed.mean():+7.2%} {difference.max():7.1%} {worst[0]},{worst[1]}  {flip:.4f}", flush=True)
        return {"model": name, "by": by, "mean": difference.mean(), "signed": signed.mean(), "max": difference.max(), "flip": flip}

    def one(self, name, file, camera, options, probe=None):
        """A probe is its material and Mitsuba's or None."""
        ours, theirs, third = (self.path(f"{name}-{by}.exr") for by in ("pathspace", "cycles", "mitsuba"))
        if "pathspace" not in self.a.keep or not os.path.exists(ours):
            self.pathspace(file, camera, options, ours)
        rows = []
        kept = "cycles" in self.a.keep and os.path.exists(theirs)
        if "cycles" in self.by and (kept or self.cycles(file, camera, theirs, probe is not None)):
            rows.append(self.compare(name, "cycles", ours, theirs))
        if "mitsuba" in self.by and probe and probe[1]:
            if "mitsuba" not in self.a.keep or not os.path.exists(third):
                save(principled.render(probe[1], self.environment, camera, self.a.side, self.a.spp, DEPTH), third)
            rows.append(self.compare(name, "mitsuba", ours, third))
        if "formulas" in self.by and probe and formulas.has(probe[0]):
            rows.append(self.formulas(name, ours, probe[0]))
        return rows

    def formulas(self, name, ours, material):
        """Prints and returns how far the image is from the pages' formulas, by means of 3 × 3 pixels."""
        image = read(ours)
        column, row, expected = formulas.radiance(material, CAMERA, self.a.side)
        found = np.mean([image[row + i, column + j] for i in (-1, 0, 1) for j in (-1, 0, 1)], 0)
        level = np.maximum(expected.mean(-1), 0.05 * expected.mean())
        difference = abs(found - expected).mean(-1) / level
        signed = found.mean() / expected.mean() - 1
        print(f"{name:26} {'formulas':8} {difference.mean():7.2%} {signed:+7.2%} {difference.max():7.1%}", flush=True)
        return {"model": name, "by": "formulas", "mean": difference.mean(), "signed": signed, "max": difference.max()}

    def run(self):
        probes, models = chosen(self.a.probes, PROBES), chosen(self.a.models, MODELS)
        print(f"{'':26} {'':8} {'mean':>7} {'signed':>7} {'max':>7} at    FLIP")
        rows = []
        for name in probes:
            file = self.path(f"{name}.glb")
            write(name, file)
            rows += self.one(name, file, CAMERA, [], PROBES[name])
            if name in CHECKS and any(row["max"] > CHECKED for row in rows):
                raise SystemExit(f"{name}: the renderers do not show the same environment; nothing else is worth comparing")
        for name in models:
            file = os.path.join(self.a.assets, MODELS[name].path)
            if not os.path.exists(file):
                print(f"{name}: SKIPPED, {file} is not there", flush=True)
                continue
            origin, target = view(self.a.pathspace, file, MODELS[name])
            rows += self.one(name, file, Camera(tuple(origin), tuple(target), FOV), MODELS[name].options)
        with open(self.path("results.json"), "w") as out:
            json.dump(rows, out, indent=1)


def chosen(names, all_of_them):
    """Those names, all of them, or none."""
    if names in ("all", "none"):
        return list(all_of_them) if names == "all" else []
    return [name for name in names.split(",") if name in all_of_them or sys.exit(f"{name} is none of {', '.join(all_of_them)}")]


def read(exr):
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    bitmap = mi.Bitmap(exr)
    names = [field.name for field in bitmap.struct_()]
    pixels = np.array(bitmap, np.float64)
    return np.stack([pixels[..., names.index(c)] for c in "RGB"], -1)


def save(image, exr):
    import mitsuba as mi

    mi.Bitmap(image.astype(np.float32)).write(exr)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--models", default="all", help="names, all or none")
    parser.add_argument("--probes", default="all", help="spheres of one material: names, all or none")
    parser.add_argument("--by", default="cycles,mitsuba", help="compare with these; formulas for the extensions' pages, half a minute for each probe")
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--side", type=int, default=256)
    parser.add_argument("--scale", type=int, default=2, help="pixels of a sheet for each of an image")
    parser.add_argument("--keep", default="", help="renderers whose images of an earlier run are kept: pathspace,cycles,mitsuba")
    parser.add_argument("--assets", default="../shared/assets/public/gltf")
    parser.add_argument("--folder", default="target/materials")
    parser.add_argument("--pathspace", default="target/release/pathspace")
    Materials(parser.parse_args()).run()


if __name__ == "__main__":
    main()
