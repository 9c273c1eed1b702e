"""Renders the scenes by every renderer in turn and prints what each needs for the same noise: see `run`."""

import argparse
import json
import os
import statistics
import subprocess
import sys

import numpy as np

from scenes import MAX_DEPTH, SCENES, SIDE, write_glb, write_ply

HERE = os.path.dirname(os.path.abspath(__file__))
# relMSE is the mean of (I − R)²/(R² + FLOOR) over pixels and channels; trimmed, without the worst TRIM of the pixels.
FLOOR, TRIM = 0.01, 0.001
OURS = [("pathspace", name) for name in ("path", "light", "hybrid", "bdpt", "bdpt-sds", "vcm", "auto")]
# What earlier builds of ours are asked for (`--before`).
BEFORE = ("path", "light", "hybrid", "bdpt")
PEERS = [("mitsuba", "path"), ("mitsuba", "ptracer"), ("luxcore", "path"), ("luxcore", "hybrid"), ("luxcore", "bidir"), ("luxcore", "vcm"), ("cycles", "path")]
# Camera rays alone do not find the caustic of the small lamp, and no ray that light sends meets the lens of a camera that sees glass first.
EXPOSED = {"indirect": 0.2}
# The integrator of the reference, where it is not bdpt: the one that finds the most of what the picture shows.
REFERENCE = {"caustic-glass": "hybrid", "caustic-small": "hybrid", "pool": "vcm", "bulb": "vcm"}


class Bench:
    def __init__(self, arguments):
        self.a = arguments
        self.folder = arguments.folder
        self.programs = dict(before.split("=", 1) for before in arguments.before) | {"pathspace": arguments.pathspace}
        os.makedirs(self.folder, exist_ok=True)

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def prepare(self, name):
        """The scene's files; the reference, with half of the squared difference of its two halves; masks of pixels."""
        scene = SCENES[name]()
        os.makedirs(self.path(name), exist_ok=True)
        for mesh in scene.meshes:
            write_ply(mesh, self.path(name, f"{mesh.name}.ply"))
        write_glb(scene, self.path(f"{name}.glb"))
        # Black, and a lamp where the camera sees anything but a diffuse surface.
        lit = {key: ("diffuse", (0.0,) * 3) if kind == "diffuse" else ("lamp", (1.0,) * 3) for key, (kind, _) in scene.materials.items()}
        scene.materials = lit
        write_glb(scene, self.path(f"{name}-mask.glb"))
        self.pathspace(self.path(f"{name}-mask.glb"), "path", ["--spp", "64"], self.path(f"{name}-mask.exr"))
        halves = []
        for half in (1, 2):
            exr = self.path(f"{name}-reference-{half}.exr")
            if not os.path.exists(exr):
                options = ["--time", f"{self.a.reference / 2:g}s", "--seed", str(10_000 + half), "--layers", "classes"]
                self.pathspace(self.path(f"{name}.glb"), REFERENCE.get(name, "bdpt"), options, exr)
            halves.append((read(exr), read(exr, "classes.caustics")))
        reference, caustics = ((a + b) / 2 for a, b in zip(*halves))
        diffuse = (read(self.path(f"{name}-mask.exr")) == 0).all(-1)
        masks = {"all": np.ones_like(diffuse), "diffuse": diffuse}
        if name.startswith("caustic"):
            masks["caustic"] = diffuse & (caustics.mean(-1) > 0.2 * reference.mean(-1)) & (reference.mean(-1) > 0.01)
        exposure = EXPOSED[name] / reference[diffuse].mean() if name in EXPOSED else 1.0
        reference = reference * exposure
        noise = ((halves[0][0] - halves[1][0]) * exposure) ** 2 / 4
        return reference, noise, masks, exposure

    def pathspace(self, glb, integrator, options, out, renderer="pathspace"):
        command = [self.programs[renderer], "render", glb, "-i", integrator, "--width", str(SIDE), "--max-depth", str(MAX_DEPTH), "--filter", "box", "--threads", "2",
                   "-q", *options, "-o", out]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)

    def render(self, name, renderer, integrator, number):
        """An image with its seconds, samples per pixel and renderer's version."""
        out = self.path(f"{name}-{renderer}-{integrator}")
        if renderer in self.programs:
            stats = out + ".json"
            self.pathspace(self.path(f"{name}.glb"), integrator, ["--time", f"{self.a.seconds:g}s", "--seed", str(number), "--stats", stats], out + ".exr", renderer)
            with open(stats) as file:
                facts = json.load(file)
            # The choice of `auto` is a part of what it takes.
            return read(out + ".exr"), facts["seconds"]["render"] + facts["seconds"].get("choose", 0.0), facts["spp"], facts.get("version", "this")
        python = os.environ.get("CYCLES_PYTHON", sys.executable) if renderer == "cycles" else sys.executable
        command = [python, f"{HERE}/render.py", renderer, integrator, name, self.path(name), str(self.a.seconds), str(number), out + ".npy"]
        done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60 + 10 * self.a.seconds)
        facts = json.loads(done.stdout.strip().splitlines()[-1])
        image = np.load(out + ".npy").astype(np.float64)
        if renderer == "luxcore":
            image = np.concatenate([image[1:], image[-1:]])  # its image lies one row lower
        return image, facts["seconds"], facts["spp"], facts["version"]


