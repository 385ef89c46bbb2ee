#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The bytes that spec/container.md 13 tells of a vector, and of its index once decompressed, are what stands there.

usage: worked_test.py ROOT"""

import re
import sys
from pathlib import Path

sys.dont_write_bytecode = True


def main(root):
    sys.path.insert(0, str(root / "spec/reference_decoder"))
    from isr import Source, chunk_at, read_footer
    from zstd import decompress
    text = (root / "spec/container.md").read_text()
    section = text[text.index("\n## 13 "):]
    file = (root / "spec" / re.search(r"`(vectors/\w+\.isr)`", section)[1]).read_bytes()
    offset, _, _ = read_footer(file[-64:], Source(file).size)
    told = {"file": file, "content": decompress(chunk_at(file, offset)[1], 1 << 20)}
    wrong, lines = [], 0
    for kind, block in re.findall(r"```(file|content)\n(.*?)```", section, re.DOTALL):
        for line in block.splitlines():
            place, there = line.split(";")[0].split(":")
            at, there = int(place, 16), bytes.fromhex(there)
            lines += 1
            if told[kind][at:at + len(there)] != there:
                wrong.append(f"{kind} {line}: there stands {told[kind][at:at + len(there)].hex(' ')}")
    print("\n".join(wrong) or f"{lines} lines are right")
    return 1 if wrong or lines < 20 else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
