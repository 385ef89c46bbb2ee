#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""P packets: spec/codec.md section 8. Part of decode.py."""

from itertools import product
from math import isqrt

from entropy import Stream, model, require, residual
from fields import Fields
from surface import CELL, CORNERS, FRAMES, MOTION, VERTICES, clamp, in_grid, inner_vertex, plus

AXES = range(3)
AROUND = list(product((-1, 0, 1), repeat=3))


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def towards_zero(a, b):
    """a / b for b above 0."""
    return a // b if a >= 0 else -(-a // b)


class Reference:
    """The full surface of the packet before: for each active cell its vertex and its normal (8.4)."""

    def __init__(self, vertices, faces, cells):
        sums = [[0, 0, 0] for _ in vertices]
        for quad in faces:
            p = [vertices[i] for i in quad]
            a, b = ([p[end][k] - p[start][k] >> 6 for k in AXES] for start, end in ((0, 2), (1, 3)))
            cross = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
            for i in quad:
                sums[i] = plus(sums[i], cross)
        self.planes = {cell: (vertex, self.unit(total, configuration))
                       for (cell, configuration), vertex, total in zip(cells.items(), vertices, sums)}

    @staticmethod
    def unit(total, configuration):
        q = dot(total, total)
        if q == 0:
            return [n >> 2 for n in FRAMES[configuration][1]]
        scale = (1 << 38) // isqrt(q)
        return [t * scale >> 26 for t in total]

    def around(self, place):
        c = tuple(k >> 14 for k in place)
        if min(c) < 0:
            return
        for step in AROUND:
            plane = self.planes.get(plus(c, step))
            if plane is not None:
                yield plane


