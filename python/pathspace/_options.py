"""The keywords of :func:`pathspace.load`, :meth:`pathspace.Scene.render` and the reports, for type checkers.

A test holds them to what the command line has. docs/options.md says what each does.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Literal, TypedDict, Union

#: "30s", "5m", "2h", or a number of seconds.
Time = Union[str, float]
#: Integrators by name: ``pathspace --help`` and docs/integrators.md list them.
Name = str


class Look(TypedDict, total=False):
    """How a .png file shows an image."""

    exposure: Union[float, None]
    tone: Literal["none", "filmic", "agx"]
    white_balance: Union[float, None]


class LoadOptions(TypedDict, total=False):
    """Options that reading a file takes."""

    scene: Union[str, int, None]
    variant: Union[str, int, None]
    at: Union[float, None]
    animation: Union[str, int, None]
    limit: Union[Mapping[str, Union[int, str]], None]
    allow_outside: bool
    ignore_required: bool
    drafts: bool


class ViewOptions(TypedDict, total=False):
    """From where, under which sky. Lengths in metres, angles in degrees."""

    camera: Union[str, int, None]
    look_at: Union[str, Sequence[float], None]
    aperture: Union[float, None]
    focus: Union[float, None]
    blades: Union[int, None]
    blade_rotation: Union[float, None]
    build: Union[Literal["fast", "best"], None]
    cull_backfaces: bool
    env: Union[str, os.PathLike[str], None]
    env_color: Union[str, float, Sequence[float], None]
    env_rotate: Union[float, None]
    env_scale: Union[float, None]


class PathOptions(TypedDict, total=False):
    """Which paths, by which random numbers, in an image of which size."""

    width: Union[int, None]
    height: Union[int, None]
    memory_limit: Union[str, int, None]
    max_depth: Union[int, None]
    roulette: Union[str, int, None]
    lights: Union[Literal["all", "uniform", "power", "tree"], None]
    seed: Union[int, None]
    threads: Union[int, None]


class RenderOptions(ViewOptions, PathOptions, total=False):
    """Options of a render."""

    spp: Union[int, None]
    time: Union[Time, None]
    noise: Union[str, float, None]
    integrator: Union[Name, None]
    unbiased: bool
    choice: Union[str, os.PathLike[str], None]
    hemisphere: Union[Literal["bsdf", "uniform"], None]
    min_depth: Union[int, None]
    preset: Union[Literal["direct", "whitted"], None]
    paths: Union[str, None]
    light_samples: Union[int, None]
    splits: Union[int, None]
    light_paths: Union[str, float, None]
    light_vertices: Union[int, None]
    merge_radius: Union[float, None]
    rays: Union[int, None]
    connection_roulette: Union[str, None]
    weights: Union[Literal["plain", "variance-aware"], None]
    sampler: Union[Literal["independent", "sobol"], None]
    filter: Union[Literal["box", "blackman-harris"], None]
    transparent: bool
    clamp: Union[float, None]
    only_strategy: Union[str, Sequence[int], None]
    unweighted: bool
    crop: Union[str, Sequence[int], None]
    layer: Union[Mapping[str, str], None]
    layers: Union[str, Sequence[str], None]
    data: Union[str, Sequence[str], None]
    denoise: bool
    oidn: Union[str, os.PathLike[str], None]
    resume: Union[str, os.PathLike[str], None]


class FileRenderOptions(LoadOptions, RenderOptions, total=False):
    """Options of :func:`pathspace.render_shard`."""


class ReportOptions(ViewOptions, PathOptions, total=False):
    """Options of :func:`pathspace.verify` and :func:`pathspace.converge`."""

    integrators: Union[str, Sequence[Name], None]
    time: Union[Time, None]
    spp: Union[int, None]


class VerifyOptions(ReportOptions, total=False):
    """Options of :func:`pathspace.verify`."""

    bias: Union[str, float, None]


class ConvergeOptions(ReportOptions, total=False):
    """Options of :func:`pathspace.converge`."""

    reference: Union[str, os.PathLike[str], None]
    reference_time: Union[Time, None]
