#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""house_rules.py must be able to fail: a small tree that keeps every rule, and each rule broken once."""

import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).parent))
import house_rules  # noqa: E402

LICENCE = "// SPDX-License-Identifier: BSD-3-Clause\n"

GOOD = {
    "base/include/isoreel/base/status.h": "#include <string>\n",
    "base/src/status.cc": "#include <isoreel/base/status.h>\n",
    "codec/include/isoreel/codec/decoder.h": "#include <isoreel/base/status.h>\n",
    "codec/include/isoreel/codec/encoder.h": "#include <isoreel/base/status.h>\n",
    "codec/lattice/octree.h": "#include <vector>\n",
    "codec/entropy/coder.h": "#include <isoreel/base/status.h>\n",
    "codec/extract/qef.cc": '#include <Eigen/Dense>\n#include "lattice/octree.h"\n',
    "codec/encode/encode.h": '#include "entropy/coder.h"\n',
    "codec/encode/encode.cc": '#include "encode/encode.h"\n#include <isoreel/codec/encoder.h>\n',
    "codec/decode/decode.h": '#include "entropy/coder.h"\n',
    "codec/decode/decode.cc": '#include "decode/decode.h"\n#include <xxhash.h>\n',
    "container/include/isoreel/container/reader.h": "#include <isoreel/base/status.h>\n",
    "container/src/reader.cc": "#include <zstd.h>\n#include <isoreel/container/reader.h>\n#include <unistd.h>\n",
    "io/include/isoreel/io/volume_reader.h": "#include <isoreel/codec/decoder.h>\n",
    "io/src/vdb.cc": "#include <openvdb/openvdb.h>\n#include <isoreel/io/volume_reader.h>\n",
    "inspect/include/isoreel/inspect/render.h": "#include <isoreel/codec/decoder.h>\n",
    "inspect/src/render.cc": "#include <embree3/rtcore.h>\n#include <isoreel/inspect/render.h>\n",
    "muxer/lavf/src/nut.cc": "#include <isoreel/container/reader.h>\n#include <isoreel/codec/decoder.h>\n",
    "cli/command.h": "#include <string>\n",
    "cli/main.cc": '#include <CLI/CLI.hpp>\n#include <isoreel/inspect/render.h>\n#include "command.h"\n',
    "examples/walk_triangles.cc": "int main() {\n  return 0;\n}\n",
}
README = "# Name\n\n<!-- quoted from examples/walk_triangles.cc -->\n```cpp\nint main() {\n  return 0;\n}\n```\n"

