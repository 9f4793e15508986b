"""Reads what caustica writes: scan lines of 32 bit floats (or halves), ZIP compression. Written from the OpenEXR file layout."""

import struct
import zlib


def read(path):
    """(width, height, {channel: values in row order})."""
    with open(path, "rb") as file:
        data = file.read()
    assert struct.unpack_from("<I", data)[0] == 20000630
    at = 8
    attributes = {}
    while data[at]:
        end = data.index(0, at)
        name, start = data[at:end].decode(), data.index(0, end + 1) + 1
        size = struct.unpack_from("<i", data, start)[0]
        attributes[name] = data[start + 4:start + 4 + size]
        at = start + 4 + size
    at += 1
    assert attributes["compression"][0] in (2, 3)  # ZIP of one line or of 16
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    lines = 16 if attributes["compression"][0] == 3 else 1
    channels, place, table = [], 0, attributes["channels"]
    while table[place]:
        end = table.index(0, place)
        channels.append((table[place:end].decode(), struct.unpack_from("<i", table, end + 1)[0]))
        place = end + 17
    values = {name: [] for name, _ in channels}
    for offset in struct.unpack_from(f"<{-(-height // lines)}Q", data, at):
        y, size = struct.unpack_from("<2i", data, offset)
        rows = min(lines, y1 + 1 - y)
        length = rows * width * sum(2 if kind == 1 else 4 for _, kind in channels)
        _unpack(data[offset + 8:offset + 8 + size], length, rows, width, channels, values)
    return width, height, values


def _unpack(packed, length, rows, width, channels, values):
    raw = bytearray(packed)
    if len(packed) < length:  # else stored as it is
        raw = bytearray(zlib.decompress(packed))
        for i in range(1, len(raw)):
            raw[i] = (raw[i - 1] + raw[i] - 128) & 255
        half = (len(raw) + 1) // 2
        merged = bytearray(len(raw))
        merged[0::2], merged[1::2] = raw[:half], raw[half:]
        raw = merged
    place = 0
    for _ in range(rows):
        for name, kind in channels:
            values[name] += struct.unpack_from(f"<{width}{'e' if kind == 1 else 'f'}", raw, place)
            place += width * (2 if kind == 1 else 4)
