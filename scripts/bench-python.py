#!/usr/bin/env python3
"""What a mesh of a million triangles from NumPy costs beside the building of its tree, and what Python adds to a render.

  PYTHONPATH=FOLDER python3 scripts/bench-python.py [RUNS]

FOLDER holds the package where it is not installed: `pip install --no-deps --target FOLDER build/python/*.whl`.

The mesh lies in a shapegroup without instances: all that a scene does with a mesh is done, but no tree is built for it.
Prints a line for each kind of arrays: the least and the median milliseconds of RUNS, and the least of making the Mesh
alone. The line behind them is of a scene that does show the mesh, tree and all: it tells how busy the machine was. The last
lines are renders of 16 x 16 pixels and one sample, by `caustica.render` and by the call of C that it makes."""
import statistics
import sys
import time

import numpy as np

import caustica
from caustica._library import ffi, lib
from caustica._render import _Call

SIDE = 708
RUNS = int(sys.argv[1]) if len(sys.argv) > 1 else 15


def waves():
    """Vertices, faces, normals and uvs of a wavy square of a million triangles."""
    x, z = np.meshgrid(np.linspace(-1, 1, SIDE + 1), np.linspace(-1, 1, SIDE + 1))
    slopes = [-0.9 * np.cos(9 * x) * np.cos(11 * z), np.ones_like(x), 1.1 * np.sin(9 * x) * np.sin(11 * z)]
    normals = np.stack(slopes, 2).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    vertices = np.stack([x, 0.1 * np.sin(9 * x) * np.cos(11 * z), z], 2).reshape(-1, 3)
    corner = (np.arange(SIDE)[:, None] * (SIDE + 1) + np.arange(SIDE)).ravel()
    faces = np.stack([corner, corner + SIDE + 1, corner + SIDE + 2, corner, corner + SIDE + 2, corner + 1], 1)
    return vertices, faces.reshape(-1, 3), normals, np.stack([x, z], 2).reshape(-1, 2)


def strided(array):
    """The same values, in every second column of an array twice as wide."""
    wide = np.zeros((len(array), 2 * array.shape[1]), array.dtype)
    wide[:, ::2] = array
    return wide[:, ::2]


def cases():
    v, f, n, t = waves()
    v4, n4, t4, f4 = v.astype("f4"), n.astype("f4"), t.astype("f4"), f.astype("u4")
    yield "float32, uint32, smooth normals", (v4, f4), {}
    yield "the same, in place", (v4, f4), {"copy": False}
    yield "the same, without normals", (v4, f4), {"face_normals": True}
    yield "float32, uint32, with normals", (v4, f4, n4), {}
    yield "the same and uvs", (v4, f4, n4, t4), {}
    yield "the same, moved", (v4, f4, n4, t4), {"to_world": caustica.ScalarTransform4f().rotate([1, 2, 3], 40)}
    yield "float64, int64, smooth normals", (v, f), {}
    yield "float64, int64, normals, uvs", (v, f, n, t), {}
    yield "columns, smooth normals", (np.asfortranarray(v4), np.asfortranarray(f4)), {}
    yield "every second number, float64, int64", (strided(v), strided(f), strided(n), strided(t)), {}
    yield "shuffled triangles, smooth normals", shuffled(v4, f4), {}


def shuffled(v, f):
    random = np.random.default_rng(1)
    order = random.permutation(len(v)).astype("u4")
    moved = np.empty_like(v)
    moved[order] = v
    return moved, order[random.permutation(f)]


def scene(mesh, shown):
    group = {"type": "shapegroup", "waves": mesh}
    world = {"waves": mesh} if shown else {"group": group}
    return {"type": "scene", "sensor": {"type": "perspective"}, "light": {"type": "constant"}, **world}


def milliseconds(arrays, options, shown=False):
    begun = time.perf_counter()
    mesh = caustica.Mesh(*arrays, **options)
    made = time.perf_counter()
    loaded = caustica.load_dict(scene(mesh, shown))
    ended = time.perf_counter()
    del loaded
    return 1e3 * (ended - begun), 1e3 * (made - begun)


def from_c(loaded):
    """A render whose settings are made already."""
    call, error = _Call(caustica.Settings(spp=1, threads=1), None), ffi.new("ca_error *")
    image = ffi.new("ca_image_layers **")

    def render():
        assert lib.ca_render(loaded._pointer, call.struct, image, ffi.NULL, error) == 0
        lib.ca_image_release(image[0])
    return render


def small_renders(runs):
    film = {"type": "hdrfilm", "width": 16, "height": 16}
    loaded = caustica.load_dict({"type": "scene", "sensor": {"type": "perspective", "film": film}, "ball": {"type": "sphere"},
                                 "integrator": {"type": "path"}, "light": {"type": "constant"}})
    calls = {"16 x 16 pixels by C": from_c(loaded), "the same by Python": lambda: caustica.render(loaded, spp=1, threads=1)}
    took = {name: [] for name in calls}
    for _ in range(runs):
        for name, call in calls.items():
            begun = time.perf_counter()
            call()
            took[name].append(1e3 * (time.perf_counter() - begun))
    for name, times in took.items():
        print(f"{name:38} {min(times):7.3f} {statistics.median(times):7.3f}")


def main():
    print(f"{'arrays':38} {'least':>7} {'median':>7} {'Mesh()':>7}  ms")
    for name, arrays, options in cases():
        whole, made = zip(*(milliseconds(arrays, options) for _ in range(RUNS)))
        print(f"{name:38} {min(whole):7.1f} {statistics.median(whole):7.1f} {min(made):7.1f}", flush=True)
    v, f, n, _ = waves()
    arrays = v.astype("f4"), f.astype("u4"), n.astype("f4")
    whole = [milliseconds(arrays, {}, shown=True)[0] for _ in range(3)]
    print(f"{'shown, with its tree':38} {min(whole):7.1f}")
    small_renders(40 * RUNS)


if __name__ == "__main__":
    main()
