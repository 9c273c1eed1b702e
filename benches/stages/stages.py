"""Samples renders with perf and prints nanoseconds per sample by stage: see `run`."""

import argparse
import collections
import json
import os
import re
import statistics
import subprocess

# The innermost function of a sample that lies in one of these files decides about its stage, in this order for each
# function; operations of lanes and of vectors are in none, so that they count for who asks for them.
STAGES = {
    "closest hits": r"src/scene/geometry/(?!corners|offset|attributes|mesh|areas)",
    "shadow rays": r"(?!)",
    "random numbers": r"src/sampling/",
    "film": r"src/film/|src/render/(deposit|statistics)",
    "weights": r"src/path/(mis|rivals|variance|strategy|merging|meeting_places|light_paths|roulette)",
    "lights": r"src/scene/(light|areas)",
    "surfaces": r"src/scene/|src/path/(scattering|tilt|departure|absorption)",
    "walks and connections": r"src/(path|integrator|render)",
}
SHADOW = re.compile(r"obstacle|visible|any_hit|unoccluded|occluded|shadow")
REST = "everything else"


def addresses(data, program):
    """How often each address of the program was met, and how often something else was."""
    text = subprocess.run(["perf", "script", "-i", data, "-F", "ip", "--show-mmap-events"], capture_output=True, text=True).stdout
    segments = [
        [int(x, 16) for x in m.groups()]
        for m in re.finditer(r"LOAD\s+(0x\w+)\s+(0x\w+)\s+0x\w+\s+(0x\w+)", subprocess.run(["readelf", "-lW", program], capture_output=True, text=True).stdout)
    ]
    maps, met, elsewhere = [], collections.Counter(), 0
    for line in text.splitlines():
        if (m := re.search(r"MMAP2?.*\[(0x\w+)\((0x\w+)\) @ (0x\w+|0) .*r-xp (.*)", line)) and os.path.basename(m[4]) == os.path.basename(program):
            maps.append([int(x, 16) for x in m.groups()[:3]])
        elif m := re.fullmatch(r"\s*([0-9a-f]+)\s*", line):
            ip = int(m[1], 16)
            offset = next((ip - start + at for start, size, at in maps if start <= ip < start + size), None)
            if offset is None:
                elsewhere += 1
            else:
                virtual = next((offset - at + to for at, to, size in segments if at <= offset < at + size), offset)
                met[virtual] += 1
    return met, elsewhere


def stage(frames):
    """Of a sample in these functions, innermost first: (name, file) each."""
    for _, file in frames:
        for name, files in STAGES.items():
            if re.search(files, file):
                seeks_any = name == "closest hits" and any(SHADOW.search(function) for function, _ in frames)
                return "shadow rays" if seeks_any else name
    return REST


def stages(data, program):
    """The share of each stage."""
    met, elsewhere = addresses(data, program)
    order = list(met)
    asked = "\n".join(f"{x:#x}" for x in order)
    # `-a` prints each address before its functions, from the innermost: a line for the name, one for the place.
    text = subprocess.run(["llvm-addr2line", "-e", program, "-a", "-f", "-i", "-C"], input=asked, capture_output=True, text=True).stdout
    shares, frames, address = collections.Counter({REST: elsewhere}), [], None

    def close():
        if address is not None:
            shares[stage(frames)] += met[address]

    lines = iter(text.splitlines())
    for line in lines:
        if line.startswith("0x"):
            close()
            address, frames = int(line, 16), []
        else:
            frames.append((line, next(lines)))
    close()
    total = sum(shares.values())
    return {name: count / total for name, count in shares.items()}


def measured(program, scene, integrator, a):
    """Nanoseconds of each stage for a sample, of one thread; the time is a median of several renders."""
    stats, data = (os.path.join(a.folder, x) for x in ("stats.json", "perf.data"))
    render = [program, "render", scene, "-i", integrator, "--width", str(a.side), "--height", str(a.side), "--max-depth", "12", "--spp", str(a.spp)]
    render += ["--threads", "1", "-q", "--stats", stats, "-o", os.path.join(a.folder, "stages.exr")]
    times = []
    for _ in range(a.rounds):
        subprocess.run(render, check=True, stdout=subprocess.DEVNULL)
        with open(stats) as file:
            times.append(json.load(file)["seconds"]["render"])
    subprocess.run(["perf", "record", "-q", "-F", "2000", "-o", data, *render], check=True, stdout=subprocess.DEVNULL)
    nanoseconds = statistics.median(times) / (a.side**2 * a.spp) * 1e9
    return {name: share * nanoseconds for name, share in stages(data, program).items()}


def draw(columns, file):
    """A bar for each column, of its stages."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(9, 4.5))
    for at, (_, shares) in enumerate(columns):
        below = 0.0
        for colour, name in enumerate([*STAGES, REST]):
            height = shares.get(name, 0.0)
            axes.bar(at, height, 0.7, below, color=f"C{colour}", label=name if at == 0 else None)
            below += height
    axes.set_xticks(range(len(columns)), [name for name, _ in columns], fontsize=8)
    axes.set_ylabel("ns per sample, one thread")
    handles, names = axes.get_legend_handles_labels()
    axes.legend(handles[::-1], names[::-1], fontsize=8, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    figure.savefig(file, dpi=100)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=["scenes/cornell-box.glb", "scenes/caustic-sphere.glb"], metavar="SCENE")
    parser.add_argument("--program", default="target/release/pathspace", help="that of this tree")
    parser.add_argument("--before", metavar="PROGRAM", help="an earlier build beside it")
    parser.add_argument("--integrators", default="path,bdpt")
    parser.add_argument("--side", type=int, default=256, help="pixels")
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--picture", metavar="FILE")
    parser.add_argument("--folder", default="target/stages")
    a = parser.parse_args()
    os.makedirs(a.folder, exist_ok=True)
    programs = ([("before", a.before)] if a.before else []) + [("now", a.program)]
    columns = []
    for scene in a.scenes:
        for integrator in a.integrators.split(","):
            for name, program in programs:
                shares = measured(program, scene, integrator, a)
                columns.append((f"{os.path.basename(scene)[:-4]}\n{integrator}\n{name}", shares))
    names = [" ".join(name.split("\n")) for name, _ in columns]
    print("| ns per sample | " + " | ".join(names) + " |\n" + "|---" * (len(names) + 1) + "|")
    for stage in [*STAGES, REST]:
        print(f"| {stage} | " + " | ".join(f"{shares.get(stage, 0.0):.0f}" for _, shares in columns) + " |")
    print("| all | " + " | ".join(f"{sum(shares.values()):.0f}" for _, shares in columns) + " |")
    if a.picture:
        draw(columns, a.picture)


if __name__ == "__main__":
    main()
