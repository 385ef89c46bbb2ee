# SPDX-License-Identifier: BSD-3-Clause
"""Loads numbered mesh files (.ply, .stl, .glb) into Blender as an animation: an object for each file, shown in its
frame and hidden in all others. Blender 2.93 and later.

usage: blender --python blender_sequence.py -- FOLDER [--fps 25] [--save FILE.blend]"""

import argparse
import re
import sys
from pathlib import Path

import bpy
import numpy

# Operators that newer releases have, before those of older ones.
IMPORTERS = {
    ".ply": [("wm", "ply_import"), ("import_mesh", "ply")],
    ".stl": [("wm", "stl_import"), ("import_mesh", "stl")],
    ".glb": [("import_scene", "gltf")],
}


def arguments():
    words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    parser = argparse.ArgumentParser(prog="blender --python blender_sequence.py --")
    parser.add_argument("folder", type=Path, help="where the files are")
    parser.add_argument("--fps", type=int, default=25, help="frames a second (default: %(default)s)")
    parser.add_argument("--save", type=Path, help="a .blend file to write")
    return parser.parse_args(words)


def numbered(folder):
    """(number, file) of each mesh, in order: the last digits of its name are its number."""
    found = []
    for file in folder.iterdir():
        digits = re.findall(r"\d+", file.stem)
        if file.suffix.lower() in IMPORTERS and digits:
            found.append((int(digits[-1]), file))
    return sorted(found)


def imported(file):
    """The file's mesh objects: none for a frame without a surface."""
    if file.suffix.lower() == ".glb" and not hasattr(numpy, "bool"):
        numpy.bool = bool  # the importer of Debian 12's Blender wants a name that its numpy no longer has
    before = set(bpy.data.objects)
    for group, name in IMPORTERS[file.suffix.lower()]:
        if name in dir(getattr(bpy.ops, group)):
            getattr(getattr(bpy.ops, group), name)(filepath=str(file))
            break
    new = [thing for thing in bpy.data.objects if thing not in before]
    for thing in new:
        if file.suffix.lower() == ".glb":  # glTF's y is up, and the importer turned it: turn it back
            thing.rotation_mode = "XYZ"
            thing.rotation_euler = (-1.5707963267948966, 0, 0)
        for polygon in thing.data.polygons if thing.type == "MESH" else ():
            polygon.use_smooth = True
    return new


def show_only_at(thing, number):
    """Keyframes of visibility hold their value until the next one."""
    for frame, hidden in ((number - 1, True), (number, False), (number + 1, True)):
        thing.hide_viewport = thing.hide_render = hidden
        thing.keyframe_insert("hide_viewport", frame=frame)
        thing.keyframe_insert("hide_render", frame=frame)


def main():
    options = arguments()
    files = numbered(options.folder)
    if not files:
        sys.exit(f"{options.folder}: no numbered .ply, .stl or .glb file")
    if "Cube" in bpy.data.objects:  # of the file that Blender starts with
        bpy.data.objects.remove(bpy.data.objects["Cube"])
    for number, file in files:
        for thing in imported(file):
            thing.name = file.stem
            show_only_at(thing, number)
    scene = bpy.context.scene
    scene.render.fps = options.fps
    scene.frame_start, scene.frame_end = files[0][0], files[-1][0]
    scene.frame_set(scene.frame_start)
    print(f"{len(files)} frames, {len(bpy.data.meshes)} meshes")
    if options.save:
        bpy.ops.wm.save_as_mainfile(filepath=str(options.save.resolve()))


main()
