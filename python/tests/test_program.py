"""The program that the package installs has the binary's exit codes and signals."""

from __future__ import annotations

import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from conftest import SCENES, run, wheel_program

CORNELL = str(SCENES / "cornell-spheres.glb")


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["--version"], 0, "pathspace "),
        (["render", "--help"], 0, "--spp <N>"),
        (["info", CORNELL], 0, "triangles"),
        (["paint"], 2, "unrecognized subcommand 'paint'"),
        (["render", CORNELL, "--spp", "none"], 2, "invalid value 'none'"),
        (["render", "missing.glb"], 3, "missing.glb"),
        (["render", CORNELL, "--spp=1", "--width=8", "-o", "missing/image.exr"], 4, "missing"),
    ],
)
def test_exit_codes(words: list[str], code: int, said: str, tmp_path: Path) -> None:
    done = run(wheel_program(), *words, cwd=tmp_path)
    assert done.returncode == code, done
    assert said in done.stdout + done.stderr
    module = run([sys.executable, "-m", "pathspace"], *words, cwd=tmp_path)
    assert (module.returncode, module.stdout, module.stderr) == (code, done.stdout, done.stderr)


def test_a_comparison_that_fails(tmp_path: Path) -> None:
    for seed in "1", "2":
        words = ["render", CORNELL, "--spp=1", "--width=8", "--seed", seed, "-o", f"{seed}.exr"]
        assert run(wheel_program(), *words, cwd=tmp_path).returncode == 0
    done = run(wheel_program(), "compare", "1.exr", "2.exr", "--fail-above", "mse=1e-9", cwd=tmp_path)
    assert done.returncode == 1, done


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_finish_the_pass_and_keep_it(number: signal.Signals, code: int, tmp_path: Path) -> None:
    words = ["render", CORNELL, "-i=bdpt", "--time=60s", "--width=64", "-o", "image.exr", "--progress=plain"]
    with subprocess.Popen([*wheel_program(), *words], cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        while "spp" not in process.stderr.readline():
            assert process.poll() is None
        time.sleep(0.2)
        process.send_signal(number)
        _, said = process.communicate(timeout=30)
    assert process.returncode == code, said
    assert "Traceback" not in said
    assert "interrupted; to go on: pathspace render" in said and "--resume image.checkpoint.exr" in said
    assert (tmp_path / "image.exr").exists() and (tmp_path / "image.checkpoint.exr").exists()
    # The command that it says goes on from there.
    (line,) = [line for line in said.splitlines() if line.startswith("interrupted; ")]
    command = shlex.split(line.removeprefix("interrupted; to go on: "))
    # Within less time than the checkpoint has, that is one more pass.
    words = [word.replace("--time=60s", "--time=1ms") for word in command[1:]]
    again = run(wheel_program(), *words, cwd=tmp_path)
    assert again.returncode == 0, again.stderr


def test_a_reader_that_has_heard_enough() -> None:
    command = [*wheel_program(), "info", CORNELL]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()
        said = process.stderr.read()
    assert process.returncode == 0 and said == b""
