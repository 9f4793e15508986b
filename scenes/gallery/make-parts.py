#!/usr/bin/env python3
"""Makes the meshes and the textures of the gallery's scenes, from formulas only: python3 make-parts.py

pool-water.ply      the waves of pool.xml, 6 m x 9 m around y = 0
pool-tiles.png      eight by eight tiles of several blues with their joints
tumbler.ply         a fluted glass (cm): outside, rim, and inside down to the water; normals away from the glass
tumbler-wet.ply     its inside below the water, seamless with the former and the next
tumbler-water.ply   the water's surface
ring.ply            a ring that lies on y = 0 (cm)
wood.png            planks
block-face.ply      a face of a glass block in z = 0, 0.19 m wide, normals along +z
vase.ply            a vase (m)
jewel.ply           a round brilliant with its table upwards, as wide as 2, its point at y = 0
cloth.ply           cloth in folds, flat in the middle
"""
import math
import random
import struct
import zlib
from itertools import combinations
from pathlib import Path

HERE = Path(__file__).resolve().parent


# ---- Files ----

def write_ply(name, points, faces):
    header = (f"ply\nformat binary_little_endian 1.0\ncomment made by make-parts.py\nelement vertex {len(points)}\n"
              "property float x\nproperty float y\nproperty float z\n"
              f"element face {len(faces)}\nproperty list uchar ushort vertex_indices\nend_header\n")
    assert len(points) < 65536
    data = b"".join(struct.pack("<3f", *p) for p in points)
    data += b"".join(struct.pack(f"<B{len(f)}H", len(f), *f) for f in faces)
    (HERE / name).write_bytes(header.encode() + data)


