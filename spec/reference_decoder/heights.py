#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Vertices of profile main: spec/codec.md section 11. Part of decode.py."""

from itertools import product
from math import isqrt

from entropy import magnitude, mixed, model, require, residual, weights_of
from sheets import FACES, shared
from slices import Slices, models_of
from surface import CELL, FRAMES, VERTICES, clamp, in_grid, plus

NEIGHBOURS, MIXED_SIGNS, SHEETS = 2, 4, 8  # tools
AROUND = [d for d in product((-1, 0, 1), repeat=3) if any(d)]


# 11.5: at the start of an I packet, by odd and by kind: None without, False and True with the moved surface
WEIGHTS = {(0, None): [16, 0, 16, 0, 0, 0, 0, 0], (0, False): [0] * 8 + [64, 32, 0], (0, True): [0] * 8 + [32, 16, 0],
           (1, None): [48, 0, 0, 0, 0, 0, 0, 0], (1, False): [0] * 8 + [64, 48, 0], (1, True): [0] * 8 + [32, 24, 0]}


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def limited(value):
    return clamp(value, -32767, 32767)


def mean(total, count):
    """11.4"""
    return total * ((2 * 65536 + count) // (2 * count)) >> 16


class Heights:
    """`cells`: the active ones; `vertices`: for each vertex its cell, and its configuration."""

    def __init__(self, packet, cells, vertices, nodes, tools, rule, models, prediction):
        self.packet, self.cells, self.list, self.nodes, self.tools, self.models = packet, cells, vertices, nodes, tools, models
        self.prediction = prediction  # of a P packet, or None
        self.slices = Slices([cell for cell, _ in vertices], rule)
        self.signs = {}
        self.numbers = {}
        for i, (cell, _) in enumerate(vertices):
            self.numbers.setdefault(cell, []).append(i)

    # ---- 11.1 Surroundings ----

    def facing(self, i, cell):
        """The vertex of another cell that faces vertex i."""
        own, corners = self.list[i]
        pairs = shared(own, cell)
        return min(self.numbers[cell], key=lambda n: sum(corners >> j & 1 != self.list[n][1] >> k & 1 for j, k in pairs))

    def across(self, i):
        """The vertices across the six faces: None where the face has one sign only, or no cell behind it."""
        cell, corners = self.list[i]
        inside = [corners >> j & 1 for j in range(8)]
        result = []
        for face, way in enumerate(FACES):
            on_face = [inside[j] for j in range(8) if (j >> face // 2 & 1) == face % 2]
            other = plus(cell, way)
            result.append(self.facing(i, other) if 0 < sum(on_face) < 4 and other in self.cells else None)
        return result

    def sign_around(self, i, d):
        """Of the node at d from the cell of vertex i, as the vertex sees it."""
        cell, corners = self.list[i]
        nearest = [clamp(x, 0, 1) for x in d]
        j = nearest[0] | nearest[1] << 1 | nearest[2] << 2
        if corners >> j & 1 != self.cells[cell] >> j & 1:
            return corners >> j & 1
        return self.sign(cell, plus(cell, d))

    def sign(self, cell, node):
        """Of a node near an active cell: the cell's own corner, that of an active cell on the way, or as one step back."""
        node = tuple(clamp(node[k], 0, self.nodes[k] - 1) for k in range(3))
        if node not in self.signs:
            self.signs[node] = self.sign_in_grid(cell, node)
        return self.signs[node]

    def sign_in_grid(self, cell, node):
        for other in product(*((n - 1, n) for n in node)):
            if other in self.cells:
                corner = [node[k] - other[k] for k in range(3)]
                return self.cells[other] >> (corner[0] | corner[1] << 1 | corner[2] << 2) & 1
        # No active cell has this node: all cells around it have one sign, that of any node they share with the cell.
        return self.sign(cell, tuple(clamp(node[k], cell[k], cell[k] + 1) for k in range(3)))

    # ---- 11.2 Points, 11.3 normals and inputs ----

    def predict(self):
        neighbours = [self.across(i) for i in range(len(self.list))]
        self.start = [[FRAMES[c][0][k] + 4 >> 3 for k in range(3)] for _, c in self.list]
        self.points = [list(p) for p in self.start]
        for _ in range(3):
            following = []
            for i, (cell, _) in enumerate(self.list):
                point = [clamp(m, 41, 2007) for m in self.mean_around(i, neighbours[i])]
                for k in range(3):
                    if cell[k] in (0, self.nodes[k] - 2):
                        point[k] = self.start[i][k]
                following.append(point)
            self.points = following
        self.normals, self.balances = zip(*(self.normal(i) for i in range(len(self.list)))) if self.list else ((), ())
        self.inputs = [self.inputs_of(i, neighbours[i]) for i in range(len(self.list))]

    def way(self, i, face, j):
        """From the point of vertex i to that of the vertex across a face."""
        if j is None:
            return [0, 0, 0]
        return [self.points[j][k] + 2048 * FACES[face][k] - self.points[i][k] for k in range(3)]

    def mean_around(self, i, across):
        total = [6 * self.points[i][k] + sum(self.way(i, f, o)[k] for f, o in enumerate(across)) for k in range(3)]
        return [((6144 + t) * 10923 >> 16) - 1024 for t in total]

    def normal(self, i):
        total, balance = [0, 0, 0], 0
        for d in product(range(-1, 3), repeat=3):
            twice = [2 * x - 1 for x in d]
            weight = (44, 16, 6, 2)[sum(abs(t) > 1 for t in twice)]
            weight = -weight if self.sign_around(i, d) else weight
            total = [t + weight * w for t, w in zip(total, twice)]
            balance += weight
        square = dot(total, total)
        if square == 0:
            return FRAMES[self.list[i][1]][1], balance
        inverse = (1 << 40) // isqrt(square << 20)
        return [t * inverse >> 16 for t in total], balance

    def inputs_of(self, i, across):
        point, normal = self.points[i], self.normals[i]
        ways = [self.way(i, f, o) for f, o in enumerate(across)]
        others = [i if j is None else j for j in across]
        total = [sum(w[k] for w in ways) for k in range(3)]
        planes = sum(dot(w, self.normals[j]) >> 14 for w, j in zip(ways, others))
        cosines = sum(dot(normal, self.normals[j]) >> 18 for j in others)
        moved = [p - s for p, s in zip(point, self.start[i])]
        return ([8 * (dot(moved, normal) >> 14), limited(2 * (dot(total, normal) >> 14)), 8 * self.balances[i],
                 sum(self.balances[j] for j in others), 8 * (dot([1024 - p for p in point], normal) >> 14), limited(2 * planes)],
                clamp((6 * 1024 - cosines) * 6 >> 10, 0, 15))

    # ---- 11.4 What coded neighbours say ----

    def coded(self, i, odd):
        """Mean heights, nearer and further, the activity, and mean errors of the moved surface, nearer and further."""
        if not self.tools & NEIGHBOURS:
            return 0, 0, 32, [0, 0]
        near, far = [], []
        for d in AROUND:
            other = plus(self.list[i][0], d)
            if other not in self.cells:
                continue
            j = self.facing(i, other)
            if self.slices.numbers[j] != self.slices.numbers[i]:
                continue
            differ = sum(map(abs, d))
            if odd:
                if differ != 2:
                    (near if differ == 1 else far).append(j)
            elif differ == 2 and j < i:
                near.append(j)
        if not near and not far:
            return 0, 0, 32, [0, 0]
        means = [mean(sum(self.heights[j] for j in group), len(group)) if group else None for group in (near, far)]
        near_mean = means[1] if means[0] is None else means[0]
        far_mean = (0 if not odd else near_mean) if means[1] is None else means[1]
        near_weight = 3 if odd else 1
        total = near_weight * sum(self.magnitudes[j] for j in near) + sum(self.magnitudes[j] for j in far)
        activity = min(31, isqrt(4 * mean(64 * total, near_weight * len(near) + len(far))))
        errors = [[self.heights[j] - self.moved[j][0] for j in group if self.moved[j]] for group in (near, far)]
        return near_mean, far_mean, activity, [mean(sum(e), len(e)) if e else 0 for e in errors]

    # ---- 11.5 Heights, 11.6 residuals ----

    def residual(self, stream, models, odd, activity, bend, corners, moved):
        """`moved`: confidence and apart (11.9), or None."""
        has = moved is not None

        def decision(name, first, second):
            asked = [model(models, (name, *first, has)), model(models, (name, *second, has))]
            if has:
                asked.append(model(models, (name, "moved", *moved, activity // 4)))
            weights = weights_of(models, (name, "weights", activity // 4, odd, has), len(asked))
            return mixed(stream, asked, weights, 720)

        if decision("zero", ("activity", activity, bend, odd), ("corners", corners, odd)):
            return 0
        negative = stream.decision(model(models, ("height negative", corners, odd)))
        value = 1
        while value <= 2 and decision(f"above {value}", ("activity", activity, bend // 4, odd), ("corners", corners, odd)):
            value += 1
        if value > 2:
            value = 2 + magnitude(stream, models, ("height", activity // 4))
        return -value if negative else value

    def decode_weights(self, stream):
        """11.5"""
        weights = self.models.setdefault("height weights", {name: list(w) for name, w in WEIGHTS.items()})
        for name in WEIGHTS:
            if name[1] is not None and not self.prediction:
                continue
            if stream.decision(model(self.models, "weights change")):
                for k, w in enumerate(weights[name]):
                    weights[name][k] = clamp(w + residual(stream, self.models, "weights change by"), -255, 255)
        return weights

    def vertices(self):
        if not self.list:
            require(not self.packet.section(VERTICES, 0), "vertices are left over")
            return []
        self.predict()
        self.moved = [None] * len(self.list)
        if self.prediction:
            self.moved = [self.prediction.moved_height(cell, c, self.points[i], self.normals[i])
                          for i, (cell, c) in enumerate(self.list)]
        streams = self.slices.streams(self.packet.section(VERTICES, 0))
        weights = self.decode_weights(streams[0])
        step = self.packet.step
        self.heights, self.magnitudes = [0] * len(self.list), [0] * len(self.list)
        for odd in (0, 1):
            for i, (cell, corners) in enumerate(self.list):
                if sum(cell) % 2 != odd:
                    continue
                near, far, activity, errors = self.coded(i, odd)
                inputs, bend = self.inputs[i]
                inputs = [near, far, *inputs]
                expected = clamp(32 + dot(weights[odd, None], inputs) >> 6, -CELL, CELL)
                moved = None
                if self.moved[i]:
                    height, confidence = self.moved[i]
                    other = dot(weights[odd, confidence >= 4], [*inputs, height, *errors])
                    other = clamp(32 + other >> 6, -CELL, CELL)
                    moved = confidence, min(7, 4 * abs(other - expected) // step)
                    expected = other
                number = self.slices.numbers[i]
                r = self.residual(streams[number], models_of(self.models, number), odd, activity, bend, corners, moved)
                self.heights[i] = limited(expected + r * step)
                self.magnitudes[i] = min(abs(r), 15)
        for stream in streams:
            stream.used_up()
        return [in_grid(cell, [clamp(8 * self.points[i][k] + (self.heights[i] * self.normals[i][k] + 8192 >> 14), 0, CELL)
                               for k in range(3)]) for i, (cell, _) in enumerate(self.list)]
