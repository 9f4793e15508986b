#!/usr/bin/env python3
"""SSIM and FLIP of `caustica compare` against independent implementations: scikit-image's structural_similarity and NVIDIA's
flip-evaluator.

    check-metrics.py pairs PROGRAM FOLDER   renders pairs with PROGRAM into FOLDER, compares every number, and the mean
                                            of the differences between the maps; exit status 1 where one is off by more
                                            than 1e-4
    check-metrics.py recorded               prints the numbers that tests/support/metric_pictures.c records

Needs numpy, scikit-image, flip-evaluator and OpenEXR: scripts/check-metrics.sh makes a Python that has them.
"""
import importlib.metadata
import json
import os
import subprocess
import sys

import flip_evaluator
import numpy as np
import OpenEXR
from skimage.metrics import structural_similarity

TOLERANCE = 1e-4


# ---- The independent implementations ------------------------------------------------------------------------------

def srgb(linear):
    x = np.clip(linear.astype(np.float64), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def ssim(image, reference, sigma=1.5, data_range=1.0, exposure=0.0):
    """Number and map, of the sRGB signals."""
    scale = 2.0 ** exposure
    number, full = structural_similarity(
        srgb(image * scale), srgb(reference * scale), gaussian_weights=True, sigma=sigma, use_sample_covariance=False,
        data_range=data_range, channel_axis=2, full=True)
    return number, full.mean(axis=2)


def flip_ldr(image, reference, exposure=0.0, **parameters):
    """Mean and map, of what a display shows: linear values times 2^exposure, clipped."""
    shown = [np.clip(p * np.float32(2.0 ** exposure), 0, 1).astype(np.float32) for p in (reference, image)]
    flip_map, _, _ = flip_evaluator.evaluate(shown[0], shown[1], "LDR", inputsRGB=False, applyMagma=False,
                                             computeMeanError=False, parameters=parameters)
    flip_map = np.asarray(flip_map, np.float64).reshape(image.shape[:2])
    return flip_map.mean(), flip_map


def flip_hdr(image, reference, **parameters):
    """Mean, map and the exposures."""
    flip_map, _, used = flip_evaluator.evaluate(reference.copy(), image.copy(), "HDR", inputsRGB=False,
                                                applyMagma=False, computeMeanError=False, parameters=parameters)
    flip_map = np.asarray(flip_map, np.float64).reshape(image.shape[:2])
    return flip_map.mean(), flip_map, (used["startExposure"], used["stopExposure"], used["numExposures"])


# ---- Pictures by formula, the same as in tests/support/metric_pictures.c ------------------------------------------

WIDTH, HEIGHT = 64, 48
KINDS = ("noise", "shift", "colours", "firefly", "bright")


def hashed(x, y, c):
    """In [0, 1], different from pixel to pixel."""
    h = (x * 73856093 ^ y * 19349663 ^ c * 83492791) & 0xFFFFFFFF
    h ^= h >> 13
    h = h * 1540483477 & 0xFFFFFFFF
    h ^= h >> 15
    return (h & 1023) / 1023.0


def base(x, y, c):
    if c == 0:
        return x / 63.0
    if c == 1:
        return y / 47.0
    return 0.75 if (x // 8 + y // 8) % 2 == 1 else 0.25


def reference_value(kind, x, y, c):
    b = base(x, y, c)
    return b * b * 2.0 ** (x // 8 - 3) if kind == "bright" else b


def image_value(kind, x, y, c):
    r = reference_value(kind, x, y, c)
    if kind == "noise":
        return 0.875 * r + 0.125 * hashed(x, y, c)
    if kind == "shift":
        return base(x + 1 if x < 63 else 63, y, c)
    if kind == "colours":
        return base(x, y, (c + 1) % 3)
    if kind == "firefly":
        return 50.0 if (x, y) == (20, 17) else r
    return r * (0.5 + hashed(x, y, c))


def picture(value, kind):
    return np.array([[[value(kind, x, y, c) for c in range(3)] for x in range(WIDTH)] for y in range(HEIGHT)]).astype(
        np.float32)


def print_recorded():
    print("scikit-image", importlib.metadata.version("scikit-image"), "flip-evaluator",
          importlib.metadata.version("flip-evaluator"))
    for kind in KINDS:
        image, reference = picture(image_value, kind), picture(reference_value, kind)
        s, s_map = ssim(image, reference)
        ldr, ldr_map = flip_ldr(image, reference)
        hdr, hdr_map, exposures = flip_hdr(image, reference)
        at = ((0, 0), (17, 20), (30, 41))
        print(kind)
        print("  ssim %.8f at %s" % (s, ["%.7f" % s_map[p] for p in at]))
        print("  ldr  %.8f at %s" % (ldr, ["%.7f" % ldr_map[p] for p in at]))
        print("  hdr  %.8f at %s, %.7f to %.7f, %d" % (hdr, ["%.7f" % hdr_map[p] for p in at], *exposures))
    image, reference = picture(image_value, "bright"), picture(reference_value, "bright")
    print("bright, other settings")
    print("  ssim sigma 2, window 15, range 2 %.8f" % ssim(image, reference, sigma=2.0, data_range=2.0)[0])
    print("  ssim sigma 0.8, window 7, exposure -2 %.8f" % ssim(image, reference, sigma=0.8, exposure=-2)[0])
    for ppd in (20.0, 120.0):
        print("  ldr %g pixels per degree %.8f" % (ppd, flip_ldr(image, reference, ppd=ppd)[0]))
    print("  ldr exposure 1 %.8f" % flip_ldr(image, reference, exposure=1.0)[0])
    for tone in ("hable", "reinhard"):
        hdr, _, exposures = flip_hdr(image, reference, tonemapper=tone)
        print("  hdr %s %.8f, %.7f to %.7f, %d" % (tone, hdr, *exposures))
    hdr, _, exposures = flip_hdr(image, reference, startExposure=-3.0, stopExposure=1.0, numExposures=3)
    print("  hdr -3 to 1, 3: %.8f" % hdr)


# ---- Pairs of renders ---------------------------------------------------------------------------------------------

SCENES = "scenes/"
# name, scene, words of the image's render, of the reference's, settings of both metrics that are not the defaults
RENDERS = [
    ("cornell-4", "cornell-box/cornell-box.xml", ["--spp=4"], ["--spp=64", "--seed=9"], {}),
    ("cornell-bdpt", "cornell-box/cornell-box.xml", ["--spp=16", "-i", "bdpt"], ["--spp=64", "--seed=9"], {}),
    ("caustics-path", "caustics/caustics.xml", ["--spp=8", "-i", "path"], ["--spp=16", "-i", "vcm"], {}),
    ("caustics-ppm", "caustics/caustics.xml", ["--spp=4", "-i", "ppm"], ["--spp=16", "-i", "vcm"], {"tone": "hable"}),
    ("furnace", "furnace/furnace.xml", ["--spp=4"], ["--spp=64"], {"ppd": 30.0}),
    ("mis", "mis/mis.xml", ["--spp=2"], ["--spp=64"], {"tone": "reinhard"}),
    ("textured", "textured/textured.xml", ["--spp=2"], ["--spp=32"], {"exposure": 1.0}),
    ("rough-glass", "rough-glass/rough-glass.xml", ["--spp=8"], ["--spp=64"], {"start": -2.0, "stop": 3.0, "count": 4}),
    ("study", "perceptual-study/visible-mixed.xml", ["--spp=8"], ["--spp=32", "-i", "bdpt"], {"exposure": -1.0}),
    ("depth-of-field", "depth-of-field/depth-of-field.xml", ["--spp=4"], ["--spp=32"], {"sigma": 2.0, "window": 15}),
]


def run(words):
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit("%s\n%s" % (" ".join(words), done.stderr))


def read_pfm(path):
    with open(path, "rb") as file:
        assert file.readline().strip() == b"PF"
        width, height = map(int, file.readline().split())
        order = "<f4" if float(file.readline()) < 0 else ">f4"
        data = np.frombuffer(file.read(), order).reshape(height, width, 3)
    return np.ascontiguousarray(data[::-1]).astype(np.float32)


def render(program, folder, name, scene, words):
    path = os.path.join(folder, name + ".pfm")
    run([program, "render", SCENES + scene, "-o", path, "-o", path[:-4] + ".png", "--quiet", "--resolution=160x120"] +
        words)
    return path


def compare_words(settings):
    names = {"tone": "--flip-tone=%s", "ppd": "--flip-ppd=%g", "exposure": "--exposure=%g", "start": "--flip-start=%g",
             "stop": "--flip-stop=%g", "count": "--flip-exposures=%d", "sigma": "--ssim-sigma=%g",
             "window": "--ssim-window=%d"}
    return [names[key] % value for key, value in settings.items()]


def ours(program, image, reference, settings, kinds):
    """Number and map of each metric."""
    stats, maps = image + ".json", image + ".maps.exr"
    run([program, "compare", image, "--reference", reference, "--stats", stats, "--maps", maps, "--flip", kinds] +
        compare_words(settings))
    layers = OpenEXR.File(maps, separate_channels=True).channels()
    with open(stats) as file:
        numbers = json.load(file)["images"][0]
    names = {"ssim": "SSIM", "flip_ldr": "FLIP.LDR", "flip_hdr": "FLIP.HDR"}
    return {key: (numbers[key], layers[name].pixels) for key, name in names.items() if name in layers}


def theirs(image, reference, settings):
    ppd = {"ppd": settings["ppd"]} if "ppd" in settings else {}
    names = {"tone": "tonemapper", "start": "startExposure", "stop": "stopExposure", "count": "numExposures"}
    hdr = {names[key]: value for key, value in settings.items() if key in names}
    exposure = settings.get("exposure", 0.0)
    return {"ssim": ssim(image, reference, sigma=settings.get("sigma", 1.5), exposure=exposure),
            "flip_ldr": flip_ldr(image, reference, exposure=exposure, **ppd),
            "flip_hdr": flip_hdr(image, reference, **ppd, **hdr)[:2]}


def png(path):
    from skimage.io import imread
    codes = imread(path)[:, :, :3].astype(np.float64) / 255.0
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4).astype(np.float32)


def check_pairs(program, folder):
    worst = 0.0
    print("%-20s %-8s %9s %9s %8s %9s" % ("pair", "metric", "caustica", "package", "apart", "maps"))
    for name, scene, words, reference_words, settings in RENDERS:
        image = render(program, folder, name, scene, words)
        reference = render(program, folder, name + "-reference", scene, reference_words)
        rows = [(name, image, reference, settings, "both", read_pfm)]
        if "exposure" not in settings:  # what 8 bit pictures show is compared as it is
            rows.append((name + ".png", image[:-4] + ".png", reference[:-4] + ".png",
                         {k: v for k, v in settings.items() if k in ("ppd", "sigma", "window")}, "ldr", png))
        for row, a, b, own, kinds, read in rows:
            measured, expected = ours(program, a, b, own, kinds), theirs(read(a), read(b), own)
            for metric, (number, pixels) in measured.items():
                value, expected_pixels = expected[metric]
                apart = abs(number - value)
                maps_apart = np.abs(pixels.astype(np.float64) - expected_pixels).mean()
                worst = max(worst, apart, maps_apart)
                print("%-20s %-8s %9.6f %9.6f %8.0e %8.0e%s" % (row, metric, number, value, apart, maps_apart,
                      "" if max(apart, maps_apart) <= TOLERANCE else "  TOO MUCH"))
    print("largest difference %.1e, allowed %.0e" % (worst, TOLERANCE))
    return 0 if worst <= TOLERANCE else 1


if __name__ == "__main__":
    if sys.argv[1:] == ["recorded"]:
        print_recorded()
    elif len(sys.argv) == 4 and sys.argv[1] == "pairs":
        sys.exit(check_pairs(sys.argv[2], sys.argv[3]))
    else:
        sys.exit(__doc__)
