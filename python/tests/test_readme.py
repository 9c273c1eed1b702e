"""What README.md shows works as it stands there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from conftest import SCENES

import pathspace as ps

README = Path(__file__).resolve().parents[1] / "README.md"


@pytest.mark.filterwarnings("ignore::pathspace.PathspaceWarning")
def test_the_examples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenes").symlink_to(SCENES)
    ps.load(SCENES / "cornell-spheres.glb").render(width=32, spp=2).save("reference.exr")
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 4
    source = "\n".join(blocks)
    # The same in less time.
    for often, rarely in (
        ("spp=64, width=512", "spp=2, width=32"),
        ('time="60s"', "spp=2, width=16"),
        ('"bdpt"])', '"bdpt"], spp=2, width=16)'),
    ):
        assert source.count(often) == 1, often
        source = source.replace(often, rarely)
    names: dict[str, object] = {}
    exec(source, names)
    assert (tmp_path / "cornell.exr").exists() and (tmp_path / "convergence.html").exists()
    assert "CD" in capsys.readouterr().out
