#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A second decoder of I packets, profile classic: written from spec/codec.md alone, to test that text and to explain it.
Slow on purpose. Numbers such as (4.3) name sections of spec/codec.md.

usage: decode.py PACKET [LEVEL]      prints counts and hash of the surface (at an octree level)"""

import json
import struct
import sys
from itertools import product
from math import isfinite, isqrt
from pathlib import Path

sys.dont_write_bytecode = True
from entropy import MASK64, Refused, Stream, model, require, residual  # noqa: E402
from xxh3 import xxh3  # noqa: E402

CELL = 16384
SIGNS, LEAVES, VERTICES = 1, 2, 4  # section kinds


# ---- 1 Conventions ---------------------------------------------------------------------------------------------------


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


class Fields:
    """Reads field types (1.2) from the front of some bytes."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        require(count <= len(self.data) - self.at, "ends inside a field")
        self.at += count
        return self.data[self.at - count:self.at]

    def fixed(self, size, low=0, high=MASK64):
        return self.ranged(int.from_bytes(self.take(size), "little"), low, high)

    def varint(self, low=0, high=0xFFFFFFFF):
        value = 0
        for count in range(10):
            byte = self.take(1)[0]
            value |= (byte & 127) << 7 * count
            if byte < 128:
                require(value <= MASK64 and (byte or not count), "a varint is not canonical")
                return self.ranged(value, low, high)
        raise Refused("a varint is too long")

    def f64(self):
        value = struct.unpack("<d", self.take(8))[0]
        require(isfinite(value), "a number is not finite")
        return value

    def ranged(self, value, low, high):
        require(low <= value <= high, f"{value} is not from {low} to {high}")
        return value


# ---- 2 Configuration record ------------------------------------------------------------------------------------------


def read_configuration(record):
    """The grid's nodes (nx, ny, nz): all that decoding needs of a record."""
    head = Fields(record)
    require(head.take(4) == b"ISRL", "the record does not start with ISRL")
    require(head.fixed(1) == 1, "the record's version is not 1")
    head.fixed(1)  # minor
    length = head.fixed(2)
    require(length == len(record) and length % 2 == 0 and length >= 12, "the record's length is wrong")
    require(crc32c(record[:-4]) == int.from_bytes(record[-4:], "little"), "the record's CRC does not match")
    f = Fields(record[8:-4])
    f.fixed(1, 0, 0)  # profile
    f.fixed(1, 0, 1)  # inside
    f.varint(0, 1)  # tools
    nodes = [f.varint(2, 65536) for _ in range(3)]
    f.varint(1, CELL)  # nominal step
    f.varint(1), f.varint(1)  # time base
    if f.fixed(1, 0, 1):
        [f.f64() for _ in range(3)]  # origin
    for _ in range((0, 1, 3)[f.fixed(1, 0, 2)]):
        require(f.f64() > 0, "spacing is not above 0")
    if f.fixed(1, 0, 1):
        [f.f64() for _ in range(9)]  # direction
    return nodes


# ---- 3 Packet --------------------------------------------------------------------------------------------------------


