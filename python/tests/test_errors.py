"""Errors are exceptions with the sentences of the program."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import SCENES, program, run

import pathspace as ps


def sentence(*words: str) -> str:
    """What the program says is wrong with this command."""
    done = run(program(), *words)
    assert done.returncode in (2, 3, 4), done
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    return line.removeprefix("error: ")


def test_a_missing_file(tmp_path: Path) -> None:
    missing = tmp_path / "missing.glb"
    with pytest.raises(ps.InputError) as raised:
        ps.load(missing)
    assert str(raised.value) == sentence("render", str(missing))
    assert isinstance(raised.value, OSError) and isinstance(raised.value, ps.Error)


def test_a_file_that_is_no_scene(tmp_path: Path) -> None:
    bad = tmp_path / "bad.glb"
    bad.write_bytes(b"glTF but no more")
    with pytest.raises(ps.InputError) as raised:
        ps.load(bad)
    assert str(raised.value) == sentence("render", str(bad))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"integrator": "nosuch"}, ["--integrator=nosuch"]),
        ({"spp": 0}, ["--spp=0"]),
        ({"spp": 4, "time": "1s"}, ["--spp=4", "--time=1s"]),
        ({"crop": (0, 0, 900, 2)}, ["--crop=0,0,900,2"]),
        ({"camera": "nosuch"}, ["--camera=nosuch"]),
        ({"integrator": "light", "splits": 2}, ["--integrator=light", "--splits=2"]),
        ({"width": 30000, "height": 30000}, ["--width=30000", "--height=30000"]),
        ({"layer": {"a b": "CL"}}, ["--layer=a b=CL"]),
        ({"layers": ["classes", "classes"]}, ["--layers=classes,classes"]),
        ({"data": "halves", "spp": 1}, ["--data=halves", "--spp=1"]),
        ({"clamp": float("nan")}, ["--clamp=nan"]),
    ],
)
def test_options_that_make_no_sense(
    cornell: ps.Scene, tmp_path: Path, options: dict[str, Any], words: list[str]
) -> None:
    with pytest.raises(ps.UsageError) as raised:
        cornell.render(**options)
    command = ["render", str(SCENES / "cornell-spheres.glb"), *words, "-o", str(tmp_path / "image.exr")]
    assert str(raised.value) == sentence(*command)
    assert isinstance(raised.value, ValueError)


def test_wrong_types(cornell: ps.Scene) -> None:
    untyped: Any = cornell
    for options in {"sp": 4}, {"output": "x.exr"}, {"spp": object()}, {"transparent": 1}, {"spp": True}:
        with pytest.raises(TypeError, match=next(iter(options))):
            untyped.render(**options)
    with pytest.raises(TypeError):
        untyped.render("bdpt")
    with pytest.raises(TypeError, match="progress"):
        untyped.render(progress=3)
    with pytest.raises(TypeError, match="env is a string"):
        untyped.render(env=b"missing.hdr")
    with pytest.raises(TypeError, match="spp is a string"):
        untyped.render(spp=np.array(4))
    load: Any = ps.load
    with pytest.raises(TypeError):
        load(None)


def test_places_where_nothing_can_be_written(cornell: ps.Scene, tmp_path: Path) -> None:
    image = cornell.render(width=8, spp=1)
    with pytest.raises(ps.OutputError, match="no-such-folder"):
        image.save(tmp_path / "no-such-folder" / "image.exr")
    with pytest.raises(ps.UsageError, match="image.tiff"):
        image.save(tmp_path / "image.tiff")
    with pytest.raises(ps.UsageError, match="'nan' for '--exposure"):
        image.save(tmp_path / "image.png", exposure=float("nan"))


def test_warnings_are_warnings(cornell: ps.Scene) -> None:
    with pytest.warns(ps.PathspaceWarning, match="the image is black") as caught:
        cornell.render(integrator="bdpt", width=8, spp=1, max_depth=1, crop=(0, 7, 8, 8))
    assert caught[0].filename == __file__


RENDERS_LONG = """
import signal
import sys
import pathspace as ps
# A shell that starts the tests in the background has them ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)
scene = ps.load(sys.argv[1])
print("ready", flush=True)
try:
    scene.CALL
except KeyboardInterrupt:
    print("interrupted", flush=True)
    # Nothing of the render is left to hinder the next one.
    print(scene.render(width=8, spp=1).rgb.shape)
"""


@pytest.mark.parametrize(
    "call",
    [
        'render(integrator="bdpt", width=64, time="60s")',
        # No path arrives at the first pixel of an image that is black there.
        'paths((0, 0), 10**9, passes=10**7, width=64, integrator="bdpt")',
        # A pilot that takes its time.
        'prepare(width=2048, max_depth=250, roulette="off")',
    ],
)
def test_ctrl_c_ends_it(call: str) -> None:
    source = RENDERS_LONG.replace("CALL", call)
    command = [sys.executable, "-c", source, str(SCENES / "cornell-spheres.glb")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.5)
        start = time.monotonic()
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=30)
    assert out.splitlines() == ["interrupted", "(8, 8, 3)"]
    assert process.returncode == 0 and time.monotonic() - start < 10
