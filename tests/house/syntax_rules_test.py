#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""syntax_rules.py finds what differs: each change of a text or of the code must be told.

usage: syntax_rules_test.py ROOT"""

import shutil
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True
from syntax_rules import breaches  # noqa: E402

CHANGES = [  # file, what, instead, part of what must be said
    ("spec/container.md", "| `duration` | varint | |\n", "", "'type' is due where the code has 'duration'"),
    ("spec/container.md", "| `euler` | svarint | |", "| `euler` | varint | |", "'euler' is varint, and v.signedVarint()"),
    ("spec/container.md", "| `error_kind` | u8 | 0 to 2 |", "| `error_kind` | u8 | 0 to 3 |", "'error_kind' is 0 to 3"),
    ("spec/container.md", "| `index_length` | u64 |", "| `index_size` | u64 |", "'index_size' is due"),
    ("spec/container.md", "### 7.2 Entries", "### 7.5 Entries", "there is no section container 7.2"),
    ("spec/codec.md", "| vector step | `varint` | 256 to 16384 |", "| vector step | `varint` | 256 to 16383 |", "'vector step' is"),
    ("spec/codec.md", "| nodes | 3 × `varint` |", "| nodes | 3 × `u32` |", "'nodes' is 3 × u32"),
    ("spec/mappings.md", "| `area`, `volume` |", "| `volume`, `area` |", "'volume' is due where the code has 'area'"),
    ("container/src/format.h", 'v.text("name", name, kMaxName);', "", "'name' is due"),
    ("container/src/format.h", "kMaxPacketBytes);", "kMaxPacketBytes + 1);", "'packet_length' is"),
    ("container/src/format.h", 'v.fixed("file_length", file_length);', 'v.fixed("file_length", file_length);\n    v.varint("more", a);',
     "'uuid' is due where the code has 'more'"),
    ("container/src/index.cc", "(spec container 7.3)", "(spec container 7" ".9)", "there is no section container 7" ".9"),
]


def main(root):
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        for name in ("base", "codec", "container", "muxer", "spec"):
            shutil.copytree(root / name, copy / name, ignore=shutil.ignore_patterns("vectors", "tables", "build"))
        for file, what, instead, said in [(None, None, None, None), *CHANGES]:
            if file:
                text = (copy / file).read_text()
                (copy / file).write_text(text.replace(what, instead, 1))
            found = breaches(copy)[0]
            if (file and what not in text) or (not any(said in line for line in found) if file else found):
                print(f"{file}: {what!r}: {said!r} is not said, but {found}")
                wrong += 1
            if file:
                (copy / file).write_text(text)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
