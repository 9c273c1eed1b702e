"""Renders a scene by another renderer for about so many seconds: render.py RENDERER INTEGRATOR SCENE FOLDER SECONDS SEED OUT

Writes OUT.npy, the radiance of SIDE × SIDE pixels with the top row first, and prints seconds, samples per pixel and version as JSON. Loading and compiling are
not in the seconds.
"""

import ctypes.util
import json
import math
import os
import sys
import time

import numpy as np

from scenes import MAX_DEPTH, SCENES, SIDE, luxcore_scene, mitsuba_scene

THREADS = 2


def mitsuba(integrator, scene, folder, seconds, seed):
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", ctypes.util.find_library("LLVM-19") or "libLLVM.so.19.1")
    import drjit as dr
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    dr.set_thread_count(THREADS)
    loaded = mi.load_dict(mitsuba_scene(scene, folder, integrator))
    at_once = 16
    one = lambda seed: np.array(mi.render(loaded, spp=at_once, seed=seed), np.float64)
    one(12345)  # compiles
    total, passes, start = 0.0, 0, time.time()
    while time.time() - start < seconds or passes < 2:
        total, passes = total + one(1000 * seed + passes), passes + 1
    return total / passes, time.time() - start, passes * at_once, mi.__version__


def luxcore(engine, scene, folder, seconds, seed):
    import pyluxcore as lux

    lux.Init()
    lux.SetLogHandler(lambda _: None)
    properties = lambda text: (p := lux.Properties(), p.SetFromString(text))[0]
    loaded = lux.Scene()
    loaded.Parse(properties(luxcore_scene(scene, folder)))
    options = {
        "path": ["renderengine.type = PATHCPU"],
        "hybrid": ["renderengine.type = PATHCPU", "path.hybridbackforward.enable = 1", "path.hybridbackforward.partition = 0.8",
                   "path.hybridbackforward.glossinessthreshold = 0.05"],
        # With its Russian roulette its images are too bright.
        "bidir": ["renderengine.type = BIDIRCPU", "path.russianroulette.depth = 1000"],
        # With its own 16,384 light paths per pass, its first passes are incomplete for minutes, and its images half as bright.
        "vcm": ["renderengine.type = BIDIRVMCPU", "path.russianroulette.depth = 1000", "bidirvm.lightpath.count = 4096"],
    }[engine]
    depths = [f"path.pathdepth.{kind} = {MAX_DEPTH}" for kind in ("total", "diffuse", "glossy", "specular")]
    config = lux.RenderConfig(properties("\n".join([
        *options, *depths, f"path.maxdepth = {MAX_DEPTH}", f"light.maxdepth = {MAX_DEPTH}", "sampler.type = SOBOL", "sampler.sobol.adaptive.strength = 0",
        f"native.threads.count = {THREADS}", f"renderengine.seed = {seed}", f"film.width = {SIDE}", f"film.height = {SIDE}", "film.filter.type = NONE",
        "film.imagepipelines.0.0.type = NOP", "film.outputs.0.type = RGB", "film.outputs.0.filename = x.exr",
        "path.clamping.variance.maxvalue = 0", "lightstrategy.type = POWER",
    ]) + "\n"), loaded)
    session = lux.RenderSession(config)
    session.Start()
    start = time.time()
    while time.time() - start < seconds:
        time.sleep(0.1)
        session.UpdateStats()
    session.Stop()
    took = time.time() - start
    spp = session.GetStats().Get("stats.renderengine.pass").GetFloats()[0]
    image = np.zeros((SIDE, SIDE, 3), np.float32)
    session.GetFilm().GetOutputFloat(lux.FilmOutputType.RGB, image, 0)
    return np.flipud(image), took, spp, lux.Version()


