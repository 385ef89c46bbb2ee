#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""usage: symbols.py SOURCE LIBRARY... [--write]: the functions that programs may have been linked against: those in the
static libraries whose names stand in the installed headers. Compares them with symbols.txt. A function that is gone or takes
other arguments breaks programs that were built before: after 1.0 it needs a new major version. Whoever means it writes the
list anew (--write) and says so in CHANGELOG.md."""
import pathlib
import re
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
LIST = HERE / "symbols.txt"


def words_of(headers):
    """Identifiers of the headers' code; of classes that they only name, as `struct State;`, members are nobody's."""
    text = "\n".join(re.sub(r"//.*", "", header.read_text()) for header in headers)
    return set(re.findall(r"\w+", text)) - set(re.findall(r"^ +(?:struct|class) (\w+);", text, re.M))


def symbols_of(library, words):
    command = ["nm", "--demangle", "--defined-only", "--extern-only", library]
    listed = subprocess.run(command, check=True, capture_output=True, text=True)
    for line in listed.stdout.splitlines():
        kind, _, name = line[17:].partition(" ")
        if kind != "T" or not name.startswith("isoreel::") or re.search(r"\(anonymous|\[clone|::State", name):
            continue
        called = re.sub(r"\[abi:\w+\]", "", name).split("(")[0]
        if set(re.findall(r"\w+", called)) <= words:
            yield name


def main():
    source = pathlib.Path(sys.argv[1])
    words = words_of(source.glob("*/include/**/*.h")) | words_of(source.glob("muxer/*/include/**/*.h"))
    libraries = [pathlib.Path(word) for word in sys.argv[2:] if word != "--write"]
    found = {f"{library.stem}: {name}" for library in libraries for name in symbols_of(library, words)}
    if "--write" in sys.argv:
        LIST.write_text("".join(line + "\n" for line in sorted(found)))
        return
    pinned = set(LIST.read_text().splitlines())
    changes = [f"gone: {line}" for line in sorted(pinned - found)] + [f"new: {line}" for line in sorted(found - pinned)]
    sys.exit("\n".join(["symbols.txt differs (symbols.py --write makes it anew):", *changes]) if changes else 0)


if __name__ == "__main__":
    main()
