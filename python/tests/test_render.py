"""A render from Python is the program's."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import SCENES, program, run

import pathspace as ps
from pathspace import _native, _options, _words

# Of every kind: sets of layers, expressions, data, alpha, a filter with padding, a crop, a camera and a lens of one's
# own, a map, a goal by noise, and each integrator.
RENDERS: list[tuple[str, dict[str, Any]]] = [
    ("cornell-spheres", {}),
    ("cornell-spheres", {"integrator": "path", "seed": 7, "filter": "blackman-harris"}),
    ("caustic-sphere", {"integrator": "vcm", "spp": 3}),
    ("caustic-ring", {"integrator": "vcm", "spp": 3, "light_paths": 0.5}),
    ("mis-plates", {"integrator": "light", "clamp": 2.5, "max_depth": 3}),
    ("veach-room", {"integrator": "hybrid", "crop": (3, 4, 20, 11), "transparent": True}),
    (
        "caustic-ring",
        {"layers": ["classes", "strategies"], "layer": {"caustics": "C.*[DG]S+L"}, "data": ["halves", "ids", "depth"]},
    ),
    ("outdoor", {"env": SCENES / "outdoor-sky.hdr", "env_rotate": 40, "integrator": "path-light"}),
    ("gem", {"look_at": (0.0, 1.0, 3.0, 0.0, 0.2, 0.0), "aperture": 0.05, "data": "albedo,variance"}),
    ("furnace", {"noise": "50%", "spp": 32, "sampler": "independent"}),
]


def as_words(options: dict[str, Any]) -> list[str]:
    """The options as a person types them: written here once more, so as not to ask the package."""
    words = []
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        if value is True:
            words += [flag]
        elif isinstance(value, dict):
            words += [word for key, one in value.items() for word in (flag, f"{key}={one}")]
        elif isinstance(value, (list, tuple)):
            words += [flag + "=" + ",".join(str(one) for one in value)]
        else:
            words += [flag, str(value)]
    return words


@pytest.mark.filterwarnings("ignore::pathspace.PathspaceWarning")
@pytest.mark.parametrize(("name", "options"), RENDERS)
def test_files_are_those_of_the_program_to_the_byte(name: str, options: dict[str, Any], tmp_path: Path) -> None:
    options = {"width": 40, "spp": 4, **options}
    exr, png = tmp_path / "program.exr", tmp_path / "program.png"
    scene = SCENES / f"{name}.glb"
    done = run(program(), "render", str(scene), *as_words(options), "-o", str(exr), "-o", str(png))
    assert done.returncode == 0, done.stderr

    image = ps.load(scene).render(**options)
    for path in exr, png:
        mine = tmp_path / ("package" + path.suffix)
        image.save(mine)
        assert mine.read_bytes() == path.read_bytes(), path.suffix
        assert image.encode(path.suffix[1:]) == path.read_bytes()


def test_arrays_are_what_the_file_holds(cornell: ps.Scene, tmp_path: Path) -> None:
    image = cornell.render(width=32, spp=6, layers=["classes"], data=["halves", "variance", "ids"])
    image.save(tmp_path / "image.exr")
    assert image.rgb.shape == (image.height, image.width, 3) == (32, 32, 3)
    assert image.rgb.dtype == np.float32

    # The classes are a partition of the image, and the data channels are the arrays.
    total = sum(layer.astype(np.float64) for layer in image.layers.values())
    np.testing.assert_allclose(total, image.rgb, rtol=1e-5, atol=1e-6)
    assert image.halves is not None and image.variance is not None
    even, odd = image.halves
    np.testing.assert_array_equal(even[..., 0], image.data["even.R"])
    np.testing.assert_array_equal(odd[..., 2], image.data["odd.B"])
    np.testing.assert_array_equal(image.variance[..., 1], image.data["variance.G"])
    np.testing.assert_allclose((even + odd) / 2, image.rgb, rtol=1e-5, atol=1e-6)
    assert image.data["id.material"].dtype == np.uint32


def test_what_is_said_of_an_image(cornell: ps.Scene) -> None:
    image = cornell.render(width=16, spp=2, seed=11, integrator="path")
    assert image.spp == 2 and image.header["seed"] == "11"
    assert image.header["integrator"] == "path" and image.header["scene"] == cornell.hash
    assert image.statistics["samples"] == 2 * 16 * 16
    assert image._repr_png_().startswith(b"\x89PNG")
    assert image.crop == (0, 0, 16, 16) and image.alpha is None
    assert cornell.render(width=8, spp=1).variance is None


def test_defaults_are_those_of_the_program(cornell: ps.Scene, caplog: pytest.LogCaptureFixture) -> None:
    """Among them the integrator that a pilot chooses, which says so from a thread of the render's pool."""
    described = {name: default for name, _, default in _native.options("render")}
    assert described["integrator"] == "auto"
    with caplog.at_level(logging.INFO, "pathspace"):
        image = cornell.render(width=8)
    assert image.spp == 64
    (said,) = [line for line in caplog.messages if line.startswith("auto: ")]
    paths = image.header.get("light-paths")
    chosen = image.header["integrator"] + (f" --light-paths {paths}" if paths else "")
    assert said.startswith(f"auto: {chosen}, since ")
    assert not [line for line in caplog.messages if line.startswith("warning: ")]