def write_png(name, rows, palette):
    """Rows of indices into a palette of sRGB colours."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 3, 0, 0, 0)
    colours = bytes(max(0, min(255, round(v))) for colour in palette for v in colour)
    pixels = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 9)
    (HERE / name).write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"PLTE", colours) + chunk(b"IDAT", pixels) +
                              chunk(b"IEND", b""))


# ---- Surfaces ----

def height_field(width, depth, columns, rows, height):
    """y = height(x, z) over a rectangle around the origin, normals upwards."""
    points = []
    for j in range(rows + 1):
        for i in range(columns + 1):
            x, z = (i / columns - 0.5) * width, (j / rows - 0.5) * depth
            points.append((x, height(x, z), z))
    faces = []
    for j in range(rows):
        for i in range(columns):
            a = j * (columns + 1) + i
            faces.append((a, a + columns + 1, a + columns + 2, a + 1))
    return points, faces


def revolved(profile, steps, radius=lambda r, y, angle: r):
    """A profile of (r, y) turned round the y axis; from the lower pole outwards its normals point outwards."""
    points, rings, faces = [], [], []
    for r, y in profile:
        if r == 0:
            rings.append([len(points)] * steps)
            points.append((0.0, y, 0.0))
            continue
        rings.append(list(range(len(points), len(points) + steps)))
        for k in range(steps):
            angle = 2 * math.pi * k / steps
            at = radius(r, y, angle)
            points.append((at * math.cos(angle), y, at * math.sin(angle)))
    for low, high in zip(rings, rings[1:]):
        for k in range(steps):
            n = (k + 1) % steps
            corners = [low[k], high[k], high[n], low[n]]
            faces.append(tuple(c for i, c in enumerate(corners) if c not in corners[:i]))
    return points, faces


def rounded(points, radius, steps=5):
    """The open polygon with its corners rounded: their radii are those of `radius`, by corner."""
    result = [points[0]]
    for before, corner, after, r in zip(points, points[1:], points[2:], radius):
        ends = []
        for other in (before, after):
            length = math.dist(corner, other)
            t = min(r, 0.5 * length) / length
            ends.append((corner[0] + t * (other[0] - corner[0]), corner[1] + t * (other[1] - corner[1])))
        for k in range(steps + 1):
            t = k / steps
            result.append(tuple((1 - t) ** 2 * ends[0][c] + 2 * t * (1 - t) * corner[c] + t * t * ends[1][c] for c in (0, 1)))
    return result + [points[-1]]


def subdivided(profile, longest):
    result = [profile[0]]
    for a, b in zip(profile, profile[1:]):
        count = max(1, math.ceil(math.dist(a, b) / longest))
        result += [(a[0] + (b[0] - a[0]) * k / count, a[1] + (b[1] - a[1]) * k / count) for k in range(1, count + 1)]
    return result


# ---- The pool ----

# height in m, wave length in m, direction in degrees, phase
WAVES = [(0.014, 1.90, 75, 0.3), (0.011, 1.13, 118, 1.9), (0.0088, 0.74, 34, 4.1), (0.0058, 0.49, 152, 2.6), (0.0028, 0.33, 95, 5.2)]


def waves(x, z):
    y = 0.0
    for height, length, degrees, phase in WAVES:
        k, angle = 2 * math.pi / length, math.radians(degrees)
        y += height * math.sin(k * (x * math.cos(angle) + z * math.sin(angle)) + phase)
    return y


def pool():
    write_ply("pool-water.ply", *height_field(6, 9, 100, 150, waves))
    rng = random.Random(1)
    palette = [(150, 186, 196)] + [(70 + 34 * t, 142 + 36 * t, 172 + 30 * t) for t in (rng.random() for _ in range(48))]
    tiles = [[rng.randrange(1, 49) for _ in range(8)] for _ in range(8)]
    side = 16
    rows = [[0 if min(x % side, y % side) == 0 else tiles[y // side][x // side] for x in range(8 * side)] for y in range(8 * side)]
    write_png("pool-tiles.png", rows, palette)


# ---- The glass of water and the ring ----

def tumbler():
    level = 7.2
    outside = rounded([(0.0, 0.0), (3.0, 0.0), (3.9, 10.5), (3.62, 10.5), (3.35, level)], [0.35, 0.14, 0.14])
    inside = rounded([(3.35, level), (2.75, 1.3), (0.0, 1.15)], [0.5])

    def fluted(r, y, angle):
        if r < 2.5 or y > 6.8 or r < 2.9 + y * 0.9 / 10.5:
            return r
        depth = 0.09 * math.sin(math.pi * max(0.0, min(1.0, (y - 0.3) / 6.5))) ** 0.7
        return r - depth * (0.5 - 0.5 * math.cos(14 * angle)) ** 0.6

    steps = 168
    write_ply("tumbler.ply", *revolved(subdivided(outside, 0.5), steps, fluted))
    write_ply("tumbler-wet.ply", *revolved(subdivided(inside, 0.8), steps))
    write_ply("tumbler-water.ply", *revolved([(3.35, level), (3.2, level - 0.045), (3.0, level - 0.06), (0.0, level - 0.06)], steps))
    section = rounded([(0.96, 0.3), (0.96, 0.0), (1.16, 0.0), (1.16, 0.6), (0.96, 0.6), (0.96, 0.3)], [0.1, 0.25, 0.25, 0.1], 8)
    write_ply("ring.ply", *revolved(section, 160))


def noise_table(rng, size):
    return [[rng.random() for _ in range(size)] for _ in range(size)]


def value_noise(table, x, y):
    size = len(table)
    i, j = math.floor(x), math.floor(y)
    u, v = x - i, y - j
    u, v = u * u * (3 - 2 * u), v * v * (3 - 2 * v)
    a, b = table[j % size][i % size], table[j % size][(i + 1) % size]
    c, d = table[(j + 1) % size][i % size], table[(j + 1) % size][(i + 1) % size]
    return (a * (1 - u) + b * u) * (1 - v) + (c * (1 - u) + d * u) * v


def wood():
    rng = random.Random(5)
    table = noise_table(rng, 64)
    width, height, planks = 512, 512, 4
    shades = [rng.uniform(-0.12, 0.12) for _ in range(planks)]
    palette = [(78 + 110 * t, 44 + 80 * t, 22 + 52 * t) for t in (k / 63 for k in range(64))]
    rows = []
    for y in range(height):
        plank, across = divmod(y * planks / height, 1)
        row = []
        for x in range(width):
            u, v = x / width, across + 7.3 * plank
            bend = value_noise(table, 3 * u + 11 * plank, 3 * v) + 0.4 * value_noise(table, 7 * u, 9 * v)
            rings = 0.5 + 0.5 * math.sin(2 * math.pi * (4 * v + 2.2 * bend))
            fibre = value_noise(table, 9 * u + 31 * plank, 48 * v)
            t = 0.40 + 0.26 * rings + 0.22 * fibre + shades[int(plank)]
            row.append(2 if across < 0.016 else max(0, min(63, round(63 * t))))
        rows.append(row)
    write_png("wood.png", rows, palette)


# ---- The room behind glass blocks ----

def block():
    def face(x, z):
        bulge = -(x * x + z * z) / 5.0
        distance = math.hypot(x + 0.02, z - 0.015)
        return bulge + 0.0007 * math.cos(2 * math.pi * distance / 0.065) + 0.0004 * math.sin(2 * math.pi * (x + 0.6 * z) / 0.047)
    points, faces = height_field(0.19, 0.19, 32, 32, face)
    write_ply("block-face.ply", [(x, -z, y) for x, y, z in points], faces)
    profile = rounded([(0, 0), (0.09, 0), (0.21, 0.28), (0.05, 0.50), (0.085, 0.58), (0.065, 0.56), (0.03, 0.48), (0, 0.4)],
                      [0.03, 0.2, 0.08, 0.02, 0.02, 0.02], 8)
    write_ply("vase.ply", *revolved(profile, 72))


# ---- The jewels ----

def brilliant():
    """The half-spaces n . p <= d of a round brilliant of radius 1 around the y axis, girdle at y = 0."""
    planes = [((0.0, 1.0, 0.0), 0.33)]

    def ring(count, turn, slope_degrees, through):
        """Facets round the axis, inclined so, through the point (radius, height) at their own direction."""
        for k in range(count):
            angle = 2 * math.pi * (k + turn) / count
            s, c = math.sin(math.radians(slope_degrees)), math.cos(math.radians(slope_degrees))
            planes.append(((math.cos(angle) * s, c, math.sin(angle) * s), through[0] * s + through[1] * c))

    ring(8, 0.0, 34.5, (1.0, 0.02))      # bezel
    ring(8, 0.5, 22.0, (0.575, 0.33))    # star
    ring(16, 0.5, 42.0, (0.985, 0.035))  # upper girdle
    ring(32, 0.5, 90.0, (0.99, 0.0))     # girdle
    ring(16, 0.5, 180 - 42.3, (0.985, -0.035))
    ring(8, 0.0, 180 - 40.8, (1.0, -0.02))
    return planes


def polyhedron(planes):
    """The corners and faces of an intersection of half-spaces."""
    def cross(a, b):
        return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])

    def dot(a, b):
        return sum(x * y for x, y in zip(a, b))

    points = []
    for (a, da), (b, db), (c, dc) in combinations(planes, 3):
        bc = cross(b, c)
        det = dot(a, bc)
        if abs(det) < 1e-9:
            continue
        ca, ab = cross(c, a), cross(a, b)
        p = tuple((da * bc[i] + db * ca[i] + dc * ab[i]) / det for i in range(3))
        if all(dot(n, p) <= d + 1e-7 for n, d in planes) and all(math.dist(p, q) > 1e-5 for q in points):
            points.append(p)
    faces = []
    for n, d in planes:
        face = [i for i, p in enumerate(points) if abs(dot(n, p) - d) < 1e-6]
        if len(face) < 3:
            continue
        middle = tuple(sum(points[i][k] for i in face) / len(face) for k in range(3))
        u = tuple(points[face[0]][k] - middle[k] for k in range(3))
        v = cross(n, u)
        face.sort(key=lambda i: math.atan2(dot(v, [points[i][k] - middle[k] for k in range(3)]),
                                           dot(u, [points[i][k] - middle[k] for k in range(3)])))
        faces.append(tuple(face))
    return points, faces


def jewels():
    points, faces = polyhedron(brilliant())
    lowest = min(p[1] for p in points)
    corners, flat = [], []  # each face with corners of its own: its shading is flat
    for face in faces:
        flat.append(tuple(range(len(corners), len(corners) + len(face))))
        corners += [(points[i][0], points[i][1] - lowest, points[i][2]) for i in face]
    write_ply("jewel.ply", corners, flat)
    table = noise_table(random.Random(9), 32)

    def folds(x, z):
        away = max(0.0, min(1.0, (math.hypot(x, 0.9 * z) - 2.6) / 3.0))
        away = away * away * (3 - 2 * away)
        crest = value_noise(table, 0.35 * x + 0.22 * z + 3, 0.10 * x - 0.16 * z + 5)
        return away * (1.5 * math.sin(2 * math.pi * (0.09 * x + 0.13 * z + 1.6 * crest)) * 0.45 + 0.25) + \
            0.012 * value_noise(table, 1.3 * x, 1.3 * z)
    write_ply("cloth.ply", *height_field(18, 18, 110, 110, folds))


if __name__ == "__main__":
    pool()
    tumbler()
    wood()
    block()
    jewels()
