#!/usr/bin/env python3
"""Makes water.obj for water-caustic.xml, from a formula only: python3 make-water.py

A surface of 4 m x 4 m around y = 0, a sum of waves of several directions, with their normals at the vertices.
"""
import math
from pathlib import Path

SIDE, CELLS = 4.0, 64
# height in m, wave length in m, direction in degrees, phase
WAVES = [(0.017, 1.10, 12, 0.3), (0.012, 0.73, 71, 1.9), (0.008, 0.52, -38, 4.1), (0.005, 0.37, 118, 2.6), (0.003, 0.27, 33, 5.2)]


def wave(x, z):
    """Height and its two derivatives."""
    y = dx = dz = 0.0
    for height, length, degrees, phase in WAVES:
        k = 2 * math.pi / length
        kx, kz = k * math.cos(math.radians(degrees)), k * math.sin(math.radians(degrees))
        y += height * math.sin(kx * x + kz * z + phase)
        slope = height * math.cos(kx * x + kz * z + phase)
        dx += kx * slope
        dz += kz * slope
    return y, dx, dz


def main():
    lines = ["# made by make-water.py"]
    places, normals = [], []
    for j in range(CELLS + 1):
        for i in range(CELLS + 1):
            x, z = (i / CELLS - 0.5) * SIDE, (j / CELLS - 0.5) * SIDE
            y, dx, dz = wave(x, z)
            norm = math.sqrt(1 + dx * dx + dz * dz)
            places.append(f"v {x:.4f} {y:.5f} {z:.4f}")
            normals.append(f"vn {-dx / norm:.4f} {1 / norm:.4f} {-dz / norm:.4f}")
    lines += places + normals
    for j in range(CELLS):
        for i in range(CELLS):
            a = j * (CELLS + 1) + i + 1
            b, c, d = a + 1, a + CELLS + 2, a + CELLS + 1
            lines.append(f"f {a}//{a} {d}//{d} {c}//{c} {b}//{b}")
    (Path(__file__).resolve().parent / "water.obj").write_text("\n".join(lines) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
