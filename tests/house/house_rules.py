#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The rules of the house that a script can see (CONTRIBUTING.md): which way includes go, licence lines, file lengths,
no paths of somebody's machine, and README code that is the example's own. Prints every breach; exit 1 when there is one.

usage: house_rules.py ROOT"""

import os
import re
import sys
from pathlib import Path, PurePosixPath

# Folder -> folders whose public headers it may include, apart from its own. base ◀ codec, base ◀ container, ...
FOLDERS = {
    "base": set(),
    "codec": {"base"},
    "container": {"base"},
    "io": {"base", "codec"},
    "inspect": {"base", "codec"},
    "muxer/lavf": {"base", "codec", "container"},
    "muxer/gst": {"base", "codec", "container", "io", "inspect", "lavf"},
    "cli": {"base", "codec", "container", "io", "inspect", "lavf"},
}

# Rooms of codec/ that only an encoder has. Every other room is shared with, or is, the decoder.
ENCODER_ROOMS = {"extract", "motion", "encode"}
ENCODER_HEADERS = {"isoreel/codec/encoder.h"}

# What else a folder may include besides the standard library and the operating system. A folder that is not named
# here is free to use the libraries that its CMakeLists.txt finds.
LIBRARIES = {
    "base": r"$^",
    "codec": r"xxhash\.h$|Eigen/",
    "container": r"xxhash\.h$|zstd\.h$|isa-l/",
    "examples": r"gst/",
}
SYSTEM = re.compile(r"[a-z_0-9]+$|(sys/\w+|fcntl|unistd|errno|poll|pthread|immintrin|arm_neon)(\.h)?$")

SOURCE_FOLDERS = [folder for folder in FOLDERS if "/" not in folder] + ["muxer", "examples", "tests", "bench", "cmake", ".ci"]
CXX = {".h", ".cc"}
LICENSED = CXX | {".py", ".sh", ".cmake"}
LICENCE = "SPDX-License-Identifier: BSD-3-Clause"
LONG_LINES, TOO_LONG_LINES = 500, 600

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
# Folders of a machine that this project was once written on; the pattern is put together so as not to match itself.
FOREIGN_PATH = re.compile(r"(?<![\w.-])(/wo" r"rk/|(\.\./)*sha" r"red/(data|design))")
UNFINISHED = re.compile(r"\b(TO" r"DO|FIX" r"ME|XX" r"X)\b")


def project_files(root):
    """Every file of the project: the folders we know and the files at the root, without build products."""
    for entry in sorted(root.iterdir()):
        if entry.is_file() and entry.name != ".git":  # a file in a worktree
            yield entry
    for folder in SOURCE_FOLDERS + ["spec"]:
        for where, folders, names in os.walk(root / folder):
            folders[:] = sorted(f for f in folders if f not in ("build", "__pycache__"))
            yield from (Path(where) / name for name in sorted(names))


def text_of(path):
    """The file's text, or None when it is not text."""
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return None


def room_of(path):
    """The room of codec/ that a path within it lies in: 'encode' for codec/encode/x.cc, 'include' for public headers."""
    return PurePosixPath(path).parts[0]


def resolve(root, source, folder, header):
    """Path of a quoted include within its folder, as a posix string, or None when there is no such file."""
    for base in (root / folder, source.parent):
        target = Path(os.path.normpath(base / header))
        if target.is_file() and (root / folder) in target.parents:
            return target.relative_to(root / folder).as_posix()
    return None


def public_breach(folder, room, header):
    """What is wrong with <isoreel/...> in a file of this folder and room, or None."""
    target = header.split("/")[1]
    if folder == "examples":
        return None
    if target != PurePosixPath(folder).name and target not in FOLDERS[folder]:
        return f"{folder}/ must not include {target}/"
    if folder == "codec" and header in ENCODER_HEADERS and room not in ENCODER_ROOMS and room != "include":
        return f"codec/{room} is the decoder's too and must not include the encoder"
    return None


def room_breach(room, target):
    """What is wrong with a file in `room` of codec/ that includes one in room `target`, or None."""
    if room in ENCODER_ROOMS and target == "decode":
        return f"codec/{room} must not include codec/decode"
    if room not in ENCODER_ROOMS and target in ENCODER_ROOMS:
        return f"codec/{room} must not include codec/{target}"
    if room not in ENCODER_ROOMS | {"decode"} and target == "decode":
        return f"codec/{room} is shared by both sides and must not include codec/decode"
    return None


