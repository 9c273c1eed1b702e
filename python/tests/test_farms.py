"""Shards by Open Job Description and by Dask, with killed renderers: the bytes are those of the single render."""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from threading import Thread
from types import ModuleType

import pytest
from conftest import ROOT, SCENES, run, wheel_program

import pathspace as ps

CORNELL = SCENES / "cornell-spheres.glb"
# Long enough to be killed on the way, with checkpoints all the time.
OPTIONS = ["-i", "bdpt", "--spp", "96", "--width", "96"]


@pytest.fixture(scope="session")
def single(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    image = tmp_path_factory.mktemp("single") / "image.exr"
    done = run(wheel_program(), "render", str(CORNELL), *OPTIONS, "-o", str(image))
    assert done.returncode == 0, done
    return image.read_bytes()


def renderers(folder: Path) -> list[int]:
    """The processes that render a shard in this folder."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0") if entry.name.isdigit() else []
        except OSError:
            continue
        if b"--shard" in b" ".join(words) and bytes(folder) in b" ".join(words) and words[0] != b"bash":
            found.append(int(entry.name))
    return found


def parent(process: int) -> int:
    status = Path(f"/proc/{process}/stat").read_text()
    return int(status.rpartition(")")[2].split()[1])


def first_renderer(folder: Path) -> int:
    """A renderer, as soon as there is one that has begun."""
    end = time.monotonic() + 60
    while not (found := renderers(folder)):
        assert time.monotonic() < end, "nothing renders"
        time.sleep(0.02)
    time.sleep(0.3)
    return found[0]


def kill_with_worker(folder: Path) -> None:
    """Kills a renderer, and before it the worker that waits for it."""
    renderer = first_renderer(folder)
    for process in parent(renderer), renderer:
        os.kill(process, signal.SIGKILL)


def test_shards_by_hand(tmp_path: Path) -> None:
    whole = tmp_path / "whole.exr"
    ps.load(CORNELL).render(integrator="path", spp=5, width=16).save(whole)
    shards = [tmp_path / f"{i}.exr" for i in (1, 2)]
    for i, shard in enumerate(shards, 1):
        ps.render_shard(CORNELL, shard, i, 2, integrator="path", spp=5, width=16)
    with pytest.raises(ps.Error, match="there are none of the numbers"):
        ps.merge(shards[:1], tmp_path / "part.exr")
    ps.merge(reversed(shards), tmp_path / "merged.exr")
    assert (tmp_path / "merged.exr").read_bytes() == whole.read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["1.exr", "2.exr", "merged.exr", "whole.exr"]
    with pytest.raises(ps.InputError, match="no.glb"):
        ps.render_shard(tmp_path / "no.glb", tmp_path / "3.exr", 1, 2)
    with pytest.raises(ps.UsageError, match="3/2"):
        ps.render_shard(CORNELL, tmp_path / "3.exr", 3, 2)
    with pytest.raises(TypeError, match="resume"):
        ps.render_shard(CORNELL, tmp_path / "3.exr", 1, 2, resume="x.exr")


@pytest.mark.parametrize("how", ["renderer killed", "task ended"])
def test_open_job_description(how: str, single: bytes, tmp_path: Path) -> None:
    openjd = Path(sys.executable).with_name("openjd")
    template = str(ROOT / "cluster" / "openjd" / "pathspace.yaml")
    assert run([str(openjd)], "check", template).returncode == 0
    image, parts = tmp_path / "the image.exr", tmp_path / "its parts, and what's there (now)"
    # What a shell would take for its own is quoted.
    options = " ".join([*OPTIONS, "--checkpoint-every", "0.01", "--seed", "'0'"])
    scene = tmp_path / "it's a scene.glb"
    scene.symlink_to(CORNELL)
    given = dict(Scene=scene, Output=image, Parts=parts, Shards=3, Options=options, Pathspace=wheel_program()[0])
    command = [str(openjd), "run", template, *(w for name, value in given.items() for w in ("-p", f"{name}={value}"))]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as job:
        renderer = first_renderer(parts)
        if how == "task ended":
            # As a farm ends it: the script hears SIGTERM, and the renderer keeps what it has.
            os.kill(parent(renderer), signal.SIGTERM)
        else:
            os.kill(renderer, signal.SIGKILL)
        said, _ = job.communicate(timeout=120)
    assert job.returncode != 0 and not image.exists(), said
    assert not renderers(parts)
    assert how != "task ended" or list(parts.glob("*.checkpoint.exr"))
    again = subprocess.run(command, capture_output=True, text=True, timeout=240)
    assert again.returncode == 0, again.stdout + again.stderr
    assert image.read_bytes() == single
    assert sorted(file.name for file in parts.iterdir()) == ["1.exr", "2.exr", "3.exr"]


def example() -> ModuleType:
    specification = importlib.util.spec_from_file_location("dask_farm", ROOT / "python" / "examples" / "dask_farm.py")
    assert specification and specification.loader
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.mark.filterwarnings("default")
def test_dask(single: bytes, tmp_path: Path) -> None:
    from dask.distributed import Client, LocalCluster

    image = tmp_path / "image.exr"
    with (
        LocalCluster(  # type: ignore[no-untyped-call, unused-ignore]
            n_workers=2, threads_per_worker=1, dashboard_address=None
        ) as cluster,
        Client(cluster) as client,  # type: ignore[no-untyped-call, unused-ignore]
    ):
        workers = set(client.run(os.getpid).values())
        killer = Thread(target=kill_with_worker, args=(tmp_path,))
        killer.start()
        example().render(client, CORNELL, image, 3, integrator="bdpt", spp=96, width=96)
        killer.join()
        assert set(client.run(os.getpid).values()) != workers, "a worker died"
    assert image.read_bytes() == single
    assert [file.name for file in tmp_path.iterdir()] == ["image.exr"]
