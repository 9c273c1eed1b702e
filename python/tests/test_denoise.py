"""Denoising from Python is the program's."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import SCENES, program, run

import pathspace as ps

pytest.importorskip("pyoidn", reason="no library that denoises: pip install pyoidn")


def test_the_file_is_the_programs(cornell: ps.Scene, tmp_path: Path) -> None:
    # In a process of its own: the package's program finds the library of the package beside it.
    words = ["--integrator=bdpt", "--width=48", "--spp=8", "--data=albedo,normals", "--denoise", "-o", "program.exr"]
    command = [sys.executable, "-m", "pathspace"]
    done = run(command, "render", str(SCENES / "cornell-spheres.glb"), *words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    options: dict[str, Any] = {"integrator": "bdpt", "width": 48, "spp": 8, "data": ["albedo", "normals"]}
    noisy = cornell.render(**options)
    for image in noisy.denoise(), cornell.render(denoise=True, **options):
        image.save(tmp_path / "mine.exr")
        assert (tmp_path / "mine.exr").read_bytes() == (tmp_path / "program.exr").read_bytes()
        np.testing.assert_array_equal(image.layers["noisy"], noisy.rgb)
        assert "albedo and normals" in image.header["denoised"]
        assert abs(float(image.rgb.mean() / noisy.rgb.mean()) - 1.0) < 0.05
    assert "denoised" not in noisy.header and "noisy" not in noisy.layers


def test_it_is_closer_to_the_reference(cornell: ps.Scene) -> None:
    reference = cornell.render(integrator="bdpt", width=96, spp=256, seed=1)
    noisy = cornell.render(integrator="bdpt", width=96, spp=4, data=["albedo", "normals", "halves"])
    image = noisy.denoise()
    report = ps.compare(noisy, image, reference)
    before, after = (one.errors["flip"] for one in report.images)
    assert after < 0.85 * before
    # Halves are of the image as rendered, and say nothing of this one.
    assert ps.compare(noisy, noisy).p_of_no_bias is not None
    assert report.p_of_no_bias is None


def test_without_albedo_that_is_a_warning(cornell: ps.Scene) -> None:
    noisy = cornell.render(integrator="path", width=16, spp=2)
    with pytest.warns(ps.PathspaceWarning, match="no albedo") as caught:
        image = noisy.denoise()
    assert caught[0].filename == __file__
    assert "colours alone" in image.header["denoised"]


def test_what_is_refused(cornell: ps.Scene) -> None:
    noisy = cornell.render(integrator="path", width=16, spp=2, data="albedo")
    with pytest.raises(ps.UsageError, match="pip install pyoidn"):
        noisy.denoise("/nonexistent/lib.so")
    with pytest.raises(ps.UsageError, match="pip install pyoidn"):
        cornell.render(denoise=True, oidn="/nonexistent")
    with pytest.raises(ps.UsageError, match="denoised already"):
        noisy.denoise().denoise()


def test_the_program_without_the_package_says_how_to_get_it(tmp_path: Path) -> None:
    words = ["render", str(SCENES / "cornell-box.glb"), "--denoise", "--oidn", "/nonexistent", "-o", "x.exr"]
    done: subprocess.CompletedProcess[str] = run(program(), *words, cwd=tmp_path)
    assert done.returncode == 2 and "pip install pyoidn" in done.stderr and not list(tmp_path.iterdir())