def include_breaches(root, source, text):
    """Yields (line number, what is wrong) for each include of a C++ file."""
    relative = source.relative_to(root)
    depth = 2 if relative.parts[0] == "muxer" else 1
    folder = "/".join(relative.parts[:depth])
    if folder not in FOLDERS and folder != "examples":
        return
    inner = PurePosixPath(*relative.parts[depth:])
    room = room_of(inner) if folder == "codec" else ""
    public = inner.parts[0] == "include"
    for match in INCLUDE.finditer(text):
        quote, header = match.groups()
        line = text.count("\n", 0, match.start(2)) + 1
        breach = None
        if header.startswith("isoreel/"):
            breach = public_breach(folder, room, header)
            if quote == '"':
                breach = breach or "public headers are included with <>"
        elif quote == '"':
            target = resolve(root, source, folder, header)
            if public:
                breach = "a public header must not include a private one"
            elif target is None:
                breach = f'"{header}" is not a file of {folder}/'
            elif folder == "codec":
                breach = room_breach(room, room_of(target))
        elif not SYSTEM.match(header):
            if folder in LIBRARIES and not re.match(LIBRARIES[folder], header):
                breach = f"{folder}/ must not use this library"
            elif folder == "codec" and header.startswith("Eigen/") and room not in ENCODER_ROOMS:
                breach = f"codec/{room} is the decoder's too and must not use Eigen"
            elif header.startswith("isa-l/") and relative.as_posix() != "container/src/parity.cc":
                breach = "only parity.cc, of isoreel::repair, uses ISA-L: readers do without"
            elif public and folder in ("io", "inspect", "muxer/lavf", "muxer/gst"):
                breach = "a public header must not need a third party's"
        if breach:
            yield line, f"includes {header}: {breach}"


def text_breaches(root, path, text):
    """Yields (line number, what is wrong) for rules that hold for every text file."""
    if (path.suffix in LICENSED or path.name in ("CMakeLists.txt", "dev", "run")) and LICENCE not in text[:300]:
        yield 1, f"has no line '{LICENCE}' at its start"
    for match in FOREIGN_PATH.finditer(text):
        yield text.count("\n", 0, match.start()) + 1, f"names a path of somebody's machine: {match.group()}"
    if path.suffix in LICENSED:
        for match in UNFINISHED.finditer(text):
            yield text.count("\n", 0, match.start()) + 1, f"says {match.group()}: finish it or leave it out"
        lines = text.count("\n")
        if lines > TOO_LONG_LINES:
            yield lines, f"has {lines} lines, above {TOO_LONG_LINES}: split it"


QUOTED = re.compile(r"^<!-- quoted from (?P<path>\S+) -->\n```\w*\n(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL)
EXAMPLE = "examples/walk_triangles.cc"


def stripped(text):
    return "\n".join(line.strip() for line in text.strip("\n").splitlines())


def quotes(code, source):
    """Whether the paragraphs of `code` stand in `source`, in their order, whatever the indentation."""
    text, position = stripped(source), 0
    for paragraph in stripped(code).split("\n\n"):
        position = text.find(paragraph, position)
        if position < 0:
            return False
    return True


def readme_breaches(root):
    """Yields (line, what is wrong): code in README.md behind `<!-- quoted from FILE -->` must be lines of that file."""
    readme = root / "README.md"
    if not readme.is_file():
        yield 1, f"is missing: it quotes {EXAMPLE}"
        return
    text, quoted = readme.read_text(encoding="utf-8"), set()
    for match in QUOTED.finditer(text):
        name = match["path"]
        quoted.add(name)
        source = root / name
        if not source.is_file() or not quotes(match["code"], source.read_text(encoding="utf-8")):
            yield text.count("\n", 0, match.start()) + 1, f"quotes code that is not in {name}"
    if EXAMPLE not in quoted:
        yield 1, f"does not quote {EXAMPLE} (a block behind <!-- quoted from {EXAMPLE} -->)"


def breaches(root):
    """Every breach in the tree at `root`, as 'file:line: text'."""
    root = Path(root).resolve()
    found = []
    for path in project_files(root):
        text = text_of(path)
        if text is None:
            continue
        name = path.relative_to(root).as_posix()
        found += [f"{name}:{line}: {what}" for line, what in text_breaches(root, path, text)]
        if path.suffix in CXX:
            found += [f"{name}:{line}: {what}" for line, what in include_breaches(root, path, text)]
    found += [f"README.md:{line}: {what}" for line, what in readme_breaches(root)]
    return found


def long_files(root):
    """Files above the length that CONTRIBUTING.md advises: told, not refused."""
    for path in project_files(Path(root).resolve()):
        text = text_of(path) if path.suffix in LICENSED else None
        if text is not None and text.count("\n") > LONG_LINES:
            yield f"{path}: {text.count(chr(10))} lines, above {LONG_LINES}"


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    for warning in long_files(sys.argv[1]):
        print("warning:", warning)
    found = breaches(sys.argv[1])
    print("\n".join(found) if found else "house rules: every file keeps them")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
