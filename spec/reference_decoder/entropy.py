#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Entropy decoding: spec/codec.md sections 6 and 11.6. Part of decode.py."""

from bisect import bisect_right

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


def magnitude(stream, models, name):
    """6.3: a value of 1 or more."""
    e = 0
    while e < 15 and stream.decision(model(models, (name, "more", e))):
        e += 1
    value, left = 1, e
    while left > 0 and e - left < 3:
        value = 2 * value + stream.decision(model(models, (name, "mantissa", e, value)))
        left -= 1
    if left > 0:
        value = (value << left) + stream.raw(left)
    return value


def residual(stream, models, name):
    """6.3"""
    if stream.decision(model(models, (name, "zero"))):
        return 0
    negative = stream.decision(model(models, (name, "negative")))
    value = magnitude(stream, models, name)
    return -value if negative else value


# ---- 11.6 Mixed decisions ----

POINTS = [22, 36, 60, 98, 162, 267, 439, 720, 1179, 1921, 3108, 4971, 7812, 11955, 17625, 24743, 32768, 40793, 47911, 53581, 57724,
          60565, 62428, 63615, 64357, 64816, 65097, 65269, 65374, 65438, 65476, 65500, 65514]


def squash(x):
    at, part = x + 2048 >> 7, x + 2048 & 127
    return POINTS[at] * (128 - part) + POINTS[at + 1] * part + 64 >> 7


SQUASHED = [squash(x) for x in range(-2047, 2048)]
STRETCHED = [max(bisect_right(SQUASHED, 16 * p) - 1, 0) - 2047 for p in range(4096)]


def weights_of(models, name, count=2):
    return models.setdefault(name, [39322 if count == 2 else 26214] * count)


def mixed(stream, asked, weights, floor):
    logits = [STRETCHED[m.one >> 4] for m in asked]
    total = sum(w * x for w, x in zip(weights, logits)) >> 16
    one = max(floor, min(SQUASHED[max(-2047, min(total, 2047)) + 2047], 65536 - floor))
    bit = stream.split((stream.range >> 16) * one)
    error = 65536 * bit - one
    for i, m in enumerate(asked):
        weights[i] = max(-(1 << 18), min(weights[i] + (logits[i] * error + 8192 >> 14), 1 << 18))
        m.update(bit)
    return bit
