#!/usr/bin/env python3
"""The Python snippets of Mitsuba's plugin reference, as they stand, in Caustica and in Mitsuba.

  PYTHONPATH=FOLDER python3 scripts/check-snippets.py SOURCES [PLUGIN...]

FOLDER holds the package where it is not installed: `pip install --no-deps --target FOLDER build/python/*.whl`. SOURCES is a
checkout of github.com/mitsuba-renderer/mitsuba3: the reference is made of the comments /**! ... */ of its plugins,
src/*/PLUGIN.cpp. A snippet is the inside of a dictionary, an object or a scene's entries. Each is put into a small scene,
loaded and rendered by both modules; nothing of its text is changed, `mi` is the one or the other. Files that it names are
made: pictures of two colours, a cube, a spectrum. A line a snippet: "equal" with both means of the picture (of light, in
red, green and blue); "differs"; the error of Caustica; or why Mitsuba cannot run it either. Needs mitsuba 3.9.1 and cffi
beside NumPy. Exit status 1 where a snippet differs or is an error."""
import os
import pathlib
import re
import sys
import tempfile
import textwrap

import mitsuba
import numpy as np

import caustica

#: Samples a pixel, and what the means of two pictures of them may differ by: noise of some tenths of a percent, and of the
#: brightest snippets a percent.
SAMPLES, TOLERANCE = 256, 0.03

CUBE = """v -1 -1 -1
v 1 -1 -1
v 1 1 -1
v -1 1 -1
v -1 -1 1
v 1 -1 1
v 1 1 1
v -1 1 1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 1/1 4/2 3/3 2/4
f 5/1 6/2 7/3 8/4
f 1/1 2/2 6/3 5/4
f 4/1 8/2 7/3 3/4
f 1/1 5/2 8/3 4/4
f 2/1 3/2 7/3 6/4
"""


def snippets(path):
    """The code of the reference's Python tabs in a plugin's source."""
    for comment in re.findall(r"/\*\*!(.*?)\*/", path.read_text(), re.S):
        lines = comment.split("\n")
        for first, line in enumerate(lines):
            if not re.match(r"\s*\.\. code-tab:: python", line):
                continue
            indent = len(line) - len(line.lstrip())
            end = first + 1
            while end < len(lines) and (not lines[end].strip() or len(lines[end]) - len(lines[end].lstrip()) > indent):
                end += 1
            yield textwrap.dedent("\n".join(lines[first + 1:end])).strip()


def make_files(value):
    """Makes the files that a dictionary names, in the current folder."""
    for key, inner in value.items():
        if isinstance(inner, dict):
            make_files(inner)
        elif key in ("filename", "normalmap") and isinstance(inner, str):
            path = pathlib.Path(inner)
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.suffix == ".obj":
                path.write_text(CUBE)
            elif path.suffix == ".ply":
                mitsuba.load_dict({"type": "cube"}).write_ply(inner)
            elif path.suffix in (".exr", ".png", ".jpg", ".jpeg", ".hdr"):
                write_picture(path)
            elif path.suffix == ".spd":
                path.write_text("400 1.4\n550 0.7\n700 0.2\n")