class MotionField:
    """8.2 and 8.3: which blocks move, and how."""

    def __init__(self, block_log2, step, cells):
        self.log2, self.side, self.step = block_log2, 1 << block_log2, step
        self.vectors = {self.block(cell): None for cell in cells}  # None: stands still

    def block(self, cell):
        return tuple(x >> self.log2 for x in cell)

    def decode(self, stream, models):
        for block in self.vectors:
            before = (self.vectors.get(plus(block, step)) for step in ((-1, 0, 0), (0, -1, 0), (0, 0, -1)))
            around = [vector for vector in before if vector is not None]
            n = len(around)
            if not stream.decision(model(models, ("moves", n))):
                continue
            vector = [towards_zero(sum(v[k] for v in around), max(n, 1)) for k in AXES]
            for k in AXES:
                vector[k] += residual(stream, models, ("difference", k, n))
                require(abs(vector[k]) <= 1048576 // self.step, "a motion vector of more than 64 cells")
            self.vectors[block] = vector

    def at(self, cell):
        """The cell's vector; None in a block that stands still."""
        block = self.block(cell)
        if self.vectors[block] is None:
            return None
        inside = [2 * (x % self.side) + 1 - self.side for x in cell]
        total, weights = [0, 0, 0], 0
        for subset in product((0, 1), repeat=3):
            vector = self.vectors.get(tuple(b + take * (-1 if i < 0 else 1) for b, take, i in zip(block, subset, inside)))
            if vector is None:
                continue
            weight = 1
            for take, i in zip(subset, inside):
                weight *= abs(i) if take else 2 * self.side - abs(i)
            weights += weight
            total = [t + weight * v * self.step for t, v in zip(total, vector)]
        return [t // weights for t in total]  # towards minus infinity


class Prediction:
    """One P packet's vertices."""

    def __init__(self, packet, cells, reference, models):
        self.packet, self.reference, self.models = packet, reference, models
        self.cells = list(cells.items())
        self.number = {cell: i for i, cell in enumerate(cells)}
        content = packet.section(MOTION, 0)
        front = Fields(content)
        f = Fields(front.take(front.varint(0, (1 << 64) - 1)))
        self.motion = MotionField(f.varint(2, 5), f.varint(256, CELL), cells)
        self.weights = [[f.fixed(1, 0, 128) for _ in AXES] for _ in range(16)]
        self.levels = [f.fixed(1, 1, 255) for _ in AXES]
        stream = Stream(content[front.at:])
        self.motion.decode(stream, models)
        stream.used_up()

    def vertices(self):
        """8.6"""
        packet, stream = self.packet, Stream(self.packet.section(VERTICES, 0))
        tangents = [[residual(stream, self.models, (component, c)) for component in (1, 2)] for _, c in self.cells]
        self.positions, self.errors = [], []
        for i, (cell, configuration) in enumerate(self.cells):
            surface, error = self.surface(cell, configuration, tangents[i]), None
            if surface is None:
                along = residual(stream, self.models, (0, configuration)) * packet.step
            else:
                offset, confidence = surface
                height, mean_error, magnitude = self.neighbours(i)
                w = self.weights[confidence]
                along = w[0] * offset + w[1] * mean_error + w[2] * height >> 6
                size = min(7, 3 * magnitude // (2 * packet.step))
                along += self.far(residual(stream, self.models, ("predicted", size, confidence)))
                error = clamp(along - offset, -CELL, CELL)
            self.positions.append(in_grid(cell, inner_vertex(packet, configuration, along, *tangents[i])))
            self.errors.append(error)
        stream.used_up()
        return self.positions

    def far(self, r0):
        if r0 == 0:
            return 0
        m = abs(r0)
        far = (self.levels[min(m, 3) - 1] * self.packet.step >> 6) + max(m - 3, 0) * self.packet.step
        return -far if r0 < 0 else far

    def surface(self, cell, configuration, tangents):
        """8.4: offset and confidence; None: no prediction."""
        motion = self.motion.at(cell)
        if motion is None:
            return None
        normal = FRAMES[configuration][1]
        inner = inner_vertex(self.packet, configuration, 0, *tangents)
        at = plus(in_grid(cell, inner), motion)
        weight = distance = squares = 0
        direction = [0, 0, 0]
        for p, unit in self.reference.around(at):
            if dot(unit, normal) < 13421773:
                continue
            d = [at[k] - p[k] for k in AXES]
            dist = dot(d, unit) >> 12
            along = dot(d, normal) >> 18
            across = max(0, sum((x >> 4) ** 2 for x in d) - along * along)
            depth = 256 - (178 * along * along + 100 * across >> 20)
            if depth <= 0:
                continue
            w = depth * depth >> 8
            weight += w
            distance += w * dist
            squares += w * (dist >> 4) ** 2
            direction = [total + w * u for total, u in zip(direction, unit)]
        if weight == 0:
            return None
        facing = max(dot(direction, normal) >> 14, 1638 * weight)
        offset = towards_zero(-distance * 4096, facing)
        if not -CELL <= offset <= CELL:
            return None
        wrong = 0
        for j, corner in enumerate(CORNERS):
            at_corner = 4096 * distance + sum(direction[k] * (CELL * corner[k] - inner[k]) for k in AXES)
            wrong += (at_corner < 0) != (configuration >> j & 1)
        spread = squares * weight - (distance >> 4) ** 2
        grade = sum(spread >= limit * weight * weight for limit in (944, 6711, 23593))
        return offset, 4 * min(wrong, 3) + grade

    def neighbours(self, i):
        """8.5: mean height, mean error, mean magnitude."""
        cell, configuration = self.cells[i]
        vertex, normal = FRAMES[configuration][:2]
        base = in_grid(cell, vertex)
        seen = heights = predicted = errors = magnitudes = 0
        for step in AROUND:
            j = self.number.get(plus(cell, step), i)
            if j >= i or dot(normal, FRAMES[self.cells[j][1]][1]) <= 53687091:
                continue
            w = 2 if sum(map(abs, step)) == 1 else 1
            height = dot([self.positions[j][k] - base[k] for k in AXES], normal) >> 14
            seen += w
            heights += w * clamp(height, -CELL, CELL)
            error = self.errors[j]
            if error is not None:
                predicted += w
                errors += w * error
                magnitudes += w * abs(error)
        if predicted == 0:
            return towards_zero(heights, max(seen, 1)), 0, 1638
        return towards_zero(heights, seen), towards_zero(errors, predicted), magnitudes // predicted
