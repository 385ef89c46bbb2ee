#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Field types: spec/notation.md section 2.2. Part of decode.py."""

import struct
from math import isfinite

from entropy import MASK64, Refused, require


class Fields:
    """Reads field types from the front of some bytes."""

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

    def svarint(self):
        value = self.varint(0, MASK64)
        return value >> 1 ^ -(value & 1)

    def f64(self):
        value = struct.unpack("<d", self.take(8))[0]
        require(isfinite(value), "a number is not finite")
        return value

    def ranged(self, value, low, high):
        require(low <= value <= high, f"{value} is not from {low} to {high}")
        return value
