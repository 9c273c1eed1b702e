"""Compares posed scenes with those of Blender's glTF importer, by the boxes around all meshes.

    pip install bpy
    python benches/animation/blender.py target/release/pathspace MODEL.gltf...

Prints, for each model, the greatest distance between the boxes' sides at the keys of its animations, and half-way
between keys. Blender interpolates the components of quaternions, not along the great arc, so that rotations agree on
keys alone.
"""

import json
import subprocess
import sys

import bpy

#: Blender's times are frames in 32-bit numbers.
FPS = 1000.0


def described(program, model, seconds):
    words = [program, "info", "--json", "--at", repr(seconds), model]
    return json.loads(subprocess.run(words, capture_output=True, check=True, text=True).stdout)


def keys():
    """The times of all keys of what was imported, in seconds."""
    curves = (
        curve
        for action in bpy.data.actions
        for layer in action.layers
        for strip in layer.strips
        for bag in strip.channelbags
        for curve in bag.fcurves
    )
    return sorted({point.co.x / FPS for curve in curves for point in curve.keyframe_points})


def box(seconds):
    """The least and greatest coordinates of all vertices, in glTF's axes."""
    frame = seconds * FPS
    bpy.context.scene.frame_set(int(frame), subframe=frame - int(frame))
    graph = bpy.context.evaluated_depsgraph_get()
    places = []
    for thing in bpy.context.scene.objects:
        # The importer adds a ball as the shape of bones.
        if thing.type == "MESH" and "Icosphere" not in thing.name:
            posed = thing.evaluated_get(graph)
            places += [posed.matrix_world @ vertex.co for vertex in posed.to_mesh().vertices]
    places = [(x, z, -y) for x, y, z in places]
    return [*map(min, *places), *map(max, *places)]


def main(program, models):
    for model in models:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.context.scene.render.fps = int(FPS)
        bpy.ops.import_scene.gltf(filepath=model)
        # It shows the first animation, and has the others in tracks that are muted.
        for data in filter(None, (thing.animation_data for thing in bpy.data.objects)):
            for strip in data.nla_tracks[0].strips if data.nla_tracks else []:
                data.action, data.action_slot = strip.action, strip.action_slot
        on = keys()
        between = [(a + b) / 2 for a, b in zip(on, on[1:])]
        for what, times in [("on keys", on), ("between keys", between)]:
            found = [(described(program, model, t)["geometry"]["bounds"], box(t)) for t in times]
            worst = max(abs(a - b) for ours, theirs in found for a, b in zip(ours["min"] + ours["max"], theirs))
            print(f"{model.rsplit('/', 1)[-1]}: {len(times)} times {what}, {worst:.1e} m", flush=True)


main(sys.argv[1], sys.argv[2:])
