"""What the tests share: the scenes of the repository, and its program."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import pathspace as ps

ROOT = Path(__file__).resolve().parents[2]
SCENES = ROOT / "scenes"


def wheel_program() -> list[str]:
    """The command that the package installs beside this interpreter."""
    script = shutil.which("pathspace", path=os.path.dirname(sys.executable))
    assert script, "the package has installed no program"
    return [script]


def program() -> list[str]:
    """The program that the package is compared with: the binary at PATHSPACE_PROGRAM, else the package's own."""
    binary = os.environ.get("PATHSPACE_PROGRAM")
    return [binary] if binary else wheel_program()


def run(command: list[str], *words: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Runs a program to its end, whatever that is."""
    return subprocess.run([*command, *words], capture_output=True, text=True, timeout=60, cwd=cwd)


@pytest.fixture(scope="session")
def cornell() -> ps.Scene:
    return ps.load(SCENES / "cornell-spheres.glb")
