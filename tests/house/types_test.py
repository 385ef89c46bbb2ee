#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The files of spec/types tell .isr files by their first bytes: file(1) is asked, and the XML's pattern is read.

usage: types_test.py ROOT"""

import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

NAMESPACE = "{http://www.freedesktop.org/standards/shared-mime-info}"


def told(root, vector, *more):
    command = ["file", "--brief", "-m", root / "spec/types/isoreel.magic", *more, root / "spec/vectors" / vector]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def main(root):
    wrong = []
    for vector, more, expected in [("file_plain.isr", [], "Isoreel file of isosurfaces, version 1.0"),
                                   ("file_extended.isr", [], "Isoreel file of isosurfaces, version 1.9"),
                                   ("unfinished.isr", ["--mime-type"], "application/x-isoreel"),
                                   ("text_lf.isr", ["--mime-type"], "application/octet-stream")]:
        said = told(root, vector, *more)
        if said != expected:
            wrong.append(f"{vector}: file says '{said}', where '{expected}' is due")
    kind = ElementTree.parse(root / "spec/types/isoreel.xml").getroot().find(f"{NAMESPACE}mime-type")
    match = kind.find(f"{NAMESPACE}magic/{NAMESPACE}match")
    pattern = match.get("value").encode().decode("unicode_escape").encode("latin-1")
    if (kind.get("type"), match.get("offset"), pattern) != ("application/x-isoreel", "0", (root / "spec/vectors/file_plain.isr").read_bytes()[:8]):
        wrong.append(f"isoreel.xml: {kind.get('type')} for {pattern} at {match.get('offset')}")
    print("\n".join(wrong) or "both tell .isr files")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
