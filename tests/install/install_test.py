#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Installs a build to a fresh folder, moves the folder, and uses what is in it: the command, a CMake project that finds
the package, and programs compiled by one line with pkg-config. What they print is compared with the command's own."""

import argparse
import json
import math
import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent


def run(*words, code=0, **more):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False, **more)
    if done.returncode != code:
        sys.exit(f"{shlex.join(map(str, words))} exits {done.returncode}: {done.stdout[-2000:]}{done.stderr[-4000:]}")
    return done.stdout + (done.stderr if code else "")


def check(condition, message):
    if not condition:
        sys.exit(message)


def check_walk(command, walk, file):
    """The triangles that an example walks have the areas that the encoder wrote down."""
    walked = [float(area) for area in re.findall(r"area (\S+)", run(walk, file))]
    frames = json.loads(run(command, "info", file, "--frames", "--json"))["frame_list"]
    check(len(walked) == len(frames) == 10, f"{walk} walks {len(walked)} frames of {len(frames)}")
    for area, frame in zip(walked, frames):
        check(math.isclose(area, frame["area"], rel_tol=1e-6), f"{walk}: area {area}, where {frame['area']} is right")


def check_contour(contour, volume, folder):
    meshes = [folder / f"mesh.{extension}" for extension in ("ply", "stl", "vtp")]
    quads = int(run(contour, volume, *meshes).split()[0])
    check(quads > 1000, f"{contour} finds {quads} quads")
    check(meshes[1].stat().st_size == 84 + 100 * quads, f"{contour} writes an STL file of a wrong size")


def check_not_found(options, folder, environment, components, message):
    """A component that cannot be had is refused with its reason."""
    (folder / "refused").mkdir(exist_ok=True)
    (folder / "refused/CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.25)\nproject(refused LANGUAGES NONE)\n"
        f"find_package(isoreel 0.1 REQUIRED COMPONENTS {components})\n")
    said = run(options.cmake, "-S", folder / "refused", "-B", folder / "refused/build", code=1, env=environment)
    check(message in " ".join(said.split()), f"find_package for {components} says: {said}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("cmake", "compiler", "flags", "build", "source"):
        parser.add_argument("--" + name, required=True)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run(options.cmake, "--install", options.build, "--prefix", folder / "first")
        prefix = (folder / "first").rename(folder / "moved")
        [package] = prefix.glob("**/isoreelConfig.cmake")
        [modules] = prefix.glob("**/pkgconfig")
        environment = dict(os.environ, CMAKE_PREFIX_PATH=str(prefix), PKG_CONFIG_PATH=str(modules))
        for text in [*package.parent.iterdir(), *modules.iterdir()]:
            check(options.source not in text.read_text(), f"{text} names the source folder")

        command, data = prefix / "bin/isoreel", prefix / "share/isoreel/droplets"
        check((data / "README.md").is_file(), "the bundled sequence is not installed")
        for name in ("man/man1/isoreel.1", "man/man1/isoreel-encode.1", "bash-completion/completions/isoreel",
                     "mime/packages/isoreel.xml", "isoreel/isoreel.magic"):
            check((prefix / "share" / name).is_file(), f"share/{name} is not installed")
        volume = sorted(data.glob("*.vdb"))[0]
        reel = folder / "solver.isr"

        # pkg-config: one line each, dynamic libraries of others or static ones alike.
        flags = shlex.split(options.flags)
        for module, static, source in (("codec", "--static", "examples/record_solver.cc"),
                                       ("decoder", None, "examples/walk_triangles.cc")):
            words = ["pkg-config", "--cflags", "--libs", *filter(None, [static]), f"isoreel-{module}"]
            line = shlex.split(run(*words, env=environment))
            run(options.compiler, "-std=c++20", *flags, Path(options.source) / source, "-o", folder / module, *line)
        run(folder / "codec", reel)
        check_walk(command, folder / "decoder", reel)
        for module in ("container", "io", "inspect", "lavf"):
            run("pkg-config", "--exists", "--print-errors", f"isoreel-{module} = 0.1.0", env=environment)

        build = folder / "build"
        run(options.cmake, "-S", HERE / "consumer", "-B", build, "-G", "Ninja", f"-DEXAMPLES={options.source}/examples",
            f"-DCMAKE_CXX_COMPILER={options.compiler}", f"-DCMAKE_CXX_FLAGS={options.flags}", env=environment)
        run(options.cmake, "--build", build)
        check_walk(command, build / "walk_triangles", reel)
        check_contour(build / "contour", volume, folder)

        line = shlex.split(run("pkg-config", "--libs", "isoreel-io", env=environment))
        [object_file] = build.glob("**/contour.cc.o")
        run(options.compiler, *flags, object_file, "-o", folder / "contour", *line)
        check_contour(folder / "contour", volume, folder)

        check_not_found(options, folder, environment, "player", "isoreel has no component player")
        hidden = dict(environment, PKG_CONFIG_LIBDIR=str(modules))
        check_not_found(options, folder, hidden, "decoder", "isoreel::container needs these, by pkg-config: libzstd")
    print("installed, moved, found and used")


if __name__ == "__main__":
    main()
