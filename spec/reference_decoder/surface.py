#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Vertices and quads: spec/codec.md section 5. Part of decode.py."""

from math import isqrt

from entropy import Stream, residual

CELL = 16384
SIGNS, LEAVES, MOTION, VERTICES = 1, 2, 3, 4  # section kinds
CORNERS = [(j & 1, j >> 1 & 1, j >> 2) for j in range(8)]


def plus(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def clamp(value, low, high):
    return max(low, min(value, high))


def is_active(configuration):
    return configuration not in (0, 255)


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


def inner_vertex(configuration, along):
    """5.2: the vertex inside its cell; `along` has its offsets along the normal and both tangents."""
    vertex, normal, t1, t2 = FRAMES[configuration]
    return [clamp(vertex[k] + (along[0] * normal[k] + along[1] * t1[k] + along[2] * t2[k] + 8192 >> 14), 0, CELL)
            for k in range(3)]


def in_grid(cell, inner):
    return [CELL * cell[k] + inner[k] for k in range(3)]


def intra_offsets(packet, stream, models, configuration):
    """5.2: three residuals, times their steps."""
    steps = packet.step, packet.tangential_step, packet.tangential_step
    return [step * residual(stream, models, (component, configuration)) for component, step in enumerate(steps)]


def intra_vertices(packet, cells, models):
    """5.2"""
    stream, result = Stream(packet.section(VERTICES, 0)), []
    for cell, configuration in cells:
        result.append(in_grid(cell, inner_vertex(configuration, intra_offsets(packet, stream, models, configuration))))
    stream.used_up()
    return result


def coarse_vertices(nodes, cells, shift):
    """5.4"""
    return [[min(CELL * cell[k] + FRAMES[configuration][0][k] << shift, CELL * (nodes[k] - 1)) for k in range(3)]
            for cell, configuration in cells]


def quads(cells):
    """5.3, and 5.5 where a cell has several vertices."""
    numbers = {}
    for i, (cell, _) in enumerate(cells):
        numbers.setdefault(cell, []).append(i)
    result = []
    for i, (cell, configuration) in enumerate(cells):
        for a in range(3):
            u, v = (a + 1) % 3, (a + 2) % 3
            low, high = configuration & 1, configuration >> (1 << a) & 1
            if low == high or cell[u] == 0 or cell[v] == 0:
                continue
            ring = [i]
            for du, dv in ((1, 0), (1, 1), (0, 1)):
                other = plus(cell, [-(du * (k == u) + dv * (k == v)) for k in range(3)])
                edge = du << u | dv << v  # its low end, as a corner of the other cell
                ring += [n for n in numbers[other] if cells[n][1] >> edge & 1 != cells[n][1] >> (edge | 1 << a) & 1]
            if not low:
                ring = [ring[0], ring[3], ring[2], ring[1]]
            result.append(ring)
    return result
