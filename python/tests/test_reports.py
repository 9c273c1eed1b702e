"""The reports are those of the program."""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import SCENES, program, run

import pathspace as ps

CORNELL = SCENES / "cornell-spheres.glb"


def test_verify_is_the_programs(cornell: ps.Scene, tmp_path: Path) -> None:
    words = ["--spp=8", "--width=24", "--integrators=path,bdpt", "-o", "folder", "--json"]
    done = run(program(), "verify", str(CORNELL), *words, cwd=tmp_path)
    heard: list[float] = []
    report = ps.verify(
        cornell, spp=8, width=24, integrators=["path", "bdpt"], progress=lambda part, what: heard.append(part)
    )
    theirs = json.loads(done.stdout)
    # Times are never the same.
    for one in (*theirs["integrators"], *report.json["integrators"]):
        del one["seconds"]
    assert {**report.json, "summary": ""} == {**theirs, "summary": ""}
    assert done.returncode == report.json["exit"]
    assert report.outcome in ("agree", "undecided") and report.integrators[1].name == "bdpt"
    assert report.comparisons[0].pair == ("path", "bdpt") and report.comparisons[0].p is not None
    row = report.comparisons[0].to_dict()
    assert set(row) >= {"pair", "p", "verdict"} and report.to_dict()["integrators"][0]["name"] == "path"
    report.save(tmp_path / "mine")
    assert sorted(os.listdir(tmp_path / "mine")) == sorted(os.listdir(tmp_path / "folder"))
    for name in report.files:
        if name.endswith(".exr"):
            assert (tmp_path / "mine" / name).read_bytes() == (tmp_path / "folder" / name).read_bytes()
    with pytest.raises(ps.UsageError, match="two or more"):
        ps.verify(cornell, integrators=["path"])


def test_converge_measures(cornell: ps.Scene, tmp_path: Path) -> None:
    report = ps.converge(cornell, spp=16, width=16, integrators=["path", "bdpt"], max_depth=5)
    assert [one.name for one in report.integrators] == ["path", "bdpt"]
    rows = report.rows()
    assert rows[0]["integrator"] == "path" and rows[0]["spp"] >= 1 and rows[-1]["spp"] == 16
    assert all(row["relmse"] > 0.0 for row in rows)
    # More samples, less error.
    path = report.integrators[0].snapshots
    assert path[-1].errors["relmse"] < path[0].errors["relmse"]
    report.save(tmp_path / "page.html")
    assert "<svg" in (tmp_path / "page.html").read_text(encoding="utf-8")
    assert report.csv.count("\n") > len(rows)
    with pytest.raises(ps.InputError, match="missing.exr"):
        ps.converge(cornell, reference=tmp_path / "missing.exr")


def test_ctrl_c_ends_a_report(cornell: ps.Scene) -> None:
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        ps.verify(cornell, time="60s", width=32)
    assert time.monotonic() - start < 20


def test_compare_is_the_programs(cornell: ps.Scene, tmp_path: Path) -> None:
    images = {}
    for name, seed, spp in ("a", 1, 4), ("b", 2, 4), ("r", 3, 32):
        images[name] = cornell.render(width=32, spp=spp, seed=seed, data="halves")
        images[name].save(tmp_path / f"{name}.exr")
    done = run(program(), "compare", "a.exr", "b.exr", "--reference", "r.exr", "--json", cwd=tmp_path)
    theirs = json.loads(done.stdout)
    from_memory = ps.compare(images["a"], images["b"], images["r"])
    from_files = ps.compare(tmp_path / "a.exr", str(tmp_path / "b.exr"), tmp_path / "r.exr")
    for report in from_memory, from_files:
        for mine, other in zip(report.images, theirs["images"]):
            for metric, error in mine.errors.items():
                assert error == pytest.approx(other[metric], rel=1e-12), metric
            assert mine.brighter == pytest.approx(other["brighter"], rel=1e-12)
        assert report.p_of_no_bias == pytest.approx(theirs["p_of_no_bias"], rel=1e-9)
    np.testing.assert_array_equal(from_memory.difference, images["a"].rgb - images["b"].rgb)
    mse = np.mean((images["a"].rgb.astype(np.float64) - images["r"].rgb) ** 2)
    assert from_memory.images[0].errors["mse"] == pytest.approx(mse, rel=1e-9)
    assert ps.compare(images["a"].rgb, tmp_path / "a.exr").to_dict()["images"][0]["mse"] == 0.0


def test_what_cannot_be_compared(tmp_path: Path) -> None:
    grey = np.full((4, 5, 3), 0.5, np.float32)
    with pytest.raises(ps.UsageError, match="only images of one size"):
        ps.compare(grey, grey[:, :4])
    with pytest.raises(ps.UsageError, match=r"b has the shape \(4, 5\), and \(n, n, 3\)"):
        ps.compare(grey, grey[..., 0])
    with pytest.raises(ps.UsageError, match="a holds numbers that are not finite"):
        ps.compare(grey * np.nan, grey)
    with pytest.raises(TypeError, match="b is no array of numbers"):
        ps.compare(grey, {"b": 1})  # type: ignore[arg-type]
    with pytest.raises(ps.InputError, match="missing.exr"):
        ps.compare(grey, tmp_path / "missing.exr")
