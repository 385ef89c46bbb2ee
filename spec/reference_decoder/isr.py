#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A second reader of the container: written from spec/container.md alone, to test that text and to explain it.
Numbers such as (4.3) name sections of spec/container.md; bytes become surfaces in decode.py.

usage: isr.py FILE [FRAME] [--track ID]    prints what the file holds, or counts and hash of the surface of one frame, found by the
                                           index with as few reads as can be: they are counted"""

import json
import struct
import sys
from math import isfinite
from pathlib import Path

sys.dont_write_bytecode = True
from decode import Decoder, crc32c, summary  # noqa: E402
from entropy import MASK64, Refused, require  # noqa: E402
from fields import Fields  # noqa: E402
from zstd import decompress  # noqa: E402

MAGIC = bytes([0x89, 0x49, 0x53, 0x52, 0x0D, 0x0A, 0x1A, 0x0A])
SYNC = bytes([0xE5, 0x97, 0xC3, 0x9A])
SIGNATURE, CHUNK, FOOTER, TAIL = 32, 24, 64, 65536
LIMITS = {b"FRAM": (1 << 28) + (1 << 21), b"INDX": (1 << 28) + (1 << 21), b"TRAK": 1 << 17, b"TAGS": 1 << 21, b"CHAP": 1 << 21,
          b"ATCH": 1 << 21, b"FOOT": 40}  # payloads (10)
TEXT_DAMAGE = [b"\x89ISR\n", b"\x89ISR\r\r\n", b"\x89ISR\r\n\x1a\r\n", b"\x89ISR\r\r\x1a", b"\x89ISR\r\x1a", b"\x09ISR",
               b"\xc2\x89ISR", b"\xef\xbf\xbdISR"]


class Source:
    """The bytes of a file; reads are counted."""

    def __init__(self, data):
        self.data, self.size, self.reads, self.bytes = data, len(data), 0, 0

    def read(self, offset, count):
        require(0 <= offset <= self.size and 0 <= count <= self.size - offset, "the file ends inside what is listed")
        self.reads, self.bytes = self.reads + 1, self.bytes + count
        return self.data[offset:offset + count]


class Unsupported(Refused):
    """A version that this reader does not know: final, no scan helps (9.1)."""


def check_version(version):
    if version > 1:
        raise Unsupported(f"version {version} is not known")
    require(version == 1, "version 0 is not defined")


# ---- 1 to 4: fields, chunks, frames ----------------------------------------------------------------------------------------


def sized(fields):
    """notation 2.2: the structure's fields; what is left of them is skipped."""
    return Fields(fields.take(fields.varint(0, MASK64)))


def text(fields, limit):
    return fields.take(fields.varint(0, limit)).decode(errors="replace")


def f32(fields):
    value = struct.unpack("<f", fields.take(4))[0]
    require(isfinite(value), "a number is not finite")
    return value


def chunk_at(data, at):
    """Type, payload and end of the chunk that stands at `at` (3.1)."""
    head = data[at:at + 20]
    require(len(head) == 20, "ends inside a chunk header")
    require(head[:4] == SYNC, "no chunk starts here")
    require(crc32c(head[:16]) == int.from_bytes(head[16:], "little"), "a chunk header's CRC does not match")
    kind, length = head[4:8], int.from_bytes(head[8:16], "little")
    require(length <= len(data) - at - CHUNK, "ends inside a chunk")
    return kind, data[at + 20:at + 20 + length], at + CHUNK + length


def check_payload(kind, payload, crc):
    require(len(payload) <= LIMITS.get(kind, MASK64), "a payload is above its limit")
    require(crc32c(payload) == int.from_bytes(crc, "little"), "a payload's CRC does not match")


def whole_chunk(data, kind):
    """The payload of the chunk that `data` is."""
    found, payload, end = chunk_at(data, 0)
    require(found == kind and end == len(data), "the chunk is not the one that is listed")
    check_payload(kind, payload, data[end - 4:end])
    return payload


class Header:
    """4.1; `key` is every field, for comparing."""

    def __init__(self, f):
        self.number = f.varint(0, MASK64)
        self.position = f.varint(self.number, MASK64)
        self.time = f.svarint()
        duration = f.varint(0, MASK64)
        kind, self.flags = f.fixed(1, 0, 1), f.varint(0, MASK64)
        self.back = f.varint(0, self.position)
        require((kind == 0) == (self.back == 0), "an I frame, and no other, is its own key")
        self.hidden = self.flags & 1 == 1
        self.key = (self.number, self.position, self.time, duration, kind, self.flags, self.back, f.f64(),
                    *[f.varint() for _ in range(8)], f.f64(), f.f64(), f.varint(), f.svarint())
        self.error = f.fixed(1, 0, 2), f32(f), f32(f)
        self.key += (*self.error, f.fixed(8))


