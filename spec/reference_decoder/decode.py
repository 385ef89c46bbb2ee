#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A second decoder: written from spec/codec.md alone, to test that text and to explain it.
Slow on purpose. Numbers such as (4.3) name sections of spec/codec.md.

usage: decode.py [--level LEVEL] PACKET...      prints counts and hash of the last packet's surface (at an octree level); packets
                                                before it are what a P packet needs: those from the I packet on"""

import json
import struct
import sys
from itertools import product
from pathlib import Path

sys.dont_write_bytecode = True
from entropy import MASK64, Refused, Stream, mixed, model, require, weights_of  # noqa: E402
from fields import Fields  # noqa: E402
from heights import MIXED_SIGNS, SHEETS, Heights  # noqa: E402
from prediction import Prediction, Reference  # noqa: E402
from sheets import sheets  # noqa: E402
from slices import SLICES, Slices, models_of  # noqa: E402
from surface import (CELL, CORNERS, LEAVES, MOTION, SIGNS, VERTICES, clamp, coarse_vertices, intra_vertices,  # noqa: E402
                     is_active, plus, quads)
from xxh3 import xxh3  # noqa: E402


# ---- 1 Conventions ---------------------------------------------------------------------------------------------------


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


# ---- 2 Configuration record ------------------------------------------------------------------------------------------


def read_configuration(record):
    """The grid's nodes (nx, ny, nz), whether the profile is main, the tools, and how lists are cut into slices: all that
    decoding needs of a record."""
    head = Fields(record)
    require(head.take(4) == b"ISRL", "the record does not start with ISRL")
    require(head.fixed(1) == 1, "the record's version is not 1")
    head.fixed(1)  # minor
    length = head.fixed(2)
    require(length == len(record) and length % 2 == 0 and length >= 12, "the record's length is wrong")
    require(crc32c(record[:-4]) == int.from_bytes(record[-4:], "little"), "the record's CRC does not match")
    f = Fields(record[8:-4])
    main_profile = f.fixed(1, 0, 1) == 1
    f.fixed(1, 0, 1)  # inside
    tools = f.varint(0, 31 if main_profile else 1)
    rule = (f.varint(2, 16), f.varint(256, 1 << 30)) if tools & SLICES else (1, 1)
    nodes = [f.varint(2, 65536) for _ in range(3)]
    f.varint(1, CELL)  # nominal step
    f.varint(1), f.varint(1)  # time base
    if f.fixed(1, 0, 1):
        [f.f64() for _ in range(3)]  # origin
    for _ in range((0, 1, 3)[f.fixed(1, 0, 2)]):
        require(f.f64() > 0, "spacing is not above 0")
    if f.fixed(1, 0, 1):
        [f.f64() for _ in range(9)]  # direction
    return nodes, main_profile, tools, rule


# ---- 3 Packet --------------------------------------------------------------------------------------------------------


class Packet:
    """Header fields and sections of a packet, checked."""

    def __init__(self, data, prefix=False):
        front = Fields(data)
        crc = front.fixed(4)
        f = Fields(front.take(front.varint(0, MASK64)))
        require(crc32c(data[4:front.at]) == crc, "the header's CRC does not match")
        self.predicted = f.fixed(1, 0, 1)
        self.number = f.varint(0, MASK64)
        f.varint(0, MASK64), f.varint(0, MASK64)  # time, duration
        self.references = [f.varint(1, self.number) for _ in range(f.varint(self.predicted, self.predicted))]
        f.f64()  # isovalue
        self.step, self.tangential_step = f.varint(1, CELL), f.varint(1, CELL)
        self.vertices, self.faces = f.varint(), f.varint()
        self.hash = f.fixed(8)
        self.record = f.take(f.varint(0, 4096))
        table = [(f.varint(), f.varint(0, 255), f.varint(0, (1 << 28) - 1)) for _ in range(f.varint(0, 256))]
        payload_crc = f.fixed(4)
        require(bool(self.record) != bool(self.predicted), "I packets carry the configuration record, P packets do not")

        payload, whole = data[front.at:], sum(size for _, _, size in table)
        require(len(payload) <= whole, "bytes behind the last section")
        require(len(payload) == whole or prefix, "the packet is cut short")
        require(len(payload) < whole or crc32c(payload) == payload_crc, "the payload's CRC does not match")
        require(self.vertices // 512 <= front.at + whole, "so many vertices cannot be in so few bytes")  # 6.1
        self.sections, at = {}, 0
        self.before_motion = 0  # the highest level with a section in front of the motion's
        for kind, level, size in table:
            content = payload[at:at + size] if at + size <= len(payload) else None  # None: cut off
            if kind in (SIGNS, LEAVES) and (MOTION, 0) not in self.sections:
                self.before_motion = max(self.before_motion, level)
            self.sections.setdefault((kind, level), content)
            at += size

    def section(self, kind, level):
        return self.sections.get((kind, level), b"")


# ---- 4 Signs ---------------------------------------------------------------------------------------------------------

NEW_NODES = [tuple(map(int, d)) for d in
             "111 110 101 011 112 121 211 100 010 001 120 210 102 012 201 021 122 212 221".split()]
# For each new node, where the cells lie that it belongs to as well: across a face, an edge or a corner of its own.
SHARING = {d: [offset for offset in product(*[(0, k - 1) if k != 1 else (0,) for k in d]) if any(offset)] for d in NEW_NODES}
AROUND = [[d for d in product((-1, 0, 1), repeat=3) if sum(map(abs, d)) == apart] for apart in (1, 2, 3)]


class Tree:
    """The octree of signs, level by level. `cells` maps the cells of the level decoded last to their configurations;
    it keeps their order."""

    def __init__(self, packet, nodes, models, mixed_signs, rule):
        self.packet, self.nodes, self.models, self.mixed_signs, self.rule = packet, nodes, models, mixed_signs, rule
        self.depth = (max(self.nodes) - 2).bit_length()
        self.cells = {}

    def lattice(self, level):
        """Highest lattice coordinates in the grid, and numbers of cells (4.1)."""
        s = self.depth - level
        return tuple(n - 1 >> s for n in self.nodes), tuple(n - 1 + (1 << s) - 1 >> s for n in self.nodes)

    def decode_level(self, level, signs, leaves, prediction=None):
        slices = Slices(self.cells, self.rule)
        sign_streams = slices.streams(signs)
        leaf_streams = slices.streams(leaves) if level < self.depth else [Stream(leaves)]
        if level == 0:
            self.decode_root(sign_streams[0], leaf_streams[0])
        else:
            known = self.decode_signs(level, slices.numbers, sign_streams, prediction)
            self.cells = self.divided_children(level, known, slices.numbers, leaf_streams)
        for stream in sign_streams + leaf_streams:
            stream.used_up()

    def decode_root(self, signs, leaves):
        last, _ = self.lattice(0)
        known = {}
        for corner in CORNERS:
            point = tuple(map(min, corner, last))
            if point == corner:
                known[point] = signs.raw(1)
        root = self.configuration((0, 0, 0), known, last)
        if is_active(root) or (self.depth > 0 and leaves.raw(1)):
            self.cells = {(0, 0, 0): root}

    @staticmethod
    def configuration(cell, known, last):
        """A corner outside the grid has the sign of the last point inside (4.1)."""
        return sum(known[tuple(map(min, plus(cell, corner), last))] << j for j, corner in enumerate(CORNERS))

    def decode_signs(self, level, slices, streams, prediction):
        """4.3: the signs of all lattice points of the level that belong to cells of the level above."""
        last, _ = self.lattice(level)
        _, parents = self.lattice(level - 1)
        known = {}
        for cell, configuration in self.cells.items():
            for j, corner in enumerate(CORNERS):
                point = tuple(2 * c for c in plus(cell, corner))
                if all(map(int.__le__, point, last)):
                    known[point] = configuration >> j & 1
        corners, here, slice = dict(known), known, 0  # here: what the slice knows
        for cell, number in zip(self.cells, slices):
            if number != slice:
                here, slice = dict(corners), number
            low = tuple(2 * c for c in cell)
            for d in NEW_NODES:
                point = plus(low, d)
                if point in known or not all(map(int.__le__, point, last)):
                    continue
                if self.beside_leaf(cell, d, parents):
                    sign = known[plus(low, tuple(k & 2 for k in d))]
                else:
                    sign = self.sign(level, cell, d, point, here, prediction, streams[slice], models_of(self.models, slice))
                known[point] = here[point] = sign
        return known

    def sign(self, level, cell, d, point, known, prediction, stream, models):
        """4.3, 8.5 and 11.7"""
        usual = self.sign_model(known, point, models)
        kind = prediction and prediction.sign_kind(level, cell, point)
        if kind and self.mixed_signs:
            asked = usual, prediction.sign_model(kind, usual, models), model(models, ("moved corners", *kind, self.cells[cell]))
            return mixed(stream, asked, weights_of(models, ("moved", *kind, "weights"), 3), 64)
        if not self.mixed_signs:
            moved = kind and prediction.sign_model(kind, usual, models)
            sign = stream.decision(moved or usual)
            if moved:
                usual.update(sign)
            return sign
        name = (d, level == self.depth)
        second = model(models, ("opinion", self.cells[cell], *name))
        return mixed(stream, (usual, second), weights_of(models, ("opinion", *name)), 64)

    def beside_leaf(self, cell, d, parents):
        """Whether the point at d of the cell also lies on a cell of the same level that is not divided."""
        for offset in SHARING[d]:
            neighbour = plus(cell, offset)
            if neighbour not in self.cells and all(0 <= n < count for n, count in zip(neighbour, parents)):
                return True
        return False

    def sign_model(self, known, point, models):
        """4.4"""
        faces, edges, corners = ([known.get(plus(point, d)) for d in ring] for ring in AROUND)

        def balance(states):
            return states.count(1) - states.count(0)

        e, c = clamp(balance(edges), -4, 4), clamp(balance(corners), -3, 3)
        vote = 4 * balance(faces) + 2 * e + c
        return model(models, ("sign", *faces, e, c), clamp(32768 + 1638 * vote, 3277, 62259))

    def divided_children(self, level, known, slices, streams):
        """4.5"""
        last, count = self.lattice(level)
        children = {}
        for cell, number in zip(self.cells, slices):
            for corner in CORNERS:
                child = plus(tuple(2 * c for c in cell), corner)
                if not all(map(int.__lt__, child, count)):
                    continue
                configuration = self.configuration(child, known, last)
                if not is_active(configuration):
                    if level == self.depth:
                        continue
                    leaf = self.leaf_model(level, known, child, configuration & 1, models_of(self.models, number))
                    if not streams[number].decision(leaf):
                        continue
                children[child] = configuration
                require(len(children) <= self.packet.vertices, "a level has more cells than the surface has vertices")
        return children

    def leaf_model(self, level, known, child, sign, models):
        states = [known.get(plus(child, d)) for d in product((-1, 0, 1, 2), repeat=3)]
        other, unknown = states.count(1 - sign), states.count(None)
        name = (min(self.depth - level, 4), sign, sum(other > n for n in (0, 1, 2, 4, 8)), sum(unknown > n for n in (0, 8, 24)))
        return model(models, ("leaf", *name))


# ---- 5 and 7 Surface --------------------------------------------------------------------------------------------------


def surface_hash(vertices, faces):
    """7"""
    return xxh3(b"".join(struct.pack("<3i", *v) for v in vertices) + b"".join(struct.pack("<4I", *q) for q in faces))


class Decoder:
    """Decodes packets in order. What a P packet goes on from (8) is kept when a packet was decoded in full."""

    def __init__(self):
        self.last = None  # number of the packet decoded last, if a P packet can go on from it

    def begin(self, packet):
        """6.4 and 8: what holds before the packet's own streams."""
        if packet.predicted:
            require(self.last == packet.number - packet.references[0], "the packet before it is not the one it refers to")
        else:
            self.nodes, self.main, self.tools, self.rule = read_configuration(packet.record)
            self.models, self.reference = {}, None
        self.last = None

    def decode(self, data, level=None, prefix=False):
        """Vertices and quads of a packet; `level` stops early (5.4), `prefix` takes a packet that was cut short (3.2)."""
        packet = Packet(data, prefix)
        self.begin(packet)
        tree = Tree(packet, self.nodes, self.models, self.main and self.tools & MIXED_SIGNS, self.rule)
        prediction = None
        cut = packet.section(MOTION, 0) is None or packet.section(VERTICES, 0) is None
        if packet.predicted and packet.section(MOTION, 0) is not None:
            prediction = Prediction(packet, tree.depth, self.reference, self.models, self.main)
        wanted = tree.depth if level is None else min(level, tree.depth)
        reached = 0
        for at in range(wanted + 1):
            signs, leaves = packet.section(SIGNS, at), packet.section(LEAVES, at)
            if signs is None or leaves is None:
                require(at > 0, "the packet is cut before its first level is whole")
                break
            if packet.predicted and prediction is None and at > packet.before_motion:
                break
            moved = prediction if prediction and at > prediction.block_level else None
            tree.decode_level(at, signs, leaves, moved)
            reached = at
            if prediction and at == prediction.block_level:
                prediction.decode_motion(tree.cells)
            if not tree.cells:
                break
        cells = {cell: c for cell, c in tree.cells.items() if is_active(c)}
        if wanted < tree.depth or (reached < wanted and tree.cells) or cut:
            with_vertices = self.with_vertices(cells)
            return coarse_vertices(self.nodes, with_vertices, tree.depth - reached), quads(with_vertices)
        if prediction and reached < prediction.block_level:
            prediction.decode_motion({})  # no cells and no blocks
        return self.full(packet, cells, prediction)

    def with_vertices(self, cells):
        """5 and 5.5: of each vertex, its cell and configuration."""
        return sheets(cells) if self.main and self.tools & SHEETS else list(cells.items())

    def full(self, packet, active, prediction):
        cells = self.with_vertices(active)
        require(len(cells) == packet.vertices, "the number of vertices is not the header's")
        if self.main:
            vertices = Heights(packet, active, cells, self.nodes, self.tools, self.rule, self.models, prediction).vertices()
        elif packet.predicted:
            vertices = prediction.vertices(cells)
        else:
            vertices = intra_vertices(packet, cells, self.models)
        faces = quads(cells)
        require(len(faces) == packet.faces, "the number of quads is not the header's")
        require(surface_hash(vertices, faces) == packet.hash, "the surface does not match its hash")
        if self.tools & 1:
            self.reference, self.last = Reference(vertices, faces, cells), packet.number
        return vertices, faces


def summary(surface):
    vertices, faces = surface
    return {"vertices": len(vertices), "faces": len(faces), "hash": f"{surface_hash(vertices, faces):016x}"}


def main(arguments):
    level = None
    if len(arguments) > 1 and arguments[0] == "--level":
        level, arguments = int(arguments[1]), arguments[2:]
    if not arguments:
        print(__doc__, file=sys.stderr)
        return 2
    decoder = Decoder()
    try:
        for name in arguments[:-1]:
            decoder.decode(Path(name).read_bytes())
        name = arguments[-1]
        print(json.dumps(summary(decoder.decode(Path(name).read_bytes(), level))))
    except Refused as rule:
        print(f"{name}: {rule}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
