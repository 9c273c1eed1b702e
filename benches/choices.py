#!/usr/bin/env python3
"""Efficiency of option sets against the first of them, on one scene.

    cargo build --release
    python3 benches/choices.py scenes/cornell-box.glb '-i bdpt' '-i bdpt --light-vertices 2'

Renders all in turn, round after round, each for the same time (or with the same samples, by --spp, or with its own, by --spp among its options); efficiency is 1/(relMSE · seconds), all
pixels and without the worst 0.1 %, as `pathspace compare` has them. Medians over the rounds. The reference is the first set's, for --reference
seconds, with a seed of its own: what is its own noise counts against all alike. Needs nothing besides Python.
"""

import argparse
import json
import statistics
import subprocess
import tempfile
from pathlib import Path


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("options", nargs="+", help="the options of one render, as one argument")
    parser.add_argument("--pathspace", default="target/release/pathspace")
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--spp", type=int, help="so many samples for each in place of a time")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--reference", type=float, default=40.0, metavar="SECONDS")
    parser.add_argument("--width", type=int, default=128)
    args = parser.parse_args()

    with tempfile.TemporaryDirectory() as folder:
        reference, image, facts = (Path(folder) / name for name in ("reference.exr", "image.exr", "facts.json"))

        def render(options, amount, seed, to):
            common = [args.scene, "--width", str(args.width), "--seed", str(seed), "-q", "-o", str(to)]
            subprocess.run([args.pathspace, "render", *common, "--stats", str(facts), *amount, *options.split()], check=True)
            return json.loads(facts.read_text())["seconds"]["render"]

        def errors():
            command = [args.pathspace, "compare", str(image), str(reference), "--json"]
            compared = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)["images"][0]
            return compared["relmse"], compared["relmse-trimmed"]

        render(args.options[0], ["--time", f"{args.reference}s"], 1000, reference)
        amount = ["--spp", str(args.spp)] if args.spp else ["--time", f"{args.seconds}s"]
        measured = {options: [] for options in args.options}
        for round_ in range(args.rounds):
            for options in args.options:
                own_amount = [] if "--spp" in options else amount
                seconds = render(options, own_amount, 1 + round_, image)
                measured[options].append((seconds, *errors()))

    def median(options):
        seconds, *errors = (statistics.median(column) for column in zip(*measured[options]))
        return seconds, *errors, *(1 / (error * seconds) for error in errors)

    first = median(args.options[0])
    print(f"{args.scene}, {args.width} pixels wide, medians of {args.rounds}\n")
    print("| options | seconds | relMSE (trimmed) | efficiency against the first (trimmed) |\n|---|---|---|---|")
    for options in args.options:
        seconds, all_pixels, trimmed, *efficiency = median(options)
        against = [own / its for own, its in zip(efficiency, first[3:])]
        print(f"| `{options}` | {seconds:.2f} | {all_pixels:.3g} ({trimmed:.3g}) | {against[0]:.2f} ({against[1]:.2f}) |")


if __name__ == "__main__":
    main()