class Packet:
    """Header fields and sections of a packet, checked."""

    def __init__(self, data, prefix=False):
        front = Fields(data)
        crc = front.fixed(4)
        f = Fields(front.take(front.varint(0, MASK64)))
        require(crc32c(data[4:front.at]) == crc, "the header's CRC does not match")
        kind = f.fixed(1, 0, 1)
        f.varint(0, MASK64), f.varint(0, MASK64), f.varint(0, MASK64)  # number, time, duration
        for _ in range(f.varint(kind, kind)):
            f.varint(1, MASK64)  # references
        f.f64()  # isovalue
        self.step, self.tangential_step = f.varint(1, CELL), f.varint(1, CELL)
        self.vertices, self.faces = f.varint(), f.varint()
        self.hash = f.fixed(8)
        record = f.take(f.varint(0, 4096))
        table = [(f.varint(), f.varint(0, 255), f.varint(0, (1 << 28) - 1)) for _ in range(f.varint(0, 256))]
        payload_crc = f.fixed(4)
        require(kind == 0, "P packets are reserved")
        require(record, "an I packet carries its configuration record")
        self.nodes = read_configuration(record)

        payload, whole = data[front.at:], sum(size for _, _, size in table)
        require(len(payload) <= whole, "bytes behind the last section")
        require(len(payload) == whole or prefix, "the packet is cut short")
        require(len(payload) < whole or crc32c(payload) == payload_crc, "the payload's CRC does not match")
        require(self.vertices // 512 <= front.at + whole, "so many vertices cannot be in so few bytes")  # 6.1
        self.sections, at = {}, 0
        for kind, level, size in table:
            content = payload[at:at + size] if at + size <= len(payload) else None  # None: cut off
            self.sections.setdefault((kind, level), content)
            at += size

    def section(self, kind, level):
        return self.sections.get((kind, level), b"")


# ---- 4 Signs ---------------------------------------------------------------------------------------------------------

CORNERS = [(j & 1, j >> 1 & 1, j >> 2) for j in range(8)]
NEW_NODES = [tuple(map(int, d)) for d in
             "111 110 101 011 112 121 211 100 010 001 120 210 102 012 201 021 122 212 221".split()]
AROUND = [[d for d in product((-1, 0, 1), repeat=3) if sum(map(abs, d)) == apart] for apart in (1, 2, 3)]


def plus(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def clamp(value, low, high):
    return max(low, min(value, high))


def is_active(configuration):
    return configuration not in (0, 255)


class Tree:
    """The octree of signs, level by level. `cells` maps the cells of the level decoded last to their configurations;
    it keeps their order."""

    def __init__(self, packet):
        self.packet, self.nodes = packet, packet.nodes
        self.depth = (max(self.nodes) - 2).bit_length()
        self.sign_models, self.leaf_models = {}, {}
        self.cells = {}

    def lattice(self, level):
        """Highest lattice coordinates in the grid, and numbers of cells (4.1)."""
        s = self.depth - level
        return tuple(n - 1 >> s for n in self.nodes), tuple(n - 1 + (1 << s) - 1 >> s for n in self.nodes)

    def decode_level(self, level, signs, leaves):
        if level == 0:
            self.decode_root(signs, leaves)
        else:
            known = self.decode_signs(level, signs)
            self.cells = self.divided_children(level, known, leaves)
        signs.used_up()
        leaves.used_up()

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

    def decode_signs(self, level, stream):
        """4.3: the signs of all lattice points of the level that belong to cells of the level above."""
        last, _ = self.lattice(level)
        _, parents = self.lattice(level - 1)
        known = {}
        for cell, configuration in self.cells.items():
            for j, corner in enumerate(CORNERS):
                point = tuple(2 * c for c in plus(cell, corner))
                if all(map(int.__le__, point, last)):
                    known[point] = configuration >> j & 1
        for cell in self.cells:
            low = tuple(2 * c for c in cell)
            for d in NEW_NODES:
                point = plus(low, d)
                if point in known or not all(map(int.__le__, point, last)):
                    continue
                if self.beside_leaf(cell, d, parents):
                    known[point] = known[plus(low, tuple(k & 2 for k in d))]
                else:
                    known[point] = stream.decision(self.sign_model(known, point))
        return known

    def beside_leaf(self, cell, d, parents):
        """Whether the point at d of the cell also lies on a cell of the same level that is not divided."""
        for subset in product((0, 1), repeat=3):
            if not any(subset) or any(take and k == 1 for take, k in zip(subset, d)):
                continue
            neighbour = plus(cell, tuple(take * (k - 1) for take, k in zip(subset, d)))
            in_grid = all(0 <= n < count for n, count in zip(neighbour, parents))
            if in_grid and neighbour not in self.cells:
                return True
        return False

    def sign_model(self, known, point):
        """4.4"""
        faces, edges, corners = ([known.get(plus(point, d)) for d in ring] for ring in AROUND)

        def balance(states):
            return states.count(1) - states.count(0)

        e, c = clamp(balance(edges), -4, 4), clamp(balance(corners), -3, 3)
        vote = 4 * balance(faces) + 2 * e + c
        return model(self.sign_models, (*faces, e, c), clamp(32768 + 1638 * vote, 3277, 62259))

    def divided_children(self, level, known, stream):
        """4.5"""
        last, count = self.lattice(level)
        children = {}
        for cell in self.cells:
            for corner in CORNERS:
                child = plus(tuple(2 * c for c in cell), corner)
                if not all(map(int.__lt__, child, count)):
                    continue
                configuration = self.configuration(child, known, last)
                if not is_active(configuration):
                    if level == self.depth or not stream.decision(self.leaf_model(level, known, child, configuration & 1)):
                        continue
                children[child] = configuration
                require(len(children) <= self.packet.vertices, "a level has more cells than the surface has vertices")
        return children

    def leaf_model(self, level, known, child, sign):
        states = [known.get(plus(child, d)) for d in product((-1, 0, 1, 2), repeat=3)]
        other, unknown = states.count(1 - sign), states.count(None)
        name = (min(self.depth - level, 4), sign, sum(other > n for n in (0, 1, 2, 4, 8)), sum(unknown > n for n in (0, 8, 24)))
        return model(self.leaf_models, name)


# ---- 5 Surface -------------------------------------------------------------------------------------------------------


def local_frame(configuration):
    """Vertex, normal and the two tangents of a configuration (5.1)."""
    inside = [configuration >> j & 1 for j in range(8)]
    ends = [(i, j) for i in range(8) for j in (i | 1, i | 2, i | 4) if i != j and inside[i] != inside[j]]
    vertex = [CELL // 2] * 3
    if ends:
        vertex = [(CELL * sum(CORNERS[i][k] + CORNERS[j][k] for i, j in ends) + len(ends)) // (2 * len(ends)) for k in range(3)]
    g = [sum((1 - 2 * inside[j]) * (2 * CORNERS[j][k] - 1) for j in range(8)) for k in range(3)]
    if not any(g):
        g = [0, 0, 1]
    a = min(range(3), key=lambda k: abs(g[k]))
    t = [-g[k] * g[a] for k in range(3)]
    t[a] += sum(x * x for x in g)
    u = [g[1] * t[2] - g[2] * t[1], g[2] * t[0] - g[0] * t[2], g[0] * t[1] - g[1] * t[0]]

    def unit(v):
        roots = [isqrt((x * x << 30) // sum(y * y for y in v)) for x in v]
        return [(root + 1 >> 1) * (-1 if x < 0 else 1) for x, root in zip(v, roots)]

    return vertex, unit(g), unit(t), unit(u)


FRAMES = [local_frame(c) for c in range(256)]


def full_vertices(packet, cells, content):
    """5.2"""
    require(len(cells) == packet.vertices, "the number of vertices is not the header's")
    stream, models, result = Stream(content), {}, []
    for cell, configuration in cells.items():
        r = [residual(stream, models, (component, configuration)) for component in range(3)]
        vertex, normal, t1, t2 = FRAMES[configuration]
        position = []
        for k in range(3):
            offset = r[0] * packet.step * normal[k] + (r[1] * t1[k] + r[2] * t2[k]) * packet.tangential_step + 8192 >> 14
            position.append(CELL * cell[k] + clamp(vertex[k] + offset, 0, CELL))
        result.append(position)
    stream.used_up()
    return result


def coarse_vertices(packet, cells, shift):
    """5.4"""
    return [[min(CELL * cell[k] + FRAMES[configuration][0][k] << shift, CELL * (packet.nodes[k] - 1)) for k in range(3)]
            for cell, configuration in cells.items()]


def quads(cells):
    """5.3"""
    number = {cell: i for i, cell in enumerate(cells)}
    result = []
    for cell, configuration in cells.items():
        for a in range(3):
            u, v = (a + 1) % 3, (a + 2) % 3
            low, high = configuration & 1, configuration >> (1 << a) & 1
            if low == high or cell[u] == 0 or cell[v] == 0:
                continue
            back_u, back_v = ([-(k == axis) for k in range(3)] for axis in (u, v))
            ring = [cell, plus(cell, back_u), plus(plus(cell, back_u), back_v), plus(cell, back_v)]
            if not low:
                ring = [ring[0], ring[3], ring[2], ring[1]]
            result.append([number[c] for c in ring])
    return result


def surface_hash(vertices, faces):
    """7"""
    return xxh3(b"".join(struct.pack("<3i", *v) for v in vertices) + b"".join(struct.pack("<4I", *q) for q in faces))


def decode(data, level=None, prefix=False):
    """Vertices and quads of a packet; `level` stops early (5.4), `prefix` takes a packet that was cut short (3.2)."""
    packet = Packet(data, prefix)
    tree = Tree(packet)
    wanted = tree.depth if level is None else min(level, tree.depth)
    reached = 0
    for at in range(wanted + 1):
        signs, leaves = packet.section(SIGNS, at), packet.section(LEAVES, at)
        if signs is None or leaves is None:
            require(at > 0, "the packet is cut before its first level is whole")
            break
        tree.decode_level(at, Stream(signs), Stream(leaves))
        reached = at
        if not tree.cells:
            break
    cells = {cell: c for cell, c in tree.cells.items() if is_active(c)}
    content = packet.section(VERTICES, 0)
    full = wanted == tree.depth and (reached == wanted or not tree.cells) and content is not None
    vertices = full_vertices(packet, cells, content) if full else coarse_vertices(packet, cells, tree.depth - reached)
    faces = quads(cells)
    if full:
        require(len(faces) == packet.faces, "the number of quads is not the header's")
        require(surface_hash(vertices, faces) == packet.hash, "the surface does not match its hash")
    return vertices, faces


def summary(surface):
    vertices, faces = surface
    return {"vertices": len(vertices), "faces": len(faces), "hash": f"{surface_hash(vertices, faces):016x}"}


def main(arguments):
    if not 1 <= len(arguments) <= 2:
        print(__doc__, file=sys.stderr)
        return 2
    level = int(arguments[1]) if len(arguments) == 2 else None
    try:
        print(json.dumps(summary(decode(Path(arguments[0]).read_bytes(), level))))
    except Refused as rule:
        print(f"{arguments[0]}: {rule}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
