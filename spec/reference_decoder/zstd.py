#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Decompresses one Zstandard frame (RFC 8878), without dictionaries: what spec/container.md 1.1 asks for.
Numbers in brackets name sections of the RFC. Part of isr.py."""

from entropy import Refused, require

MAGIC = bytes([0x28, 0xB5, 0x2F, 0xFD])
BLOCK_MAX = 1 << 17


def little(data):
    return int.from_bytes(data, "little")


class Forward:
    """Bits from the front of some bytes, least significant first."""

    def __init__(self, data):
        self.value, self.size, self.at = little(data), 8 * len(data), 0

    def peek(self, count):
        return self.value >> self.at & (1 << count) - 1

    def take(self, count):
        bits = self.peek(count)
        self.at += count
        require(self.at <= self.size, "zstd: a table ends too early")
        return bits


class Backward:
    """Bits from the end of some bytes; the highest bit that is set in the last byte is a mark (4.1). Bits in front of the first are 0."""

    def __init__(self, data):
        require(data and data[-1], "zstd: a bitstream has no end mark")
        self.value = little(data)
        self.left = self.value.bit_length() - 1

    def take(self, count):
        self.left -= count
        shifted = self.value >> self.left if self.left >= 0 else self.value << -self.left
        return shifted & (1 << count) - 1


# ---- FSE (4.1) ---------------------------------------------------------------------------------------------------------


def fse_counts(data, max_log):
    """Accuracy and counts of a table description (4.1.1), and how many bytes it takes."""
    bits = Forward(data)
    log = bits.take(4) + 5
    require(log <= max_log, "zstd: a table's accuracy is too high")
    left, counts = 1 << log, []
    while left > 0:
        size = (left + 1).bit_length()
        short = (1 << size) - 1 - (left + 1)
        value = bits.peek(size - 1)
        if value < short:
            bits.take(size - 1)
        else:
            value = bits.take(size)
            if value >= 1 << size - 1:
                value -= short
        counts.append(value - 1)
        left -= abs(value - 1)
        if value == 1:
            repeat = 3
            while repeat == 3:
                repeat = bits.take(2)
                counts += [0] * repeat
    require(left == 0 and len(counts) <= 256, "zstd: a table's counts do not add up")
    return log, counts, (bits.at + 7) // 8


def fse_table(log, counts):
    """(symbol, bits, base) for each state."""
    size = 1 << log
    symbols, high = [None] * size, size
    for symbol, count in enumerate(counts):
        if count == -1:
            high -= 1
            symbols[high] = symbol
    at, step = 0, (size >> 1) + (size >> 3) + 3
    for symbol, count in enumerate(counts):
        for _ in range(max(count, 0)):
            symbols[at] = symbol
            at = at + step & size - 1
            while at >= high:
                at = at + step & size - 1
    following = [max(count, 1) if count else 0 for count in counts]
    table = []
    for symbol in symbols:
        state = following[symbol]
        following[symbol] += 1
        bits = log + 1 - state.bit_length()
        table.append((symbol, bits, (state << bits) - size))
    return log, table


def rle_table(symbol):
    return 0, [(symbol, 0, 0)]


# ---- Literals (3.1.1.3.1 and 4.2) ----------------------------------------------------------------------------------------


def huffman_weights(data):
    """Weights of a tree description (4.2.1), and how many bytes it takes."""
    head = data[0]
    if head >= 128:
        count = head - 127
        packed = data[1:1 + (count + 1) // 2]
        return [packed[i // 2] >> (0 if i % 2 else 4) & 15 for i in range(count)], 1 + (count + 1) // 2
    log, counts, used = fse_counts(data[1:1 + head], 6)
    _, table = fse_table(log, counts)
    bits = Backward(data[1 + used:1 + head])
    states, weights = [bits.take(log), bits.take(log)], []
    require(bits.left >= 0, "zstd: Huffman weights end too early")
    for i in range(254):
        symbol, count, base = table[states[i % 2]]
        weights.append(symbol)
        if bits.left < count:  # this state cannot be updated: the other one gives the last weight
            weights.append(table[states[1 - i % 2]][0])
            return weights, 1 + head
        states[i % 2] = base + bits.take(count)
    raise Refused("zstd: too many Huffman weights")


def huffman_tree(data):
    """A table of (symbol, bits) by the next `longest` bits, and how many bytes the description takes."""
    weights, used = huffman_weights(data)
    total = sum(1 << w - 1 for w in weights if w)
    require(total > 0, "zstd: Huffman weights are all 0")
    longest = total.bit_length()
    rest = (1 << longest) - total
    require(longest <= 11 and rest & rest - 1 == 0, "zstd: Huffman weights do not make a tree")
    weights.append(rest.bit_length())
    table = []
    for weight in range(1, longest + 1):
        for symbol, w in enumerate(weights):
            if w == weight:
                table += [(symbol, longest + 1 - weight)] * (1 << weight - 1)
    return (longest, table), used


def huffman_decode(tree, data, count):
    longest, table = tree
    bits, out = Backward(data), bytearray()
    for _ in range(count):
        symbol, size = table[bits.take(longest)]
        bits.left += longest - size
        out.append(symbol)
    require(bits.left == 0, "zstd: literals do not use their bits")
    return out


# ---- Sequences (3.1.1.3.2) -----------------------------------------------------------------------------------------------


def codes(base, *bits):
    """Baselines and bits of codes (3.1.1.3.2.1.1), each starting where the one before ends."""
    table = []
    for count in bits:
        table.append((base, count))
        base += 1 << count
    return table


LITERAL_LENGTHS = codes(0, *[0] * 16, 1, 1, 1, 1, 2, 2, 3, 3, 4, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16)
MATCH_LENGTHS = codes(3, *[0] * 32, 1, 1, 1, 1, 2, 2, 3, 3, 4, 4, 5, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16)
# Default distributions (3.1.1.3.2.2)
DEFAULT_LITERALS = fse_table(6, [4, 3, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 3, 2, 1, 1, 1, 1, 1,
                                 -1, -1, -1, -1])
DEFAULT_MATCHES = fse_table(6, [1, 4, 3, 2, 2, 2, 2, 2, 2] + [1] * 37 + [-1] * 7)
DEFAULT_OFFSETS = fse_table(5, [1, 1, 1, 1, 1, 1, 2, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, -1, -1, -1, -1, -1])


class Frame:
    """State that blocks share: what came out, tables to repeat, the last three offsets."""

    def __init__(self):
        self.out, self.tree, self.offsets = bytearray(), None, [1, 4, 8]
        self.tables = [None, None, None]  # literal lengths, offsets, match lengths

    def block(self, data):
        require(len(data) >= 2, "zstd: a block is too short")
        literals, data = self.literals(data)
        self.sequences(literals, data)

    def literals(self, data):
        kind, form = data[0] & 3, data[0] >> 2 & 3
        if kind < 2:
            head = (1, 2, 1, 3)[form]
            size = little(data[:head]) >> (4 if form & 1 else 3)
            require(size <= BLOCK_MAX, "zstd: too many literals")
            used = head + (size if kind == 0 else 1)
            require(used <= len(data), "zstd: literals end too early")
            return (data[head:used] if kind == 0 else data[head:used] * size), data[used:]
        head, bits = ((3, 10), (3, 10), (4, 14), (5, 18))[form]
        value = little(data[:head]) >> 4
        size, packed = value & (1 << bits) - 1, value >> bits
        require(size <= BLOCK_MAX and head + packed <= len(data), "zstd: literals end too early")
        content, rest = data[head:head + packed], data[head + packed:]
        if kind == 2:
            require(content, "zstd: a Huffman tree is missing")
            self.tree, used = huffman_tree(content)
            content = content[used:]
        require(self.tree, "zstd: no Huffman tree to repeat")
        if form == 0:
            return huffman_decode(self.tree, content, size), rest
        first, second, third = (little(content[i:i + 2]) for i in (0, 2, 4))  # four streams
        ends = [6, 6 + first, 6 + first + second, 6 + first + second + third, len(content)]
        quarter = (size + 3) // 4
        require(ends[3] < ends[4] and size >= 3 * quarter, "zstd: literals end too early")
        counts = [quarter] * 3 + [size - 3 * quarter]
        parts = [huffman_decode(self.tree, content[a:b], n) for a, b, n in zip(ends, ends[1:], counts)]
        return b"".join(parts), rest

    def table(self, which, mode, data, default, max_log):
        """The table of the mode, and what follows its description."""
        if mode == 0:
            self.tables[which] = default
        elif mode == 1:
            require(data, "zstd: a table ends too early")
            self.tables[which], data = rle_table(data[0]), data[1:]
        elif mode == 2:
            log, counts, used = fse_counts(data, max_log)
            self.tables[which], data = fse_table(log, counts), data[used:]
        require(self.tables[which], "zstd: no table to repeat")
        return self.tables[which], data

    def sequences(self, literals, data):
        require(data, "zstd: a block ends in front of its sequences")
        count, at = data[0], 1
        if count >= 128:
            count, at = ((count - 128 << 8) + data[1], 2) if count < 255 else (little(data[1:3]) + 0x7F00, 3)
        if count == 0:
            require(len(data) == at, "zstd: bytes behind a block")
            self.out += literals
            return
        modes, data = data[at], data[at + 1:]
        lengths, data = self.table(0, modes >> 6, data, DEFAULT_LITERALS, 9)
        offsets, data = self.table(1, modes >> 4 & 3, data, DEFAULT_OFFSETS, 8)
        matches, data = self.table(2, modes >> 2 & 3, data, DEFAULT_MATCHES, 9)
        bits = Backward(data)
        length_state, offset_state, match_state = (bits.take(t[0]) for t in (lengths, offsets, matches))
        taken, start = 0, len(self.out)
        for i in range(count):
            length_code, offset_code, match_code = (
                table[1][state] for table, state in ((lengths, length_state), (offsets, offset_state), (matches, match_state)))
            require(offset_code[0] < 32 and length_code[0] < 36 and match_code[0] < 53, "zstd: a code is too high")
            value = (1 << offset_code[0]) + bits.take(offset_code[0])
            base, more = MATCH_LENGTHS[match_code[0]]
            match = base + bits.take(more)
            base, more = LITERAL_LENGTHS[length_code[0]]
            length = base + bits.take(more)
            if i + 1 < count:
                length_state = length_code[2] + bits.take(length_code[1])
                match_state = match_code[2] + bits.take(match_code[1])
                offset_state = offset_code[2] + bits.take(offset_code[1])
            require(bits.left >= 0 and taken + length <= len(literals), "zstd: sequences end too early")
            require(len(self.out) - start + length + match <= BLOCK_MAX, "zstd: a block's content is too long")
            self.out += literals[taken:taken + length]
            taken += length
            self.copy(self.offset(value, length), match)
        require(bits.left == 0, "zstd: sequences do not use their bits")
        self.out += literals[taken:]

    def offset(self, value, length):
        """3.1.1.5: values up to 3 repeat one of the last offsets."""
        last = self.offsets
        if value > 3:
            self.offsets = [value - 3, last[0], last[1]]
        else:
            which = value - 1 + (length == 0)
            again = last[which] if which < 3 else last[0] - 1
            self.offsets = [again] + [o for i, o in enumerate(last[:3]) if i != min(which, 2)]
        return self.offsets[0]

    def copy(self, offset, count):
        require(0 < offset <= len(self.out), "zstd: an offset points in front of the content")
        while count > 0:
            part = self.out[-offset:][:count] if offset > count else self.out[-offset:]
            self.out += part[:count]
            count -= len(part)


def content_size(data):
    """What a frame header says, and how long it is (3.1.1.1)."""
    require(data[:4] == MAGIC and len(data) > 5, "not a zstd frame")
    flags = data[4]
    single, size_flag = flags >> 5 & 1, flags >> 6
    require(not flags & 8, "zstd: a reserved bit is set")
    require(flags & 3 == 0, "zstd: a dictionary is asked for")
    at, size = 5 + (1 - single), (single, 2, 4, 8)[size_flag]
    require(size > 0, "the zstd frame does not state its content's size")
    require(len(data) >= at + size, "zstd: the frame header is cut")
    return little(data[at:at + size]) + (256 if size == 2 else 0), at + size


def decompress(data, limit):
    """The content, at most `limit` bytes, of the frame that `data` is."""
    size, at = content_size(data)
    require(size <= limit, "zstd content is above its limit")
    frame, last = Frame(), 0
    while not last:
        head = little(data[at:at + 3])
        require(at + 3 <= len(data), "zstd: a block is cut")
        last, kind, block = head & 1, head >> 1 & 3, head >> 3
        at += 3
        taken = 1 if kind == 1 else block
        require(kind < 3 and block <= BLOCK_MAX and at + taken <= len(data), "zstd: a block is cut or of no kind")
        require(kind == 2 or len(frame.out) + block <= size, "zstd: content is longer than the frame says")
        if kind == 2:
            frame.block(data[at:at + block])
        else:
            frame.out += data[at:at + 1] * block if kind == 1 else data[at:at + block]
        require(len(frame.out) <= size, "zstd: content is longer than the frame says")
        at += taken
    require(len(frame.out) == size, "zstd content is short")
    require(len(data) == at + (4 if data[4] & 4 else 0), "bytes follow the zstd frame")  # a checksum, not looked at
    return bytes(frame.out)
