#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Which vertices a cell has, one for each sheet: spec/codec.md section 5.5. Part of decode.py."""

from functools import lru_cache

from surface import CORNERS, plus

FACES = [(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1)]
ON_FACE = [frozenset(j for j in range(8) if CORNERS[j][face // 2] == face % 2) for face in range(6)]
EDGES = [frozenset((j, j | bit)) for j in range(8) for bit in (1, 2, 4) if not j & bit]


def inside_of(configuration):
    return frozenset(j for j in range(8) if configuration >> j & 1)


def diagonal(pair):
    return len(pair) == 2 and frozenset(pair) not in EDGES


def ambiguous_faces(inside):
    return [face for face in range(6) if diagonal(ON_FACE[face] & inside)]


def connected(joints, start):
    """All corners that pairs of corners join to those of `start`."""
    group = set(start)
    while True:
        more = set().union(*(pair for pair in joints if pair & group)) - group
        if not more:
            return frozenset(group)
        group |= more


def joints_of(inside, turned, cut):
    """The pairs of corners that are joined."""
    outside = frozenset(range(8)) - inside
    edges = [edge for edge in EDGES if edge != cut and (edge <= inside or edge <= outside)]
    return edges + [ON_FACE[face] & (inside if face == turned else outside) for face in ambiguous_faces(inside)]


def sheets_of(inside, turned=None, cut=None):
    """The sheets, as sets of corners on their inner sides."""
    joints = joints_of(inside, turned, cut)
    changing = [edge for edge in EDGES if len(edge & inside) == 1]
    found = set()
    for edge in changing:
        in_group, out_group = connected(joints, edge & inside), connected(joints, edge - inside)
        others = [e for e in changing if not (e & in_group and e & out_group)]
        found.add(connected(joints + others, in_group))
    return found


@lru_cache(None)
def doubtful_face(configuration):
    """The ambiguous face whose inside corners are in one group, or None."""
    inside = inside_of(configuration)
    joints = joints_of(inside, None, None)
    for face in ambiguous_faces(inside):
        pair = ON_FACE[face] & inside
        if pair <= connected(joints, [min(pair)]):
            return face
    return None


@lru_cache(None)
def sheets_at(configuration, turned, border):
    """Of a cell with these faces at the border."""
    inside = inside_of(configuration)
    whole = sheets_of(inside, turned)

    def off_border(sheet):
        return any(len(edge & sheet) == 1 and not any(edge <= ON_FACE[face] for face in border) for edge in EDGES)

    for edge in EDGES:
        faces = [face for face in range(6) if edge <= ON_FACE[face]]
        if len(edge & inside) == 1 or not set(faces) <= set(border):
            continue
        parts = sheets_of(inside, turned, edge)
        if len(parts) > len(whole) and all(map(off_border, parts - whole)):
            whole = parts
            break
    return sorted(sum(1 << j for j in sheet) for sheet in whole)


def sheets(cells):
    """The vertices of active cells: pairs of a cell and the configuration of a sheet."""
    result = []
    for cell, configuration in cells.items():
        turned = doubtful_face(configuration)
        if turned is not None:
            other = cells.get(plus(cell, FACES[turned]))
            if other is not None and doubtful_face(other) != turned ^ 1:
                turned = None
        inside = inside_of(configuration)
        border = tuple(face for face in range(6)
                       if 0 < len(ON_FACE[face] & inside) < 4 and plus(cell, FACES[face]) not in cells)
        result += [(cell, sheet) for sheet in sheets_at(configuration, turned, border)]
    return result


def shared(cell, other):
    """Pairs of corners of two cells that are the same node."""
    return [(j, k) for j in range(8) for k in range(8) if plus(cell, CORNERS[j]) == plus(other, CORNERS[k])]
