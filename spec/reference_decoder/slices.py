#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Slices: spec/codec.md section 11.10. Part of decode.py."""

from entropy import Stream, require
from fields import Fields

SLICES = 16  # tools


class Slices:
    """How a list of cells is cut: `numbers` has the slice of each."""

    def __init__(self, cells, rule):
        most, least = rule
        self.count = max(1, min(len(cells) // least, most))
        self.numbers = []
        group, first = None, 0
        for i, cell in enumerate(cells):
            if tuple(x >> 2 for x in cell) != group:
                group, first = tuple(x >> 2 for x in cell), i
            self.numbers.append(self.count * first // len(cells))

    def streams(self, section):
        f = Fields(section)
        lengths = [f.varint(0, (1 << 28) - 1) for _ in range(self.count - 1)]
        rest = section[f.at:]
        require(sum(lengths) <= len(rest), "slices are longer than their section")
        streams = []
        for length in lengths:
            streams.append(Stream(rest[:length]))
            rest = rest[length:]
        return [*streams, Stream(rest)]


def models_of(models, number):
    """A slice's own: those of slice 0 are the models of lists that are cut nowhere."""
    return models.setdefault(("slice", number), {}) if number else models
