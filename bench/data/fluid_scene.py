# SPDX-License-Identifier: BSD-3-Clause
"""Bakes a liquid with Blender's Mantaflow, without a window; its cache of OpenVDB files is the set.

usage: blender --background --factory-startup --python-exit-code 1 --python fluid_scene.py -- SCENE NODES FRAMES FOLDER

SCENE is droplets (seven drops fall into a pool) or splash (two columns of liquid collide among obstacles)."""

import json
import random
import sys
from pathlib import Path

import bpy

FRAMES_PER_SECOND = 50


def box(name, low, high):
    """A box from corner to corner, in units of the domain, which is the cube from 0 to 1."""
    bpy.ops.mesh.primitive_cube_add(size=1, location=[(a + b) / 2 for a, b in zip(low, high)])
    bpy.context.object.scale = [b - a for a, b in zip(low, high)]
    bpy.context.object.name = name
    return bpy.context.object


def ball(name, centre, radius):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=radius, location=centre)
    bpy.context.object.name = name
    return bpy.context.object


def fluid(thing, kind):
    """Gives a thing its part in the simulation, and the settings of that part."""
    modifier = thing.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = kind
    return {"DOMAIN": lambda: modifier.domain_settings, "FLOW": lambda: modifier.flow_settings,
            "EFFECTOR": lambda: modifier.effector_settings}[kind]()


def liquid(thing, velocity=(0, 0, 0)):
    flow = fluid(thing, "FLOW")
    flow.flow_type = "LIQUID"
    flow.flow_behavior = "GEOMETRY"
    flow.use_initial_velocity = any(velocity)
    flow.velocity_coord = velocity


def droplets():
    liquid(box("pool", (0, 0, 0), (1, 1, 0.2)))
    dice = random.Random(7)
    for i in range(7):
        column, row = i % 3, i // 3
        centre = (0.25 + 0.25 * column + dice.uniform(-0.05, 0.05), 0.25 + 0.25 * row + dice.uniform(-0.05, 0.05),
                  dice.uniform(0.32, 0.75))
        liquid(ball(f"drop {i}", centre, dice.uniform(0.045, 0.085)), (0, 0, -1.5))


def splash():
    liquid(box("left", (0.02, 0.02, 0.02), (0.25, 0.98, 0.7)), (2, 0, 0))
    liquid(box("right", (0.75, 0.02, 0.02), (0.98, 0.98, 0.6)), (-2, 0, 0))
    liquid(ball("ball", (0.5, 0.5, 0.8), 0.1), (0, 0, -1))
    for i, (low, high) in enumerate([((0.4, 0.2, 0), (0.5, 0.35, 0.3)), ((0.55, 0.6, 0), (0.65, 0.8, 0.4))]):
        fluid(box(f"obstacle {i}", low, high), "EFFECTOR").effector_type = "COLLISION"


def main():
    scene, nodes, frames, folder = sys.argv[sys.argv.index("--") + 1:]
    folder = Path(folder).resolve()
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    bpy.context.scene.render.fps = FRAMES_PER_SECOND
    bpy.context.scene.frame_end = int(frames)
    {"droplets": droplets, "splash": splash}[scene]()

    cube = box("domain", (0, 0, 0), (1, 1, 1))
    domain = fluid(cube, "DOMAIN")
    domain.domain_type = "LIQUID"
    domain.resolution_max = int(nodes)
    domain.use_adaptive_domain = False
    domain.use_mesh = False
    domain.cache_directory = str(folder / "cache")
    domain.cache_type = "ALL"
    domain.cache_data_format = "OPENVDB"
    domain.cache_resumable = True  # or else the level set is not kept
    domain.cache_frame_start, domain.cache_frame_end = 1, int(frames)
    domain.openvdb_cache_compress_type = "BLOSC"
    bpy.context.view_layer.objects.active = cube
    bpy.ops.fluid.bake_all()

    baked = sorted((folder / "cache" / "data").glob("fluid_data_*.vdb"))
    if len(baked) != int(frames):
        sys.exit(f"fluid_scene: {len(baked)} frames were baked, of {frames}")
    described = {"name": f"{scene} {nodes}³", "inputs": ["cache/data/" + file.name for file in baked], "grid": "phi",
                 "isovalues": [0], "inside": "below"}
    (folder / "set.json").write_text(json.dumps(described, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


main()