def write_picture(path):
    rows, columns = np.mgrid[0:16, 0:32]
    picture = np.empty((16, 32, 3), np.float32)
    picture[:] = np.where(((rows // 4 + columns // 4) % 2)[..., None] == 0, [0.6, 0.4, 0.3], [0.4, 0.55, 0.8])
    bitmap = mitsuba.Bitmap(picture)
    if path.suffix not in (".exr", ".hdr"):
        bitmap = bitmap.convert(mitsuba.Bitmap.PixelFormat.RGB, mitsuba.Struct.Type.UInt8, True)
    bitmap.write(str(path))


def scene(mi, kind, inside):
    """The scene that shows a snippet of a plugin of a kind (the name of its folder)."""
    place = mi.ScalarTransform4f()
    whole = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 6},
        "sensor": {
            "type": "perspective", "fov": 45,
            "to_world": place.look_at(origin=[0.5, 1.5, 7], target=[0, 0, 0], up=[0, 1, 0]),
            "film": {"type": "hdrfilm", "width": 32, "height": 24, "rfilter": {"type": "box"}},
        },
        "sky": {"type": "constant", "radiance": 0.5},
        "lamp": {"type": "point", "position": [2, 5, 4], "intensity": 30.0},
        "floor": {"type": "rectangle", "to_world": place.translate([0, -1.5, 0]).rotate([1, 0, 0], -90).scale(6)},
        "ball": {"type": "sphere"},
    }
    ball = whole["ball"]
    if inside.get("type") == "scene":
        return whole | inside
    if "type" not in inside:
        if kind in ("shapes", "emitters"):
            del whole["ball"]
        if kind in ("textures", "spectra"):
            ball["bsdf"] = {"type": "diffuse"} | inside
            return whole
        if kind == "bsdfs":
            for name in inside:
                ball["bsdf"] = {"type": "ref", "id": name}
        return whole | inside
    if kind == "shapes":
        whole["ball"] = inside
    elif kind == "bsdfs":
        ball["bsdf"] = inside
    elif kind in ("textures", "spectra"):
        ball["bsdf"] = {"type": "diffuse", "reflectance": inside}
    elif kind == "emitters" and inside["type"] in ("area", "directionalarea"):
        ball["emitter"] = inside
    elif "emitter" in inside:
        whole["ball"] = inside
    elif kind == "emitters":
        whole["lamp"] = inside
        if inside["type"] in ("envmap", "constant", "sunsky"):
            del whole["sky"]
    elif kind == "sensors":
        whole["sensor"] = {"film": whole["sensor"]["film"]} | inside
    elif kind == "films":
        whole["sensor"]["film"] = inside
    elif kind == "rfilters":
        whole["sensor"]["film"]["rfilter"] = inside
    elif kind == "samplers":
        whole["sensor"]["sampler"] = inside
    else:
        whole["integrator"] = inside
    return whole


def mean(mi, kind, text):
    """Of red, green and blue of the picture, by the module `mi`."""
    inside = eval("{\n%s\n}" % text, {"mi": mi, "mitsuba": mi})
    make_files(inside)
    picture = np.array(mi.render(mi.load_dict(scene(mi, kind, inside)), spp=SAMPLES))
    return picture[:, :, :3].astype(np.float64).mean(axis=(0, 1))


def first_line(error):
    return " ".join(str(error).split())[:110]


def judge(kind, text):
    """("equal", "differs", "error" or "left out") and what to print."""
    try:
        theirs = mean(mitsuba, kind, text)
    except Exception as error:
        return "left out", "not by Mitsuba either: " + first_line(error)
    try:
        ours = mean(caustica, kind, text)
    except Exception as error:
        return "error", first_line(error)
    equal = theirs.shape == ours.shape and np.allclose(ours, theirs, rtol=TOLERANCE, atol=1e-4)
    return "equal" if equal else "differs", "%s %s" % (np.round(ours, 4), np.round(theirs, 4))


def main():
    mitsuba.set_variant("scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    sources, wanted = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2:]
    counts = {}
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for path in sorted(sources.glob("src/*/*.cpp")):
            if wanted and path.stem not in wanted:
                continue
            for number, text in enumerate(snippets(path), 1):
                verdict, words = judge(path.parent.name, text)
                counts[verdict] = counts.get(verdict, 0) + 1
                print("%-9s %-28s %s" % (verdict, "%s/%s %d" % (path.parent.name, path.stem, number), words), flush=True)
    print(", ".join("%d %s" % (count, verdict) for verdict, count in sorted(counts.items())))
    sys.exit(1 if counts.get("differs") or counts.get("error") else 0)


if __name__ == "__main__":
    main()
