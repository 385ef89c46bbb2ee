#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""XXH3, 64 bits, seed 0 (xxHash by Yann Collet): the surface hash of spec codec 7.

Lengths 1 to 8 are left out, since no surface has them: vertices take 12 bytes and quads 16."""

MASK = (1 << 64) - 1
PRIME32 = (0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D)
PRIME64 = (0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5)
SECRET = bytes.fromhex(
    "b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671fcb79e64eccc0e578825ad07dccff7221"
    "b8084674f743248ee03590e6813a264c3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8"
    "a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364eac5ac8334d3ebc3c581a0fffa1363eb"
    "170ddd51b7f0da49d316552629d4689e2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e")


def u64(data, at):
    return int.from_bytes(data[at:at + 8], "little")


def folded(a, b):
    """The 128-bit product, its halves combined."""
    product = a * b
    return (product & MASK) ^ (product >> 64)


def avalanche(h):
    h ^= h >> 37
    h = h * 0x165667919E3779F9 & MASK
    return h ^ h >> 32


def avalanche64(h):
    h ^= h >> 33
    h = h * PRIME64[1] & MASK
    h ^= h >> 29
    h = h * PRIME64[2] & MASK
    return h ^ h >> 32


def mix16(data, at, secret):
    return folded(u64(data, at) ^ u64(SECRET, secret), u64(data, at + 8) ^ u64(SECRET, secret + 8))


def short(data):
    """9 to 16 bytes."""
    low = u64(data, 0) ^ u64(SECRET, 24) ^ u64(SECRET, 32)
    high = u64(data, len(data) - 8) ^ u64(SECRET, 40) ^ u64(SECRET, 48)
    swapped = int.from_bytes(low.to_bytes(8, "little"), "big")
    return avalanche(len(data) + swapped + high + folded(low, high) & MASK)


def middle(data):
    """17 to 240 bytes."""
    size = len(data)
    sum_ = size * PRIME64[0]
    if size <= 128:
        for i in range((size - 1) // 32 + 1):
            sum_ += mix16(data, 16 * i, 32 * i) + mix16(data, size - 16 * (i + 1), 32 * i + 16)
        return avalanche(sum_ & MASK)
    sum_ = avalanche(sum_ + sum(mix16(data, 16 * i, 16 * i) for i in range(8)) & MASK)
    sum_ += sum(mix16(data, 16 * i, 16 * (i - 8) + 3) for i in range(8, size // 16))
    return avalanche(sum_ + mix16(data, size - 16, 136 - 17) & MASK)


def long(data):
    """Above 240 bytes: stripes of 64 bytes on eight accumulators, 16 stripes a block."""
    sums = [PRIME32[2], *PRIME64[:4], PRIME32[1], PRIME64[4], PRIME32[0]]

    def stripe(at, secret):
        for i in range(8):
            value = u64(data, at + 8 * i)
            key = value ^ u64(SECRET, secret + 8 * i)
            sums[i ^ 1] = sums[i ^ 1] + value & MASK
            sums[i] = sums[i] + (key & 0xFFFFFFFF) * (key >> 32) & MASK

    stripes = (len(data) - 1) // 64
    for n in range(stripes):
        stripe(64 * n, n % 16 * 8)
        if n % 16 == 15:
            for i in range(8):
                sums[i] = ((sums[i] ^ sums[i] >> 47) ^ u64(SECRET, 128 + 8 * i)) * PRIME32[0] & MASK
    stripe(len(data) - 64, 128 - 7)
    total = len(data) * PRIME64[0]
    for i in range(0, 8, 2):
        total += folded(sums[i] ^ u64(SECRET, 11 + 8 * i), sums[i + 1] ^ u64(SECRET, 19 + 8 * i))
    return avalanche(total & MASK)


def xxh3(data):
    if not data:
        return avalanche64(u64(SECRET, 56) ^ u64(SECRET, 64))
    if len(data) < 9:
        raise ValueError("lengths 1 to 8 are left out")
    return short(data) if len(data) <= 16 else middle(data) if len(data) <= 240 else long(data)
