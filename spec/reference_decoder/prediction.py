#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""P packets: spec/codec.md section 8. Part of decode.py."""

from itertools import product
from math import isqrt

from entropy import MASK64, Stream, model, require, residual
from fields import Fields
from surface import CELL, CORNERS, FRAMES, MOTION, VERTICES, clamp, in_grid, inner_vertex, intra_offsets, plus

AXES = range(3)
NEAREST = list(product((-1, 0, 1), repeat=3))
BELOW = [(-1, 0, 0), (0, -1, 0), (0, 0, -1)]
CLASSES = 10, 26, 43, 69, 102, 154, 256  # 8.5: limits of the moved surface's distance, and of the usual model's probability
LIKELIHOODS = 2, 5, 10, 18, 27, 39, 53, 64, 75, 89, 101, 110, 118, 123, 126
BENDS = 1 << 19, 1 << 22, 1 << 24  # 8.6


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def towards_zero(a, b):
    """a / b for b above 0."""
    return a // b if a >= 0 else -(-a // b)


def not_above(limits, value):
    return sum(limit <= value for limit in limits)


def between(a, b, t):
    return a + ((b - a) * t >> 14)


# ---- 8.4 The field of the reference ----------------------------------------------------------------------------------


class Place:
    """What the field has at a place: the distances of its eight corners; value and slope when all are known."""

    def __init__(self, corners, t):
        self.corners = corners
        self.known = None not in corners
        if self.known:
            v = corners
            x = [v[2 * i + 1] - v[2 * i] for i in range(4)]
            X = [between(v[2 * i], v[2 * i + 1], t[0]) for i in range(4)]
            Y = [between(X[2 * i], X[2 * i + 1], t[1]) for i in range(2)]
            self.value = between(Y[0], Y[1], t[2])
            self.slope = (between(between(x[0], x[1], t[1]), between(x[2], x[3], t[1]), t[2]),
                          between(X[1] - X[0], X[3] - X[2], t[2]),
                          Y[1] - Y[0])


class Reference:
    """The distances of the nodes near the full surface of the packet before."""

    def __init__(self, vertices, faces, cells):
        sums = [(0, 0, 0) for _ in vertices]
        for quad in faces:
            p = [vertices[i] for i in quad]
            a, b = ([p[end][k] - p[start][k] >> 6 for k in AXES] for start, end in ((0, 2), (1, 3)))
            cross = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
            for i in quad:
                sums[i] = plus(sums[i], cross)
        nearest = {}  # node: (apart, distance)
        for p, total, (_, configuration) in zip(vertices, sums, cells):
            unit = self.unit(total, configuration)
            near = tuple(k + 8192 >> 14 for k in p)
            for step in NEAREST:
                node = plus(near, step)
                d = [CELL * node[k] - p[k] for k in AXES]
                apart = sum((k >> 8) ** 2 for k in d)
                reached = apart, sum(u * k >> 14 for u, k in zip(unit, d))
                nearest[node] = min(nearest.get(node, reached), reached)
        self.distances = {node: distance for node, (_, distance) in nearest.items()}

    @staticmethod
    def unit(total, configuration):
        q = dot(total, total)
        if q == 0:
            return [n >> 2 for n in FRAMES[configuration][1]]
        scale = (1 << 38) // isqrt(q)
        return [t * scale >> 26 for t in total]

    def at(self, place):
        cell = tuple(k >> 14 for k in place)
        if min(cell) < 0:
            return Place([None] * 8, None)
        return Place([self.distances.get(plus(cell, corner)) for corner in CORNERS], [k % CELL for k in place])


# ---- 8.2 and 8.3 Motion ----------------------------------------------------------------------------------------------


