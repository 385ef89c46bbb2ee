#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Entropy decoding: spec/codec.md section 6. Part of decode.py."""

MASK64 = (1 << 64) - 1


class Refused(Exception):
    """The packet breaks a rule."""


def require(holds, rule):
    if not holds:
        raise Refused(rule)


class Model:
    def __init__(self, one=32768):
        self.one, self.seen = one, 0

    def update(self, bit):
        rate = 65534 // (2 * self.seen + 3)
        if bit:
            self.one += (65280 - self.one) * rate + 65535 >> 16
        else:
            self.one -= (self.one - 256) * rate + 65535 >> 16
        self.seen = min(self.seen + 1, 160)


class Stream:
    """The range decoder (6.2)."""

    def __init__(self, data):
        self.data, self.taken, self.range = data, 0, MASK64
        self.code = self.next() << 32
        self.code += self.next()

    def next(self):
        four = self.data[self.taken:self.taken + 4].ljust(4, b"\0")
        self.taken += 4
        require(self.taken <= len(self.data) + 8, "a stream ends too early")
        return int.from_bytes(four, "big")

    def split(self, bound):
        bit = int(self.code < bound)
        if bit:
            self.range = bound
        else:
            self.code -= bound
            self.range -= bound
        if self.range < 1 << 32:
            self.code = (self.code << 32 & MASK64) + self.next()
            self.range <<= 32
        return bit

    def decision(self, model):
        bit = self.split((self.range >> 16) * model.one)
        model.update(bit)
        return bit

    def raw(self, count):
        value = 0
        for _ in range(count):
            value = 2 * value + self.split(self.range >> 1)
        return value

    def used_up(self):
        require(self.taken >= len(self.data), "a stream is not used to its end")


def model(models, name, one=32768):
    """The model of this name, made when it is asked for the first time."""
    if name not in models:
        models[name] = Model(one)
    return models[name]


def residual(stream, models, name):
    """6.3"""
    if stream.decision(model(models, (name, "zero"))):
        return 0
    negative = stream.decision(model(models, (name, "negative")))
    e = 0
    while e < 15 and stream.decision(model(models, (name, "more", e))):
        e += 1
    value, left = 1, e
    while left > 0 and e - left < 3:
        value = 2 * value + stream.decision(model(models, (name, "mantissa", e, value)))
        left -= 1
    if left > 0:
        value = (value << left) + stream.raw(left)
    return -value if negative else value
