"""Parts of a render for other machines: what schedulers and farms call."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Union

from ._errors import Error, InputError, OutputError, UsageError
from ._words import file_words, load_options, options, words

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._options import FileRenderOptions

#: By exit code (docs/scripting.md).
_FAILURES = {2: UsageError, 3: InputError, 4: OutputError}


def render_shard(
    file: Union[str, os.PathLike[str]],
    output: Union[str, os.PathLike[str]],
    index: int,
    count: int,
    **given: Unpack[FileRenderOptions],
) -> None:
    """Renders the ``index``-th (from 1) of ``count`` parts of the samples of the scene in ``file`` into the .exr file
    ``output``, for :func:`merge`. The options are those of :func:`load` and :meth:`Scene.render`.

    A file that is there already is not rendered again, whatever its options were: remove the shards of another render,
    or name them otherwise. One that was stopped goes on from the checkpoint beside it. Files are complete or missing,
    so it can be called again wherever it was killed; in its own process, so that nothing else is killed with it.

    Raises what :meth:`Scene.render` raises, which will recur, and :class:`pathspace.Error` if the process was ended.
    """
    shard = FilePath(output)
    if shard.exists():
        return
    checkpoint = shard.with_suffix(".checkpoint.exr")
    options_of_it = words("render_shard", "render", {*options("render"), *load_options()} - {"resume"}, given)
    resume = [f"--resume={checkpoint}"] if checkpoint.exists() else []
    part = [f"--shard={index}/{count}", f"--checkpoint={checkpoint}", f"--output={shard}"]
    _run("render", *file_words(file), *options_of_it, *part, *resume)
    checkpoint.unlink(missing_ok=True)


def merge(shards: Iterable[Union[str, os.PathLike[str]]], output: Union[str, os.PathLike[str]]) -> None:
    """Adds shards, in any order, and writes the image to ``output`` (.exr or .png): the file that one render of all
    samples writes, to the byte.

    Raises as :func:`render_shard`, and if samples are missing.
    """
    _run("merge", *(word for shard in shards for word in file_words(shard)), f"--output={os.fspath(output)}")


def _run(*command: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pathspace", *command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    if done.returncode == 0:
        return
    lines = done.stderr.strip().splitlines()
    said = [line[len("error: ") :] for line in lines if line.startswith("error: ")] or lines[-1:]
    failure = _FAILURES.get(done.returncode, Error)
    raise failure(said[0] if said else f"'pathspace {command[0]}' ended with exit code {done.returncode}")