# (name, file, the line it gets, a word of the complaint)
BROKEN = [
    ("base to codec", "base/src/status.cc", "#include <isoreel/codec/decoder.h>", "base/ must not include codec/"),
    ("base to a library", "base/src/status.cc", "#include <zstd.h>", "must not use this library"),
    ("base to a library without folder", "base/src/status.cc", "#include <fmt/core.h>", "must not use this library"),
    ("codec to container", "codec/encode/encode.cc", "#include <isoreel/container/reader.h>", "codec/ must not"),
    ("codec to io", "codec/decode/decode.cc", "#include <isoreel/io/volume_reader.h>", "codec/ must not"),
    ("codec to inspect", "codec/decode/decode.cc", "#include <isoreel/inspect/render.h>", "codec/ must not"),
    ("codec to a library", "codec/encode/encode.cc", "#include <oneapi/tbb.h>", "must not use this library"),
    ("container to codec", "container/src/reader.cc", "#include <isoreel/codec/decoder.h>", "container/ must not"),
    ("container to Eigen", "container/src/reader.cc", "#include <Eigen/Dense>", "must not use this library"),
    ("io to container", "io/src/vdb.cc", "#include <isoreel/container/reader.h>", "io/ must not"),
    ("io to inspect", "io/src/vdb.cc", "#include <isoreel/inspect/render.h>", "io/ must not"),
    ("inspect to container", "inspect/src/render.cc", "#include <isoreel/container/reader.h>", "inspect/ must not"),
    ("inspect to io", "inspect/src/render.cc", "#include <isoreel/io/volume_reader.h>", "inspect/ must not"),
    ("muxer to io", "muxer/lavf/src/nut.cc", "#include <isoreel/io/volume_reader.h>", "muxer/lavf/ must not"),
    ("muxer to inspect", "muxer/lavf/src/nut.cc", "#include <isoreel/inspect/render.h>", "muxer/lavf/ must not"),
    ("encode to decode", "codec/encode/encode.cc", '#include "decode/decode.h"', "must not include codec/decode"),
    ("extract to decode", "codec/extract/qef.cc", '#include "decode/decode.h"', "must not include codec/decode"),
    ("decode to encode", "codec/decode/decode.cc", '#include "encode/encode.h"', "must not include codec/encode"),
    ("decode to encode by ..", "codec/decode/decode.cc", '#include "../encode/encode.h"', "codec/encode"),
    ("decode to the encoder", "codec/decode/decode.cc", "#include <isoreel/codec/encoder.h>", "the encoder"),
    ("shared room to encode", "codec/lattice/octree.h", '#include "encode/encode.h"', "codec/encode"),
    ("shared room to decode", "codec/entropy/coder.h", '#include "decode/decode.h"', "codec/decode"),
    ("shared room to Eigen", "codec/lattice/octree.h", "#include <Eigen/Core>", "must not use Eigen"),
    ("decode to Eigen", "codec/decode/decode.cc", "#include <Eigen/Core>", "must not use Eigen"),
    ("public header to Eigen", "codec/include/isoreel/codec/decoder.h", "#include <Eigen/Core>", "not use Eigen"),
    ("public header to a library", "io/include/isoreel/io/volume_reader.h", "#include <openvdb/openvdb.h>", "third"),
    ("public to private", "codec/include/isoreel/codec/decoder.h", '#include "decode/decode.h"', "private one"),
    ("quoted public header", "cli/main.cc", '#include "isoreel/inspect/render.h"', "with <>"),
    ("cli to a private header", "cli/main.cc", '#include "lattice/octree.h"', "is not a file of cli/"),
    ("cli to a private header by ..", "cli/main.cc", '#include "../codec/lattice/octree.h"', "not a file of cli/"),
    ("example to a library", "examples/walk_triangles.cc", "#include <fmt/core.h>", "must not use this library"),
    ("machine path", "cli/main.cc", "// see /wo" "rk/main", "somebody's machine"),
    ("machine path in words", "cli/main.cc", "// see ../sha" "red/data/droplets", "somebody's machine"),
    ("unfinished", "cli/main.cc", "// TO" "DO later", "finish it"),
    ("too long", "cli/main.cc", "\n" * 600, "above 600"),
]


class HouseRules(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = Path(self.folder.name)
        for name, text in GOOD.items():
            path = self.root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(LICENCE + text)
        (self.root / "README.md").write_text(README)

    def test_good_tree_is_clean(self):
        self.assertEqual(house_rules.breaches(self.root), [])

    def test_each_wrong_line_is_found_once_and_named(self):
        for name, file, line, word in BROKEN:
            with self.subTest(name):
                path = self.root / file
                before = path.read_text()
                path.write_text(before + line + "\n")
                found = house_rules.breaches(self.root)
                path.write_text(before)
                self.assertEqual(len(found), 1, found)
                self.assertTrue(found[0].startswith(file + ":"), found)
                self.assertIn(word, found[0])

    def test_missing_licence_line(self):
        (self.root / "cli/main.cc").write_text("int main() {}\n")
        self.assertEqual(len(house_rules.breaches(self.root)), 1)

    def test_readme_that_drifted(self):
        (self.root / "README.md").write_text(README.replace("return 0", "return 1"))
        self.assertIn("quotes code that is not in", house_rules.breaches(self.root)[0])

    def test_readme_without_the_example(self):
        (self.root / "README.md").write_text("# Name\n")
        self.assertIn("does not quote", house_rules.breaches(self.root)[0])


if __name__ == "__main__":
    unittest.main()
