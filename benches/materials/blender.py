"""Renders a glTF file by Cycles: blender.py JOB, JSON with `file`, `environment`, `camera` (16 numbers, column by column, y up), `fov` in degrees, `side`,
`spp`, `depth`, `corrected` and `out`, an OpenEXR file. Lights of the file are left out. Prints the version."""

import json
import math
import os
import sys

import bpy
from mathutils import Matrix

THREADS = 2
# Blender's z is up.
TURNED = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))


def surround(scene, path):
    scene.world = world = bpy.data.worlds.new("environment")
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    nodes.clear()
    image = nodes.new("ShaderNodeTexEnvironment")
    image.image = bpy.data.images.load(os.path.abspath(path))
    background, output = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeOutputWorld")
    links.new(image.outputs["Color"], background.inputs["Color"])
    links.new(background.outputs[0], output.inputs["Surface"])


def look(scene, columns, fov):
    lens = bpy.data.cameras.new("view")
    lens.sensor_fit, lens.angle, lens.clip_start, lens.clip_end = "HORIZONTAL", math.radians(fov), 1e-4, 1e4
    scene.camera = bpy.data.objects.new("view", lens)
    scene.collection.objects.link(scene.camera)
    scene.camera.matrix_world = TURNED @ Matrix([columns[i::4] for i in range(4)])


def settle(scene, job):
    r, c = scene.render, scene.cycles
    r.engine, r.resolution_x, r.resolution_y, r.resolution_percentage = "CYCLES", job["side"], job["side"], 100
    r.threads_mode, r.threads, r.use_compositing, r.use_sequencer = "FIXED", THREADS, False, False
    c.device, c.pixel_filter_type, c.use_adaptive_sampling, c.use_denoising = "CPU", "BOX", False, False
    c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = c.volume_bounces = job["depth"] - 1
    c.transparent_max_bounces = 256
    c.sample_clamp_direct = c.sample_clamp_indirect = c.blur_glossy = c.light_sampling_threshold = 0
    c.caustics_reflective = c.caustics_refractive = True
    c.samples, c.seed = job["spp"], 1
    r.image_settings.file_format, r.image_settings.color_depth, r.image_settings.color_mode = "OPEN_EXR", "32", "RGB"
    r.filepath = os.path.abspath(job["out"])


def corrected(material):
    """Gives Blender's nodes the numbers that mean in Cycles what glTF's mean, where its importer hands over others.

    Anisotropy: α_x/α_y is 1/(1 − 0.9 a) in Cycles and mix(α, 1, strength²)/α in glTF. Base colour: Cycles tints a refraction by its root. Absorption: Cycles
    has density · (1 − colour), glTF −ln(colour)/distance.
    """
    nodes = material.node_tree.nodes
    for node in nodes:
        if node.type == "BSDF_PRINCIPLED":
            rough, strength, base = (node.inputs[name] for name in ("Roughness", "Anisotropic", "Base Color"))
            if strength.default_value > 0 and not rough.is_linked and not strength.is_linked:
                y = rough.default_value**2
                x = y + (1 - y) * strength.default_value**2
                rough.default_value, strength.default_value = (x * y) ** 0.25, (1 - y / x) / 0.9
            if node.inputs["Transmission Weight"].default_value == 1 and not base.is_linked:
                base.default_value = [c * c for c in base.default_value[:3]] + [1]
        if node.type == "VOLUME_ABSORPTION":
            sigma = [-math.log(max(c, 1e-6)) * node.inputs["Density"].default_value for c in node.inputs["Color"].default_value[:3]]
            most = max(sigma)
            node.inputs["Density"].default_value = most
            node.inputs["Color"].default_value = [1 - s / most if most else 1 for s in sigma] + [1]


def main(job):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    bpy.ops.import_scene.gltf(filepath=os.path.abspath(job["file"]), import_shading="NORMALS")
    scene = bpy.context.scene
    for thing in [o for o in bpy.data.objects if o.type == "LIGHT"]:
        bpy.data.objects.remove(thing)
    for material in bpy.data.materials if job["corrected"] else []:
        corrected(material)
    surround(scene, job["environment"])
    look(scene, job["camera"], job["fov"])
    settle(scene, job)
    bpy.ops.render.render(write_still=True)
    print("version", bpy.app.version_string)


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