def read(exr, layer=""):
    """The pixels of an OpenEXR file, or of a layer of it."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    bitmap = mi.Bitmap(exr)
    names = [field.name for field in bitmap.struct_()]
    pixels = np.array(bitmap, np.float64).reshape(SIDE, SIDE, -1)
    return np.stack([pixels[..., names.index(f"{layer}.{c}" if layer else c)] for c in "RGB"], -1)


def measure(image, reference, noise, mask):
    """relMSE without the reference's own, trimmed and not, and the mean against the reference's."""
    error = ((image - reference) ** 2 / (reference**2 + FLOOR)).mean(-1)[mask]
    own = (noise / (reference**2 + FLOOR)).mean(-1)[mask]
    kept = np.argsort(error)[: len(error) - int(np.ceil(TRIM * len(error)))]
    rest = lambda error, own: max(float(error.mean() - own.mean()), 1e-12)
    return {"relmse": rest(error, own), "trimmed": rest(error[kept], own[kept]), "mean": float(image[mask].mean() / reference[mask].mean())}


def print_blocks(images, reference, side):
    """The block means of each contestant's mean image beside those of the reference, row by row; without the half per cent of pixels that are brightest in
    the reference, which are lamps and dots."""
    kept = (reference.max(-1) < np.quantile(reference.max(-1), 0.995))[..., None]
    part = SIDE // side
    mean = lambda image: np.nanmean(np.where(kept, image, np.nan).reshape(side, part, side, part, 3), (1, 3, 4))
    means = {"reference": mean(reference)} | {" ".join(c): mean(np.mean(all, 0)) for c, all in images.items()}
    print(f"{'block':>8}" + "".join(f"{name:>18}" for name in means))
    for y in range(side):
        for x in range(side):
            print(f"{x:>6},{y}" + "".join(f"{mean[y, x]:18.5f}" for mean in means.values()))
    for name in list(means)[1:]:
        off = np.abs(means[name] / means["reference"] - 1)
        print(f"{name}: {off.mean():.2%} from the reference in the mean over blocks, at most {off.max():.2%}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=4, help="of each render")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--reference", type=float, default=120, help="seconds that each reference may take; they are kept")
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--only", default="", help="renderers, or renderer/integrator")
    parser.add_argument("--blocks", type=int, default=0, help="print the means of so many × so many blocks of each renderer's mean image")
    parser.add_argument("--pathspace", default="target/release/pathspace")
    parser.add_argument("--before", action="append", default=[], metavar="NAME=FILE", help="an earlier build of pathspace as one more renderer")
    parser.add_argument("--folder", default="target/peers")
    parser.add_argument("--json", default="target/peers/results.json")
    a = parser.parse_args()
    bench = Bench(a)
    wanted = lambda r, i: not a.only or r in a.only.split(",") or f"{r}/{i}" in a.only.split(",")
    earlier = [(name, i) for name in bench.programs if name != "pathspace" for i in BEFORE]
    contestants = [c for c in OURS + earlier + PEERS if wanted(*c) and (c[0] != "cycles" or "CYCLES_PYTHON" in os.environ)]
    results = []
    for name in a.scenes.split(","):
        reference, noise, masks, exposure = bench.prepare(name)
        own = float((noise / (reference**2 + FLOOR)).mean())
        print(f"\n{name}: reference with relMSE {own:.1e}; " + ", ".join(f"{k} {m.mean():.1%}" for k, m in masks.items()) + " of the pixels", flush=True)
        rounds, images = {c: [] for c in contestants}, {c: [] for c in contestants}
        for number in range(1, a.rounds + 1):
            for c in contestants:
                image, seconds, spp, version = bench.render(name, *c, number)
                images[c].append(image * exposure)
                rounds[c].append((seconds, spp, version, {k: measure(image * exposure, reference, noise, m) for k, m in masks.items()}))
        rows = [summary(name, c, rounds[c]) for c in contestants]
        results += rows
        table(rows, masks)
        if a.blocks:
            print_blocks(images, reference, a.blocks)
        with open(a.json, "w") as file:
            json.dump(results, file, indent=1)


def summary(name, contestant, runs):
    """Medians over the rounds."""
    middle = lambda f: statistics.median(f(run) for run in runs)
    row = {"scene": name, "renderer": contestant[0], "integrator": contestant[1], "version": runs[0][2], "rounds": len(runs)}
    row["samples_per_second"] = middle(lambda r: r[1] * SIDE**2 / r[0])
    row["seconds_per_sample"] = 1 / row["samples_per_second"]
    for mask in runs[0][3]:
        row[mask] = {
            "variance_per_sample": middle(lambda r: r[3][mask]["relmse"] * r[1]),
            "efficiency": middle(lambda r: 1 / (r[3][mask]["relmse"] * r[0])),
            "efficiency_trimmed": middle(lambda r: 1 / (r[3][mask]["trimmed"] * r[0])),
            "mean": middle(lambda r: r[3][mask]["mean"]),
        }
    return row


def table(rows, masks):
    """Each mask's efficiency (trimmed in brackets), mean, and the best of ours as a multiple of it."""
    columns = "".join(f" | {mask:>9} {'(trimmed)':>11} {'var/spp':>9} {'mean':>7} {'ours/it':>8}" for mask in masks)
    print(f"{'':20} {'Ms/s':>6} {'ns/sample':>9}{columns}")
    for row in rows:
        line = f"{row['renderer'] + ' ' + row['integrator']:20} {row['samples_per_second'] / 1e6:6.3f} {row['seconds_per_sample'] * 1e9:9.0f}"
        for mask in masks:
            m = row[mask]
            best = max((r[mask]["efficiency_trimmed"] for r in rows if r["renderer"] == "pathspace"), default=float("nan"))
            line += f" | {m['efficiency']:9.4g} ({m['efficiency_trimmed']:9.4g}) {m['variance_per_sample']:9.3g} {m['mean']:7.4f} {best / m['efficiency_trimmed']:8.2f}"
        print(line, flush=True)


if __name__ == "__main__":
    main()