def cycles(_, scene, _folder, seconds, seed):
    import bpy
    from mathutils import Matrix

    from scenes import camera_matrix

    bpy.ops.wm.read_factory_settings(use_empty=True)
    world = bpy.data.worlds.new("black")
    world.use_nodes = True
    if background := world.node_tree.nodes.get("Background"):
        background.inputs["Strength"].default_value = 0
    settings = bpy.context.scene
    settings.world = world
    materials = {}
    for name, (kind, value) in scene.materials.items():
        materials[name] = material = bpy.data.materials.new(name)
        material.use_nodes = True
        nodes, links = material.node_tree.nodes, material.node_tree.links
        nodes.clear()
        output = nodes.new("ShaderNodeOutputMaterial")

        def node(kind, **inputs):
            made = nodes.new(kind)
            for key, x in inputs.items():
                made.inputs[key].default_value = x
            return made

        if kind == "diffuse":
            shader = node("ShaderNodeBsdfDiffuse", Color=(*value, 1), Roughness=0)
        elif kind == "glass":
            shader = node("ShaderNodeBsdfGlass", Color=(1, 1, 1, 1), Roughness=0, IOR=value)
        elif kind == "mirror":
            shader = node("ShaderNodeBsdfAnisotropic", Color=(value, value, value, 1), Roughness=0)
        else:
            shader = nodes.new("ShaderNodeMixShader")
            sides = nodes.new("ShaderNodeNewGeometry")
            links.new(sides.outputs["Backfacing"], shader.inputs[0])
            links.new(node("ShaderNodeEmission", Color=(*[x / max(value) for x in value], 1), Strength=max(value)).outputs[0], shader.inputs[1])
            links.new(node("ShaderNodeBsdfDiffuse", Color=(0, 0, 0, 1)).outputs[0], shader.inputs[2])
            material.cycles.emission_sampling = "FRONT"
        links.new(shader.outputs[0], output.inputs["Surface"])
    for mesh in scene.meshes:
        data = bpy.data.meshes.new(mesh.name)
        data.from_pydata(mesh.positions.tolist(), [], mesh.triangles.tolist())
        data.materials.append(materials[mesh.material])
        if mesh.normals is None:
            data.shade_flat()
        else:
            data.shade_smooth()
            data.normals_split_custom_set_from_vertices(mesh.normals.tolist())
        settings.collection.objects.link(bpy.data.objects.new(mesh.name, data))
    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit, lens.angle, lens.clip_start, lens.clip_end = "HORIZONTAL", math.radians(scene.camera.fov), 0.001, 1000
    settings.camera = bpy.data.objects.new("camera", lens)
    settings.collection.objects.link(settings.camera)
    settings.camera.matrix_world = Matrix(np.array(camera_matrix(scene.camera)).reshape(4, 4).T.tolist())
    settings.render.engine = "CYCLES"
    settings.render.resolution_x = settings.render.resolution_y = SIDE
    settings.render.threads_mode, settings.render.threads = "FIXED", THREADS
    c = settings.cycles
    c.device, c.pixel_filter_type, c.use_adaptive_sampling, c.use_denoising = "CPU", "BOX", False, False
    c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = MAX_DEPTH - 1
    c.sample_clamp_direct = c.sample_clamp_indirect = c.blur_glossy = c.light_sampling_threshold = 0
    c.caustics_reflective = c.caustics_refractive = True
    file = f"/tmp/cycles-{os.getpid()}.exr"
    settings.render.image_settings.file_format, settings.render.image_settings.color_depth, settings.render.filepath = "OPEN_EXR", "32", file

    def render(spp):
        c.samples, c.seed, start = spp, seed, time.time()
        bpy.ops.render.render(write_still=True)
        return time.time() - start

    render(1)
    spp = max(16, int(16 * seconds / max(render(16), 0.05)))
    took = render(spp)
    image = bpy.data.images.load(file)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.array(image.pixels[:], np.float32).reshape(SIDE, SIDE, 4)[::-1, :, :3]
    os.unlink(file)
    return pixels, took, spp, bpy.app.version_string


if __name__ == "__main__":
    renderer, integrator, scene, folder, seconds, seed, out = sys.argv[1:]
    run = {"mitsuba": mitsuba, "luxcore": luxcore, "cycles": cycles}[renderer]
    image, took, spp, version = run(integrator, SCENES[scene](), folder, float(seconds), int(seed))
    np.save(out, image.astype(np.float32))
    print(json.dumps({"seconds": took, "spp": spp, "version": version}), flush=True)
    os._exit(0)  # none of them ends cleanly every time
