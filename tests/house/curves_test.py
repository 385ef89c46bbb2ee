#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The figures that bench/ draws from its measurements: curves that are known in closed form."""

import math
import sys
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench"))
from curves import Curve, bd_rate, ratio_at  # noqa: E402


def power(scale, exponent, distances):
    """bytes = scale · distance^-exponent: a straight line in logarithms, which the cubic must follow."""
    return Curve([(d, scale * d**-exponent) for d in distances])


HALVES = [2.0**-k for k in range(1, 6)]


class Curves(unittest.TestCase):
    def test_goes_through_its_points_and_a_line_between(self):
        curve = power(1000, 0.5, HALVES)
        for distance in HALVES + [0.3, 0.1, 0.04]:
            self.assertAlmostEqual(curve.bytes_at(distance), 1000 * distance**-0.5, places=6)

    def test_says_nothing_outside_its_points(self):
        curve = power(1000, 0.5, HALVES)
        self.assertIsNone(curve.bytes_at(0.51))
        self.assertIsNone(curve.bytes_at(0.03))
        self.assertIsNone(ratio_at(curve, power(1000, 0.5, [1.0, 0.6]), 0.25))

    def test_falls_between_its_points(self):
        curve = Curve([(0.5, 100), (0.25, 101), (0.125, 400), (0.0625, 410)])
        sizes = [curve.bytes_at(0.5 * 2 ** (-3 * i / 60)) for i in range(61)]
        self.assertEqual(sizes, sorted(sizes))

    def test_leaves_out_points_that_cost_more_for_less(self):
        kept = Curve([(0.5, 100), (0.25, 200), (0.3, 210), (0.125, 400)])
        self.assertAlmostEqual(kept.bytes_at(0.3), Curve([(0.5, 100), (0.25, 200), (0.125, 400)]).bytes_at(0.3))

    def test_half_the_bytes_everywhere_is_minus_fifty_percent(self):
        ours, theirs = power(500, 0.7, HALVES), power(1000, 0.7, [0.4, 0.2, 0.1, 0.01])
        self.assertAlmostEqual(bd_rate(ours, theirs), -0.5)
        self.assertAlmostEqual(bd_rate(theirs, ours), 1.0)
        self.assertAlmostEqual(ratio_at(ours, theirs, 0.2), 0.5)

    def test_rate_is_the_mean_over_the_common_range(self):
        ours, theirs = power(1, 1, [1, 0.5, 0.25]), power(1, 2, [0.5, 0.25, 0.125])
        # log(ours / theirs) = log(distance), from log(1/4) to log(1/2): its mean is log(1/2) - log(2) / 2.
        self.assertAlmostEqual(bd_rate(ours, theirs), math.exp(math.log(0.5) - math.log(2) / 2) - 1)

    def test_no_rate_without_a_common_range(self):
        self.assertIsNone(bd_rate(power(1, 1, [1, 0.5]), power(1, 1, [0.4, 0.2])))
        self.assertIsNone(bd_rate(power(1, 1, [1, 0.5]), power(1, 1, [0.7])))


if __name__ == "__main__":
    unittest.main()