class MotionField:
    """Which blocks move, and how."""

    def __init__(self, block_log2, step):
        self.log2, self.side, self.step = block_log2, 1 << block_log2, step
        self.vectors = {}  # of the blocks; None: does not move

    def decode(self, blocks, stream, models, before=None):
        """`before`: the blocks of the packet before, in profile main (11.8)."""
        self.vectors = {block: None for block in blocks}
        steady = before and (before.log2, before.step) == (self.log2, self.step)
        for block in self.vectors:
            around = [self.vectors.get(plus(block, step)) for step in BELOW]
            around = [vector for vector in around if vector is not None]
            n = len(around)
            same = before.vectors.get(block) if steady else None
            if same is not None:
                around += 4 * [same]
                n += 4
            if not stream.decision(model(models, ("moves", n))):
                continue
            vector = [towards_zero(sum(v[k] for v in around), max(len(around), 1)) for k in AXES]
            for k in AXES:
                vector[k] += residual(stream, models, ("difference", k, n))
                require(abs(vector[k]) <= 1048576 // self.step, "a motion vector of more than 64 cells")
            self.vectors[block] = vector

    def of_block(self, block):
        """None: it does not move, or does not exist."""
        vector = self.vectors.get(block)
        return vector and [v * self.step for v in vector]

    def of_cell(self, cell):
        """None in a block that does not move."""
        block = tuple(x >> self.log2 for x in cell)
        own = self.of_block(block)
        if own is None:
            return None
        inside = [2 * (x % self.side) + 1 - self.side for x in cell]
        total = 0, 0, 0
        for subset in product((0, 1), repeat=3):
            other = plus(block, [take * (-1 if i < 0 else 1) for take, i in zip(subset, inside)])
            weight = 1
            for take, i in zip(subset, inside):
                weight *= abs(i) if take else 2 * self.side - abs(i)
            total = plus(total, [weight * m for m in self.of_block(other) or own])
        return [t >> 3 * self.log2 + 3 for t in total]


# ---- 8.5 to 8.8 Signs and vertices -----------------------------------------------------------------------------------


def confidence(corners, inside, place):
    """8.6: of a plane's values at a cell's corners."""
    wrong = sum((corner < 0) != sign for corner, sign in zip(corners, inside))
    bend = sum(sum(v * (-1) ** dot(axes, corner) for v, corner in zip(place.corners, CORNERS)) ** 2
               for axes in ((1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 1, 1)))
    return 4 * min(wrong, 3) + not_above(BENDS, bend)


class Plane:
    """8.6: the surface where a cell expects it."""

    def __init__(self, place, configuration):
        vertex, _, *tangents = FRAMES[configuration]
        self.distance = 4 * place.value
        self.slope = [4 * s for s in place.slope]
        first = self.distance - (dot(self.slope, vertex) >> 14)
        corners = [first + dot(self.slope, corner) for corner in CORNERS]
        inside = [configuration >> j & 1 for j in range(8)]

        shift, edges = [0, 0, 0], 0
        for j, k in product(range(8), AXES):
            if CORNERS[j][k] or inside[j] == inside[j + (1 << k)]:
                continue
            edges += 1
            rise = 1 if inside[j] else -1
            if self.slope[k] * rise > 0:
                inverse = (1 << 28) // abs(self.slope[k])
                shift[k] += clamp(-corners[j] * rise * inverse >> 14, 0, CELL) - 8192
        self.tangents = [dot(shift, tangent) * (65536 // edges) >> 30 for tangent in tangents]

        self.confidence = confidence(corners, inside, place)


class Prediction:
    """What one P packet is told by its reference."""

    def __init__(self, packet, depth, reference, models, main):
        self.packet, self.depth, self.reference, self.models, self.main = packet, depth, reference, models, main
        content = packet.section(MOTION, 0)
        front = Fields(content)
        f = Fields(front.take(front.varint(0, MASK64)))
        self.motion = MotionField(f.varint(2, 5), f.varint(256, CELL))
        if not main:
            self.weights = [[f.fixed(1, 0, 128) for _ in range(4)] for _ in range(16)]
            self.levels = [f.fixed(1, 1, 255) for _ in range(3)]
        self.vectors = content[front.at:]
        self.block_level = max(depth - self.motion.log2, 0)

    def decode_motion(self, blocks):
        stream = Stream(self.vectors)
        self.motion.decode(blocks, stream, self.models, self.main and self.models.get("blocks"))
        self.models["blocks"] = self.motion
        stream.used_up()

    @staticmethod
    def sign_model(kind, usual, models):
        """8.5: the model of the sign of a point of that kind."""
        return model(models, ("moved", *kind, not_above(LIKELIHOODS, usual.one >> 9)))

    def sign_kind(self, level, cell, point):
        """8.5: min(D - L, 2) and the class; None: the sign is coded as in I packets."""
        below = self.depth - level
        motion = self.motion.of_block(tuple(x >> self.motion.log2 - below - 1 for x in cell))
        if motion is None:
            return None
        place = self.reference.at(plus([CELL * x << below for x in point], motion))
        if place.known:
            value = place.value
            s = not_above(CLASSES, min(256, (value if value >= 0 else -value - 1) >> 4))
            kind = 8 + s if value >= 0 else 7 - s
        else:
            total = sum(v for v in place.corners if v is not None)
            if total == 0:
                return None
            kind = 16 if total > 0 else 17
        return min(below, 2), kind

    def plane(self, cell, configuration):
        """8.6: None: no prediction."""
        motion = self.motion.of_cell(cell)
        if motion is None:
            return None
        place = self.reference.at(plus(in_grid(cell, FRAMES[configuration][0]), motion))
        return Plane(place, configuration) if place.known else None

    def moved_height(self, cell, configuration, point, normal):
        """11.9: height and confidence; None: the surface is not near."""
        motion = self.motion.of_cell(cell)
        if motion is None:
            return None
        inner = [8 * p for p in point]
        place = self.reference.at(plus(in_grid(cell, inner), motion))
        if not place.known:
            return None
        facing = max(sum(s * n >> 14 for s, n in zip(place.slope, normal)), 1638)
        height = clamp(towards_zero(-place.value * CELL, facing), -CELL, CELL)
        first = place.value - (dot(place.slope, inner) >> 14)
        corners = [first + dot(place.slope, corner) for corner in CORNERS]
        return height, confidence(corners, [configuration >> j & 1 for j in range(8)], place)

    def vertices(self, cells):
        """8.8"""
        stream = Stream(self.packet.section(VERTICES, 0))
        self.inner, self.errors = {}, {}  # of the cells so far
        for cell, configuration in cells:
            plane = self.plane(cell, configuration)
            if plane is None:
                along = intra_offsets(self.packet, stream, self.models, configuration)
            else:
                along, self.errors[cell] = self.offsets(stream, cell, configuration, plane)
            self.inner[cell] = inner_vertex(configuration, along)
        stream.used_up()
        return [in_grid(cell, inner) for cell, inner in self.inner.items()]

    def offsets(self, stream, cell, configuration, plane):
        """8.8: along the normal and both tangents; and the cell's error."""
        packet = self.packet
        _, normal, *tangents = FRAMES[configuration]
        w_tangential, w_normal, w_error, w_height = self.weights[plane.confidence]
        mean_height, mean_error, mean_magnitude = self.neighbours(cell, configuration)
        size = min(7, 3 * mean_magnitude // (2 * packet.step))

        def decode(component):
            return residual(stream, self.models, ("predicted", component, size, plane.confidence))

        along = [(w_tangential * plane.tangents[i] >> 6) + decode(i + 1) * packet.tangential_step for i in range(2)]
        steep = [dot(plane.slope, tangent) >> 14 for tangent in tangents]
        facing = max(dot(plane.slope, normal) >> 14, 6554)
        at = plane.distance + (steep[0] * along[0] + steep[1] * along[1] >> 14)
        surface = clamp(towards_zero(-at * CELL, facing), -CELL, CELL)
        expected = w_normal * surface + w_error * mean_error + w_height * mean_height >> 6
        along_0 = expected + self.far(decode(0))
        return [along_0, *along], clamp(along_0 - surface, -CELL, CELL)

    def far(self, r0):
        if r0 == 0:
            return 0
        m = abs(r0)
        far = (self.levels[min(m, 3) - 1] * self.packet.step >> 6) + max(m - 3, 0) * self.packet.step
        return -far if r0 < 0 else far

    def neighbours(self, cell, configuration):
        """8.7: mean height, mean error, mean magnitude."""
        vertex, normal = FRAMES[configuration][:2]
        heights, errors = [], []
        for k, step in enumerate(BELOW):
            other = plus(cell, step)
            if other in self.inner:
                apart = [i - v for i, v in zip(self.inner[other], vertex)]
                heights.append(clamp(dot(apart, normal) - CELL * normal[k] >> 14, -CELL, CELL))
            if other in self.errors:
                errors.append(self.errors[other])

        def mean(values, none):
            return sum(values) * (65536 // len(values)) >> 16 if values else none

        return mean(heights, 0), mean(errors, 0), mean([abs(e) for e in errors], 1638)
