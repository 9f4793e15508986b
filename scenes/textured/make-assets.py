#!/usr/bin/env python3
"""Makes the textures, the mesh and the sky of textured.xml, from formulas only: python3 make-assets.py

tiles.png   glazed tiles, sRGB, 256 x 256
dents.png   heights for a bump map, grey, 128 x 128
sky.hdr     an evening sky, Radiance RGBE, 128 x 64
knot.ply    a trefoil tube with normals and a colour at each vertex, binary
blade.obj   one leaf, for instances
"""
import math
import struct
import zlib
from pathlib import Path

HERE = Path(__file__).resolve().parent


def write_png(name, width, height, channels, rows):
    """rows: bytes of each row, 8 bits a channel; channels 1 or 3."""
    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", width, height, 8, 0 if channels == 1 else 2, 0, 0, 0)
    data = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 9)
    (HERE / name).write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


def byte(value):
    return max(0, min(255, round(255 * value)))


def tiles(size=256, count=4):
    """Two glazes in turn, a circle on each tile, pale joints."""
    glazes = [((0.10, 0.28, 0.42), (0.92, 0.80, 0.50)), ((0.88, 0.84, 0.74), (0.64, 0.20, 0.14))]
    rows = []
    for y in range(size):
        row = []
        for x in range(size):
            u, v = x * count / size, y * count / size
            fu, fv = u % 1 - 0.5, v % 1 - 0.5
            base, figure = glazes[(int(u) + int(v)) % 2]
            radius = math.hypot(fu, fv)
            petals = 0.30 + 0.08 * math.cos(8 * math.atan2(fv, fu))
            color = figure if radius < petals and not 0.10 < radius < 0.15 else base
            if max(abs(fu), abs(fv)) > 0.47:
                color = (0.70, 0.68, 0.64)
            row += [byte(c) for c in color]
        rows.append(row)
    write_png("tiles.png", size, size, 3, rows)


def dents(size=128):
    """Waves that meet at the borders, so that the texture can be repeated."""
    def height(x, y):
        a, b = 2 * math.pi * x / size, 2 * math.pi * y / size
        return 0.5 + 0.25 * math.sin(4 * a + 1.5 * math.sin(2 * b)) + 0.25 * math.sin(5 * b + 1.2 * math.sin(3 * a))

    write_png("dents.png", size, size, 1, [[byte(height(x, y)) for x in range(size)] for y in range(size)])


def rgbe(color):
    largest = max(color)
    if largest < 1e-32:
        return bytes(4)
    _, exponent = math.frexp(largest)
    scale = 256.0 / 2.0 ** exponent
    return bytes([min(255, int(c * scale)) for c in color] + [exponent + 128])


def sky(width=128, height=64):
    """Row 0 is the zenith; a low sun, a warm horizon, blue above, dark ground."""
    sun_u, sun_v, sun_width = 0.62, 0.36, 0.018
    data = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + f"-Y {height} +X {width}\n".encode()
    for y in range(height):
        v = (y + 0.5) / height
        for x in range(width):
            u = (x + 0.5) / width
            if v < 0.5:
                t = (1 - 2 * v) ** 0.6
                color = [0.95 * (1 - t) + 0.16 * t, 0.62 * (1 - t) + 0.30 * t, 0.42 * (1 - t) + 0.62 * t]
            else:
                color = [0.10, 0.085, 0.07]
            distance = math.hypot((u - sun_u) * 2, v - sun_v)
            glow = 220 * math.exp(-((distance / sun_width) ** 2)) + 1.2 * math.exp(-distance / 0.12)
            data += rgbe([color[0] + glow, color[1] + 0.78 * glow, color[2] + 0.50 * glow])
    (HERE / "sky.hdr").write_bytes(data)


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    length = math.sqrt(sum(c * c for c in a))
    return [c / length for c in a]


def knot(along=120, around=12, thickness=0.24):
    """A tube around the trefoil curve; its frame comes from the curve's tangent and its centre."""
    def curve(t):
        return [math.sin(t) + 2 * math.sin(2 * t), math.cos(t) - 2 * math.cos(2 * t), -math.sin(3 * t)]

    vertices = b""
    for i in range(along):
        t = 2 * math.pi * i / along
        p = [0.33 * c for c in curve(t)]
        tangent = unit([a - b for a, b in zip(curve(t + 1e-4), curve(t - 1e-4))])
        side = unit(cross(tangent, [-math.sin(t), math.cos(t), 2.5]))
        other = cross(tangent, side)
        for j in range(around):
            s = 2 * math.pi * j / around
            n = [math.cos(s) * a + math.sin(s) * b for a, b in zip(side, other)]
            color = [0.5 + 0.42 * math.cos(t + shift + 0.5 * math.sin(s)) for shift in (0.0, 2.1, 4.2)]
            vertices += struct.pack("<9f", *(a + thickness * b for a, b in zip(p, n)), *n, *color)
    faces = b""
    for i in range(along):
        for j in range(around):
            a, b = i * around + j, i * around + (j + 1) % around
            c, d = (i + 1) % along * around + (j + 1) % around, (i + 1) % along * around + j
            faces += struct.pack("<B3iB3i", 3, a, c, b, 3, a, d, c)
    names = ["x", "y", "z", "nx", "ny", "nz", "r", "g", "b"]
    header = "ply\nformat binary_little_endian 1.0\ncomment a trefoil tube with a colour at each vertex\n"
    header += f"element vertex {along * around}\n" + "".join(f"property float {name}\n" for name in names)
    header += f"element face {2 * along * around}\nproperty list uchar int vertex_indices\nend_header\n"
    (HERE / "knot.ply").write_bytes(header.encode() + vertices + faces)


def blade(steps=12):
    """A leaf that bends over: two rows of quads on both sides of a rib."""
    lines = ["# one leaf, root at the origin, growing up and bending towards +x"]
    for i in range(steps + 1):
        t = i / steps
        width = 0.16 * math.sin(math.pi * min(0.98, 0.08 + 0.92 * t)) ** 0.8
        x, y = 0.55 * t * t, 1.1 * t - 0.35 * t * t
        for side in (-1, 0, 1):
            lines.append(f"v {x:.5f} {y + 0.25 * width * abs(side):.5f} {side * width:.5f}")
    for i in range(steps):
        for k in (1, 2):
            a = 3 * i + k
            lines.append(f"f {a} {a + 1} {a + 4} {a + 3}")
    (HERE / "blade.obj").write_text("\n".join(lines) + "\n")


tiles()
dents()
sky()
knot()
blade()
