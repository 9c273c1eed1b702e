"""Renders a probe by Mitsuba: a sphere with a BSDF of its own, under the environment."""

import ctypes.util
import os

import numpy as np


def render(bsdf, environment, camera, side, spp, depth):
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", ctypes.util.find_library("LLVM-19") or "libLLVM.so.19.1")
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    turn = mi.ScalarTransform4f()
    scene = mi.load_dict({
        "type": "scene", "integrator": {"type": "path", "max_depth": depth, "rr_depth": 1000},
        "sensor": {"type": "perspective", "fov": camera.fov, "near_clip": 0.01, "far_clip": 100.0,
                   "to_world": turn.look_at(origin=list(camera.origin), target=list(camera.target), up=[0, 1, 0]),
                   "film": {"type": "hdrfilm", "width": side, "height": side, "pixel_format": "rgb", "component_format": "float32", "rfilter": {"type": "box"}},
                   "sampler": {"type": "independent"}},
        # Its maps have −z where ours have +x.
        "sky": {"type": "envmap", "filename": environment, "to_world": turn.rotate([0, 1, 0], 90)},
        # Its poles lie on its z axis.
        "ball": {"type": "sphere", "to_world": turn.rotate([1, 0, 0], -90), "bsdf": bsdf},
    })
    return np.array(mi.render(scene, spp=spp, seed=1), np.float64)
