# SPDX-License-Identifier: BSD-3-Clause
"""Rate-distortion curves: bytes at a given distance, and the Bjøntegaard rate between two curves.

A curve is a list of (distance, bytes). In between its points the logarithm of the bytes is a monotone piecewise cubic
of the logarithm of the distance (Fritsch and Carlson 1980; "pchip", which is what video coders use for this since the
polynomial of Bjøntegaard's VCEG-M33 swings). Nothing is said outside a curve's points."""

import math
from bisect import bisect_right


class Curve:
    def __init__(self, points):
        points = sorted((distance, size) for distance, size in points if distance > 0)
        kept = []  # only points that cost less than every point of smaller distance
        for distance, size in points:
            if not kept or (distance > kept[-1][0] and size < kept[-1][1]):
                kept.append((distance, size))
        self.x = [math.log(distance) for distance, _ in kept]
        self.y = [math.log(size) for _, size in kept]
        self.slopes = self._slopes()

    def _slopes(self):
        """The cubics' slopes at the points: weighted harmonic means of the chords beside them, so that the curve falls
        where its points fall; at the ends the only chord."""
        widths = [b - a for a, b in zip(self.x, self.x[1:])]
        chords = [(b - a) / w for a, b, w in zip(self.y, self.y[1:], widths)]
        if not chords:
            return [0.0] * len(self.x)
        inner = []
        for (left, right), (w, v) in zip(zip(chords, chords[1:]), zip(widths, widths[1:])):
            inner.append((3 * (w + v)) / ((2 * v + w) / left + (v + 2 * w) / right))
        return [chords[0], *inner, chords[-1]]

    def covers(self, distance):
        """A hair's breadth outside still counts: the ends of a common range come from logarithms."""
        return len(self.x) > 1 and self.x[0] - 1e-9 <= math.log(distance) <= self.x[-1] + 1e-9

    def _log_bytes(self, x):
        i = min(max(bisect_right(self.x, x) - 1, 0), len(self.x) - 2)
        width = self.x[i + 1] - self.x[i]
        t = (x - self.x[i]) / width
        return ((1 + 2 * t) * (1 - t) ** 2 * self.y[i] + t * (1 - t) ** 2 * width * self.slopes[i]
                + t * t * (3 - 2 * t) * self.y[i + 1] + t * t * (t - 1) * width * self.slopes[i + 1])

    def bytes_at(self, distance):
        """Bytes at a distance, or None outside the curve."""
        return math.exp(self._log_bytes(math.log(distance))) if self.covers(distance) else None


def ratio_at(ours, theirs, distance):
    """Our bytes over theirs at a distance, or None where one of the curves does not reach."""
    our_bytes, their_bytes = ours.bytes_at(distance), theirs.bytes_at(distance)
    return our_bytes / their_bytes if our_bytes and their_bytes else None


def bd_rate(ours, theirs, intervals=200):
    """The mean over log-distance, where both curves reach, of the difference in log-bytes, as a part: -0.6 says that
    ours takes 60 % fewer bytes. None when they have no range in common. Simpson's rule."""
    if len(ours.x) < 2 or len(theirs.x) < 2:
        return None
    low, high = max(ours.x[0], theirs.x[0]), min(ours.x[-1], theirs.x[-1])
    if high <= low:
        return None
    total = 0.0
    for i in range(intervals + 1):
        x = low + (high - low) * i / intervals
        weight = 1 if i in (0, intervals) else 4 if i % 2 else 2
        total += weight * (ours._log_bytes(x) - theirs._log_bytes(x))
    return math.exp(total / (3 * intervals)) - 1
