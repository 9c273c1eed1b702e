"""Prints the tables of docs/performance.md and benches/notes/peers.md from what compare.py measured: pages.py RESULTS [summary|full]"""

import json
import sys

HEADINGS = {
    "all": "All pixels:",
    "diffuse": "Pixels that see a diffuse surface first:",
    "caustic": "Pixels of which a fifth or more is caustic:",
}
NAMES = {"mitsuba": "Mitsuba", "luxcore": "LuxCore", "cycles": "Cycles", "bidir": "BIDIRCPU", "vcm": "BIDIRVMCPU"}


def name(row):
    renderer, integrator = row["renderer"], row["integrator"]
    ours = renderer not in NAMES
    return f"{NAMES.get(renderer, renderer)} `{integrator if ours else NAMES.get(integrator, integrator)}`"


def markdown(header, rows):
    print("| " + " | ".join(header) + " |")
    print("|" + "---|" * len(header))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print()


def unique(values):
    return list(dict.fromkeys(values))


def summary(results):
    """Renderers by scenes: trimmed efficiency over each mask, and samples per second."""
    scenes, names = unique(r["scene"] for r in results), unique(map(name, results))
    at = {(name(r), r["scene"]): r for r in results}

    def by(heading, value, scenes):
        print(heading + "\n")
        cell = lambda n, s: f"{value(at[n, s]):.3g}" if (n, s) in at else "–"
        markdown(["renderer", *scenes], [[n, *(cell(n, s) for s in scenes)] for n in names])

    for mask, heading in HEADINGS.items():
        having = unique(r["scene"] for r in results if mask in r)
        if having:
            by(heading, lambda r: r[mask]["efficiency_trimmed"], having)
    by("Million samples per second:", lambda r: r["samples_per_second"] / 1e6, scenes)


def full(results):
    """All numbers of each scene."""
    for scene in unique(r["scene"] for r in results):
        rows = [r for r in results if r["scene"] == scene]
        print(f"### {scene}\n")
        for mask, heading in HEADINGS.items():
            if mask not in rows[0]:
                continue
            print(heading + "\n")
            cells = lambda r, m: [
                name(r),
                f"{r['samples_per_second'] / 1e6:.2f}",
                f"{m['efficiency']:.3g} ({m['efficiency_trimmed']:.3g})",
                f"{m['variance_per_sample']:.3g}",
                f"{m['mean']:.4f}",
            ]
            header = ["renderer", "Ms/s", "efficiency (trimmed)", "variance/sample", "mean"]
            markdown(header, [cells(r, r[mask]) for r in rows])


if __name__ == "__main__":
    with open(sys.argv[1]) as file:
        results = json.load(file)
    {"summary": summary, "full": full}[sys.argv[2] if len(sys.argv) > 2 else "summary"](results)