def read_frame(payload):
    """Track, header and packet of a FRAM payload (4.2)."""
    f = Fields(payload)
    track, header = f.varint(0, MASK64), Header(sized(f))
    length = f.varint(1, (1 << 28) - 1)
    require(f.at <= 4096, "too much stands in front of the packet")
    return track, header, f.take(length)


class Order:
    """4.3, for one track."""

    def __init__(self):
        self.last, self.shown_time = None, None

    def due(self):
        return 0 if self.last is None else self.last.number + (not self.last.hidden)

    def take(self, header, holes):
        position = 0 if self.last is None else self.last.position + 1
        if holes:
            require(header.number >= self.due() and header.position >= position, "a frame comes again or too early")
        else:
            require(header.number == self.due() and header.position == position, "a number or position is not the one that is due")
            follows = self.last is not None and header.back == self.last.back + 1
            require(follows or (header.back == 0 and not (self.last and self.last.hidden)), "the packet before is not of its GOP")
        if not header.hidden:
            require(self.shown_time is None or header.time > self.shown_time, "a time does not rise")
            self.shown_time = header.time
        self.last = header


# ---- 5 and 6: tracks and what is not frames ---------------------------------------------------------------------------------


class Track:
    def __init__(self, ident, name=""):
        self.id, self.name, self.entries, self.order = ident, name, [], Order()


def read_track(f):
    ident = f.varint(0, MASK64)
    f.varint(1), f.varint(1)  # time base
    name = text(f, 1024)
    f.take(f.varint(0, 65536))  # configuration: I packets carry it too
    return Track(ident, name)


def read_chapter(f):
    kind, start, length = f.fixed(1, 0, 1), f.svarint(), f.varint(0, MASK64)
    return {"kind": kind, "start": start, "length": length, "title": text(f, 4096)}


def read_chapters(payload):
    f = Fields(decompress(payload, 1 << 20))
    return [read_chapter(sized(f)) for _ in range(f.varint(0, 65536))]


def check_name(name):
    require(name not in ("", ".", "..") and not any(c in "/\\\x7f" or c < " " for c in name), "not a plain file name")


def read_part(payload):
    """Name, number, flags, media type and content of an ATCH payload (6.3)."""
    f = Fields(payload)
    head = sized(f)
    part = text(head, 1024), head.varint(), head.varint(0, MASK64), text(head, 256)
    check_name(part[0])
    return (*part, b"" if part[2] & 2 else decompress(payload[f.at:], 1 << 20))


class Contents:
    """What a file holds, however it was found."""

    def __init__(self):
        self.indexed, self.tags, self.chapters, self.tracks, self.damage = False, "{}", [], {}, []
        self.attachments, self.open = [], None  # open: the attachment whose parts are coming

    def take_part(self, payload):
        name, number, flags, media, content = read_part(payload)
        due = self.open and self.open["name"] == name and self.open["parts"] == number
        opened, self.open = self.open, None
        if flags & 2:
            self.drop(name)
            return
        require(number == 0 or due, "a part of an attachment, and not the one before it")
        if number == 0:
            opened = {"name": name, "media_type": media, "content": b"", "parts": 0}
        opened["content"] += content
        opened["parts"] += 1
        if flags & 1:
            self.drop(name)
            self.attachments.append(opened)
        else:
            self.open = opened

    def drop(self, name):
        self.attachments = [a for a in self.attachments if a["name"] != name]

    def take_chunk(self, kind, payload):
        """Everything but frames, index and footer."""
        if kind == b"TAGS":
            self.tags = decompress(payload, 1 << 20).decode(errors="replace")
        elif kind == b"CHAP":
            self.chapters = read_chapters(payload)
        elif kind == b"ATCH":
            self.take_part(payload)


# ---- 9 Reading ------------------------------------------------------------------------------------------------------------


def read_signature(data):
    """The UUID, or None when only the CRC is wrong (2.2)."""
    if data[:8] != MAGIC:
        if any(data.startswith(damage) for damage in TEXT_DAMAGE):
            raise Refused("an .isr file damaged by a transfer in text mode")
        raise Refused("not an .isr file")
    require(len(data) == SIGNATURE, "ends inside the signature")
    if crc32c(data[:28]) != int.from_bytes(data[28:], "little"):
        return None
    check_version(data[8])
    return data[12:28]