def test_keywords_are_the_options_of_the_program() -> None:
    def typed(*of: type) -> set[str]:
        return {name for one in of for base in one.__mro__ for name in getattr(base, "__annotations__", {})}

    assert typed(_options.LoadOptions) == _words.load_options()
    everything = typed(_options.RenderOptions, _options.ViewOptions, _options.PathOptions)
    assert everything == _words.render_options()


def test_progress_is_told_and_may_end_a_render(cornell: ps.Scene, capsys: pytest.CaptureFixture[str]) -> None:
    moments: list[ps.Progress] = []
    cornell.render(width=32, spp=64, progress=moments.append)
    assert moments[-1].fraction == 1.0 and moments[-1].spp == 64
    assert [one.spp for one in moments] == sorted(one.spp for one in moments)
    cornell.render(width=8, spp=2, progress=True)
    assert "2/2 spp" in capsys.readouterr().err

    def enough(moment: ps.Progress) -> None:
        raise RuntimeError(f"enough after {moment.spp}")

    with pytest.raises(RuntimeError, match="enough after"):
        cornell.render(width=64, time="20s", progress=enough)


def test_a_png_looks_as_the_program_makes_it(cornell: ps.Scene, tmp_path: Path) -> None:
    file = tmp_path / "program.png"
    words = ["-i=path", "--width=16", "--spp=1", "--exposure=-1", "--tone=agx", "--white-balance=3000"]
    assert run(program(), "render", str(SCENES / "cornell-spheres.glb"), *words, "-o", str(file)).returncode == 0
    image = cornell.render(integrator="path", width=16, spp=1)
    assert image.encode("png", exposure=-1.0, tone="agx", white_balance=3000) == file.read_bytes()
    assert image.encode("png") != file.read_bytes()
    untyped: Any = image
    with pytest.raises(TypeError, match="unexpected keyword argument 'gamma'"):
        untyped.encode("png", gamma=2.2)
    with pytest.raises(ps.UsageError, match="a colour temperature from"):
        image.save(tmp_path / "package.png", white_balance=1.0)


def test_the_pilot_is_told_of(cornell: ps.Scene) -> None:
    """Before the first pass, too, there is something to hear, and a way to end it."""
    moments: list[ps.Progress] = []

    def once(moment: ps.Progress) -> None:
        moments.append(moment)
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        cornell.render(width=2048, max_depth=200, roulette="off", progress=once)
    (moment,) = moments
    assert (moment.fraction, moment.spp) == (0.0, 0) and moment.line.startswith("choosing an integrator")


FORKS = """
import os, signal, sys
import pathspace as ps
scene = ps.load(sys.argv[1])
scene.render(width=16, spp=1).save(sys.argv[2])
child = os.fork()
if child == 0:
    signal.alarm(60)
    scene.render(width=16, spp=1).save(sys.argv[3])
    os._exit(0)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_forked_process_renders(tmp_path: Path) -> None:
    """Threads do not survive a fork: what a render leaves behind must not need them."""
    files = [str(tmp_path / name) for name in ("parent.exr", "child.exr")]
    command = [sys.executable, "-W", "ignore", "-c", FORKS, str(SCENES / "cornell-spheres.glb"), *files]
    assert subprocess.run(command, timeout=120).returncode == 0
    assert len({Path(file).read_bytes() for file in files}) == 1


def test_two_threads_render_at_once(cornell: ps.Scene) -> None:
    """Each is inside a render while the other is, which a lock held over a render would make impossible."""
    together = threading.Barrier(2, timeout=30)
    images: dict[int, ps.Image] = {}

    def render(seed: int) -> None:
        met = False

        def meet(_: ps.Progress) -> None:
            nonlocal met
            if not met:
                met = True
                together.wait()

        images[seed] = cornell.render(integrator="bdpt", width=48, spp=16, seed=seed, threads=1, progress=meet)

    threads = [threading.Thread(target=render, args=(seed,)) for seed in (1, 2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for seed in (1, 2):
        alone = cornell.render(integrator="bdpt", width=48, spp=16, seed=seed)
        np.testing.assert_array_equal(images[seed].rgb, alone.rgb)


def resident() -> int:
    """Bytes of memory that the process has now."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmRSS:")[1].split()[0]) * 1024


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no /proc to read the memory from")
def test_a_thousand_renders_leave_nothing_behind(cornell: ps.Scene) -> None:
    def render(count: int) -> None:
        for seed in range(count):
            image = cornell.render(integrator="bdpt", width=8, spp=1, seed=seed, threads=1)
            assert image.rgb[0, 0, 0] >= 0.0

    render(200)
    before = resident()
    render(1000)
    # An image of 8 × 8 with its film takes some 10 kB: one in ten that stays would show.
    assert resident() - before < 1 << 20