def read_footer(data, size):
    """Index offset and length, and the UUID (8)."""
    f = Fields(whole_chunk(data, b"FOOT"))
    offset, length, total, uuid = f.fixed(8), f.fixed(8), f.fixed(8), f.take(16)
    require(total == size, "the footer is that of a file of another length")
    require(SIGNATURE <= offset <= size - FOOTER and CHUNK <= length <= size - FOOTER - offset, "the index is not in front of its footer")
    return offset, length, uuid


def read_index(payload, offset, size, uuid):
    """7"""
    f = Fields(decompress(payload, min(1 << 28, size + (1 << 21))))
    record, contents = sized(f), Contents()
    version, _, name = record.fixed(1), record.fixed(1), record.take(16)
    check_version(version)
    require(name == uuid, "the index has another UUID than the footer")
    contents.indexed, contents.tags = True, text(record, 1 << 20)
    tracks, chapters = record.varint(1, 256), record.varint(0, 65536)
    attachments, entries = record.varint(0, 4096), record.varint(0, size // 86)
    for _ in range(tracks):
        track = read_track(sized(f))
        require(track.id not in contents.tracks, "two tracks have one id")
        contents.tracks[track.id] = track
    contents.chapters = [read_chapter(sized(f)) for _ in range(chapters)]
    for _ in range(attachments):
        a = sized(f)
        name, media = text(a, 1024), text(a, 256)
        check_name(name)
        a.varint(0, MASK64)  # bytes
        start, length = a.varint(SIGNATURE, offset), a.varint(0, MASK64)
        require(length <= offset - start, "an attachment is not in front of the index")
        contents.attachments.append({"name": name, "media_type": media, "place": (start, length)})
    end = SIGNATURE
    for _ in range(entries):
        track, gap, length = f.varint(0, MASK64), f.varint(0, MASK64), f.varint(86, (1 << 28) + (1 << 21) + 24)
        header = Header(sized(f))
        require(gap <= offset - end and length <= offset - end - gap, "a listed chunk is not in front of the index")
        require(track in contents.tracks, "there is no such track")
        contents.tracks[track].order.take(header, holes=False)
        contents.tracks[track].entries.append((header, end + gap, length))
        end += gap + length
    return contents


def by_index(source):
    """9.1: contents, or None when there is no footer."""
    if source.size < SIGNATURE + FOOTER:
        return None
    start = max(0, source.size - TAIL)
    tail = source.read(start, source.size - start)
    try:
        offset, length, uuid = read_footer(tail[-FOOTER:], source.size)
    except Refused:
        return None
    chunk = tail[offset - start:offset - start + length] if offset >= start else source.read(offset, length)
    return read_index(whole_chunk(chunk, b"INDX"), offset, source.size, uuid)


def by_scan(source):
    """9.2"""
    data, contents, failed, sound = source.read(0, source.size), Contents(), 0, True
    if read_signature(data[:SIGNATURE]) is None:
        contents.damage.append("the signature's CRC does not match")

    def next_marker(after):
        at = data.find(SYNC, after)
        while at >= 0 and (at + 20 > len(data) or crc32c(data[at:at + 16]) != int.from_bytes(data[at + 16:at + 20], "little")):
            at = data.find(SYNC, at + 1)
        return at if at >= 0 else len(data)

    at = SIGNATURE
    while at < len(data):
        good = False
        try:
            kind, payload, end = chunk_at(data, at)
            failed += len(payload)
            check_payload(kind, payload, data[end - 4:end])
            failed, good = failed - len(payload), True
            if kind == b"FRAM":
                ident, header, _ = read_frame(payload)
                track = contents.tracks.get(ident) or Track(ident, None)
                track.order.take(header, holes=True)
                contents.tracks[ident] = track
                track.entries.append((header, at, end - at))
            elif kind == b"TRAK":
                track = read_track(Fields(payload))
                known = contents.tracks.setdefault(track.id, track)
                known.name = track.name if known.name is None else known.name
            else:
                contents.take_chunk(kind, payload)
            sound = True
        except Refused as rule:
            if sound or good:
                contents.damage.append(f"byte {at}: {rule}")
            sound = good
        at = end if good or failed > len(data) else next_marker(at + 1)
    require(contents.tracks, "neither a track record nor a frame is whole")
    contents.damage += [f"track {t.id}: its record is lost" for t in contents.tracks.values() if t.name is None]
    return contents


def by_pipe(data):
    """9.3: yields the packets of the first track; Refused where the file is damaged or ends."""
    uuid = read_signature(data[:SIGNATURE])
    require(uuid is not None, "the signature's CRC does not match")
    contents, at, index, last = Contents(), SIGNATURE, None, None
    while at < len(data):
        kind, payload, end = chunk_at(data, at)
        check_payload(kind, payload, data[end - 4:end])
        if kind == b"FRAM":
            ident, header, packet = read_frame(payload)
            require(ident in contents.tracks, "a frame in front of its track's record")
            contents.tracks[ident].order.take(header, holes=False)
            if ident == next(iter(contents.tracks)):
                yield packet
        elif kind == b"TRAK":
            track = read_track(Fields(payload))
            contents.tracks.setdefault(track.id, track)
        elif kind == b"INDX":
            index = (at, end - at)
        elif kind == b"FOOT":
            f = Fields(payload)
            require(((f.fixed(8), f.fixed(8)), f.fixed(8), f.take(16)) == (index, end, uuid), "the footer is wrong")
        else:
            contents.take_chunk(kind, payload)
        at, last = end, kind
    require(last == b"FOOT", "the file ends without a footer")
    require(contents.tracks, "there is no track record")


def open_file(source):
    """9.1, else 9.2."""
    problem = None
    try:
        contents = by_index(source)
    except Unsupported:
        raise
    except Refused as rule:
        contents, problem = None, f"index: {rule}"
    if contents is None:
        contents = by_scan(source)
        contents.damage = ([problem] if problem else []) + contents.damage
    return contents


def packet_of(chunk, track, header):
    """9.1, step 4"""
    ident, found, packet = read_frame(whole_chunk(chunk, b"FRAM"))
    require(ident == track.id and found.key == header.key, "the frame is not the one that is listed")
    return packet


def surfaces(source, track):
    """Header and surface, or Refused, of every packet of a track in order."""
    decoder, before, whole = Decoder(), None, False
    for header, offset, length in track.entries:
        follows = before is not None and (before.position + 1, before.back + 1) == (header.position, header.back)
        whole = header.back == 0 or (whole and follows)  # 4.3
        before = header
        try:
            packet = packet_of(source.read(offset, length), track, header)
            require(whole, "a packet that it needs is missing")
            yield header, decoder.decode(packet)
        except Refused as rule:
            whole = False
            yield header, rule


def surface_of(source, track, number):
    """The surface of one frame: the chunks from its I frame to itself by one read."""
    at = next((i for i, (h, _, _) in enumerate(track.entries) if h.number == number and not h.hidden), None)
    require(at is not None, f"there is no frame {number}")
    run = track.entries[max(0, at - track.entries[at][0].back):at + 1]
    require([h.back for h, _, _ in run] == list(range(len(run))), "a packet that it needs is missing")
    start = run[0][1]
    data = source.read(start, run[-1][1] + run[-1][2] - start)
    decoder = Decoder()
    for header, offset, length in run:
        surface = decoder.decode(packet_of(data[offset - start:offset - start + length], track, header))
    return surface


def attachment(source, listed):
    """Content of an attachment, which the index may have left where it is (7.3)."""
    if "place" not in listed:
        return listed["content"]
    data, contents, at = source.read(*listed["place"]), Contents(), 0
    while at < len(data):
        kind, payload, end = chunk_at(data, at)
        if kind == b"ATCH":
            check_payload(kind, payload, data[end - 4:end])
            contents.take_part(payload)
        at = end
    require([a["name"] for a in contents.attachments] == [listed["name"]], "the attachment is not where it is listed")
    return contents.attachments[0]["content"]


def main(arguments):
    track = int(arguments.pop()) if len(arguments) > 2 and arguments[-2] == "--track" and arguments.pop(-2) else None
    if not 1 <= len(arguments) <= 2:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        source = Source(Path(arguments[0]).read_bytes())
        contents = open_file(source)
        chosen = contents.tracks.get(next(iter(contents.tracks)) if track is None else track)
        require(chosen, f"there is no track {track}")
        if len(arguments) == 2:
            found = summary(surface_of(source, chosen, int(arguments[1])))
        else:
            found = {"indexed": contents.indexed, "tags": contents.tags, "damage": contents.damage,
                     "tracks": {t.id: sum(not h.hidden for h, _, _ in t.entries) for t in contents.tracks.values()}}
        print(json.dumps(found | {"reads": source.reads, "bytes_read": source.bytes, "of": source.size}))
    except Refused as rule:
        print(f"{arguments[0]}: {rule}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
