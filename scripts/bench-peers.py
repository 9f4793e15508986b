#!/usr/bin/env python3
"""Caustica's `path` against that of Mitsuba 3 (llvm_ad_rgb): the same scenes, filter, largest depth and sampler, each with its own
default for the roulette, two threads, equal time.

    bench-peers.py PROGRAM FOLDER [--quick] [--only SCENE]

PROGRAM is caustica; scenes and references are kept in FOLDER. For each scene and size both renderers get about the same time for
each seed, in turns, so that what else the machine does meets both. Neither loading nor Mitsuba's compilation of kernels counts: the
same image has been rendered once before, with another seed. The efficiency is 1 / (relMSE x seconds). The ratio of the efficiencies
is printed with its 95 % interval over the seeds, and above 1 where Caustica is better; again without the worst 0.1 % of the pixels,
for a few very bright ones may decide the mean.

The reference is a long render by Caustica; both renderers' means over all seeds must agree with it. Prints a table, and writes
bench/peers.json unless --quick (fewer seeds, less time) or --only (one scene) is given. scripts/bench-peers.sh makes a Python that
has what is needed here."""
import argparse
import hashlib
import json
import math
import os
import platform
import statistics
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree

import numpy as np

import peers_figures as figures

THREADS, DEPTH = 2, 10
LARGE = 512
SECONDS = {128: 0.4, LARGE: 1.2}          # of a render
SEEDS, REFERENCE_SECONDS = 16, 60.0
QUICK_SHARE, QUICK_SEEDS = 0.25, 8        # of all times
REFERENCE_SEED, WARM_SEED = 1000003, 1000033
BLOCKS = 16                               # along each side, for the agreement of means
BLOCK_BIAS, DIFFERING_BLOCKS = 0.03, 0.05 # a block differs; share of them that may: fireflies, models that are not quite equal
IMAGE_BIAS = 0.01
RENDERERS = ("caustica", "mitsuba")

# Name, file, integrator of the reference. Caustics seen directly are rare events for `path` but not for `bdpt`.
SCENES = (
    ("cornell-box", "scenes/cornell-box/cornell-box.xml", "path"),
    ("mirror-and-glass", "scenes/speed/cornell-spheres.xml", "bdpt"),
    ("textured", "scenes/textured/textured.xml", "path"),
    ("million-triangles", None, "path"),
)


def fail(text):
    sys.exit("bench-peers: " + text)


# ---- Scenes -------------------------------------------------------------------------------------------------------

BALLS_XML = """<scene version="3.0.0">
    <integrator type="path"/>
    <sensor type="perspective">
        <float name="fov" value="60"/>
        <transform name="to_world"><lookat origin="0, 0.3, -0.95" target="0, -0.4, 0.2" up="0, 1, 0"/></transform>
        <sampler type="independent"/>
        <film type="hdrfilm"><rfilter type="box"/></film>
    </sensor>
    <bsdf type="diffuse" id="white"><rgb name="reflectance" value="0.7, 0.7, 0.7"/></bsdf>
    <shape type="cube"><boolean name="flip_normals" value="true"/><ref id="white"/></shape>
    <shape type="rectangle">
        <transform name="to_world">
            <rotate x="1" angle="90"/><scale x="0.2" z="0.2"/><translate y="0.99"/>
        </transform>
        <ref id="white"/>
        <emitter type="area"><rgb name="radiance" value="20, 20, 20"/></emitter>
    </shape>
    <shape type="ply">
        <string name="filename" value="balls.ply"/>
        <boolean name="face_normals" value="true"/>
        <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.3, 0.4, 0.8"/></bsdf></bsdf>
    </shape>
</scene>
"""


def write_balls(folder):
    """A room with 256 bumpy balls of 4,096 triangles each, which most rays pass near by."""
    rings, segments, radius = 32, 64, 0.09
    theta, phi = np.meshgrid(np.pi * np.arange(rings + 1) / rings, 2 * np.pi * np.arange(segments) / segments, indexing="ij")
    swell = radius * (1 + 0.1 * np.sin(9 * theta) * np.sin(7 * phi) * np.sin(theta))
    ball = np.stack([swell * np.sin(theta) * np.cos(phi), swell * np.cos(theta), swell * np.sin(theta) * np.sin(phi)], 2)
    i = np.arange(256)
    jitter = 0.04 * np.sin(12.9898 * i)
    centers = np.stack([-0.84 + 0.24 * (i % 8) + jitter, -0.85 + 0.3 * (i // 64) - jitter, -0.6 + 0.21 * (i // 8 % 8) + jitter], 1)
    r, s = np.meshgrid(np.arange(rings) * segments, np.arange(segments), indexing="ij")
    next_s = (s + 1) % segments
    a, b, c, d = r + s, r + next_s, r + segments + s, r + segments + next_s
    faces = np.concatenate([np.stack(t, 2).reshape(-1, 3) for t in ((a, b, c), (b, d, c))])
    positions = (centers[:, None, :] + ball.reshape(1, -1, 3)).reshape(-1, 3)
    corners = (faces[None] + (i * (rings + 1) * segments)[:, None, None]).reshape(-1, 3)
    records = np.zeros(len(corners), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    records["count"], records["corners"] = 3, corners
    with open(os.path.join(folder, "balls.ply"), "wb") as file:
        file.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
                    "element face %d\nproperty list uchar int vertex_indices\nend_header\n"
                    % (len(positions), len(records))).encode())
        file.write(positions.astype("<f4").tobytes())
        file.write(records.tobytes())
    path = os.path.join(folder, "balls.xml")
    with open(path, "w") as file:
        file.write(BALLS_XML)
    return path


def set_property(parent, kind, name, value):
    for child in [c for c in parent if c.get("name") == name]:
        parent.remove(child)
    ElementTree.SubElement(parent, kind, name=name, value=str(value))


def same_for_both(path, size):
    """The scene's text for both renderers: integrator, sampler, filter and size set, file names absolute; and its files."""
    root = ElementTree.parse(path).getroot()
    files = []
    for string in root.iter("string"):
        if string.get("name") == "filename":
            string.set("value", os.path.join(os.path.abspath(os.path.dirname(path)), string.get("value")))
            files.append(string.get("value"))
    integrator = root.find("integrator")
    integrator.clear()
    integrator.set("type", "path")
    set_property(integrator, "integer", "max_depth", DEPTH)
    root.find("sensor/sampler").set("type", "independent")
    film = root.find("sensor/film")
    film.find("rfilter").set("type", "box")
    for side in ("width", "height"):
        set_property(film, "integer", side, size)
    return ElementTree.tostring(root, encoding="unicode"), files


def write_scene(folder, name, path, size):
    """The file's name, and a hash of all that the scene is made of."""
    text, files = same_for_both(path, size)
    written = os.path.join(folder, "%s-%d.xml" % (name, size))
    with open(written, "w") as file:
        file.write(text)
    content = hashlib.sha256(text.encode())
    for used in files:
        with open(used, "rb") as file:
            content.update(file.read())
    return written, content.hexdigest()[:12]


# ---- Images -------------------------------------------------------------------------------------------------------

def read_pfm(path):
    with open(path, "rb") as file:
        if file.readline().strip() != b"PF":
            fail(path + " is no PFM image of three channels")
        width, height = map(int, file.readline().split())
        order = "<f4" if float(file.readline()) < 0 else ">f4"
        return np.frombuffer(file.read(), order).reshape(height, width, 3)[::-1].astype(np.float64)


def write_pfm(path, image):
    with open(path, "wb") as file:
        file.write(b"PF\n%d %d\n-1\n" % (image.shape[1], image.shape[0]))
        file.write(image[::-1].astype("<f4").tobytes())


def averaged(image, size):
    """The image of so many pixels on each side; of box filters it is exact."""
    step = image.shape[0] // size
    return image.reshape(size, step, size, step, 3).mean(axis=(1, 3))


def block_means(image):
    return averaged(image, BLOCKS).mean(axis=2).ravel().tolist()


# ---- Renderers ----------------------------------------------------------------------------------------------------

class Caustica:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def run(self, words):
        done = subprocess.run([self.program] + words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if done.returncode != 0:
            fail("%s %s:\n%s" % (self.program, " ".join(words), done.stdout))

    def load(self, path):
        self.path = path

    def render(self, samples, seed, words=()):
        """Image and seconds, without loading."""
        image, stats = os.path.join(self.folder, "image.pfm"), os.path.join(self.folder, "stats.json")
        limit = ["--spp=%d" % samples] if samples else []
        self.run(["render", self.path, "--quiet", "--seed=%d" % seed, "--threads=%d" % THREADS, "--stats", stats, "-o", image] +
                 limit + list(words))
        with open(stats) as file:
            return read_pfm(image), json.load(file)["seconds"]

    def relmse(self, image, reference):
        """What `caustica compare` says, to check the figures here."""
        paths = [os.path.join(self.folder, name) for name in ("a.pfm", "b.pfm")]
        stats = os.path.join(self.folder, "compare.json")
        write_pfm(paths[0], image)
        write_pfm(paths[1], reference)
        self.run(["compare", paths[0], "--reference", paths[1], "--stats", stats])
        with open(stats) as file:
            return json.load(file)["images"][0]["relmse"]


class Mitsuba:
    def __init__(self):
        import drjit
        import mitsuba
        try:
            mitsuba.set_variant("llvm_ad_rgb")
        except ImportError as error:
            fail("Mitsuba finds no LLVM it can use, DRJIT_LIBLLVM_PATH=%s: %s" % (os.environ.get("DRJIT_LIBLLVM_PATH"), error))
        drjit.set_thread_count(THREADS)
        self.mitsuba = mitsuba
        self.versions = {"mitsuba": mitsuba.__version__, "drjit": drjit.__version__,
                         "llvm": os.path.basename(os.environ.get("DRJIT_LIBLLVM_PATH", "unknown"))}

    def load(self, path):
        self.scene = self.mitsuba.load_file(path)

    def render(self, samples, seed):
        start = time.perf_counter()
        image = np.array(self.mitsuba.render(self.scene, spp=samples, seed=seed))
        return image[:, :, :3].astype(np.float64), time.perf_counter() - start


# ---- Measuring ----------------------------------------------------------------------------------------------------

def reference_of(caustica, name, written, content, integrator, seconds):
    """The long render, made unless it is there already."""
    kept = os.path.join(caustica.folder, "%s-%s-%s-%g.pfm" % (name, content, integrator, seconds))
    if not os.path.exists(kept):
        print("%s: reference, %g s of %s" % (name, seconds, integrator), flush=True)
        caustica.load(written)
        image, _ = caustica.render(None, REFERENCE_SEED, ["--time=%g" % seconds, "-i", integrator])
        write_pfm(kept + ".new", image)
        os.replace(kept + ".new", kept)
    return read_pfm(kept)


def warmed_up(renderer, size, seconds):
    """Samples that take so long. Kernels are compiled before the clock counts, and those for that number of samples as well."""
    samples = 4 if size == LARGE else 32
    renderer.render(samples, WARM_SEED)
    for i in (1, 2):
        samples = figures.samples_for(seconds, samples, renderer.render(samples, WARM_SEED + i)[1])
    renderer.render(samples, WARM_SEED)
    return samples


def run_once(renderer, samples, seed, reference):
    image, seconds = renderer.render(samples, seed)
    errors = figures.relative_square(image, reference).mean(axis=2).ravel()
    return image, {"seed": seed, "seconds": seconds, "relmse": float(errors.mean()),
                   "relmse_trimmed": figures.mean_without_worst(errors.tolist())}


def check_relmse(caustica, image, run, reference):
    other = caustica.relmse(image, reference)
    if not math.isclose(other, run["relmse"], rel_tol=1e-4):
        fail("relMSE is %g here and %g by `caustica compare`" % (run["relmse"], other))


def measure(renderers, size, seconds, seeds, reference):
    """Of each renderer: samples per pixel, runs, block means of each seed."""
    results = {name: {"samples_per_pixel": warmed_up(renderers[name], size, seconds), "runs": []} for name in RENDERERS}
    blocks = {name: [] for name in RENDERERS}
    for seed in range(1, seeds + 1):
        for name in RENDERERS if seed % 2 else RENDERERS[::-1]:
            image, run = run_once(renderers[name], results[name]["samples_per_pixel"], seed, reference)
            if seed == 1:
                check_relmse(renderers["caustica"], image, run, reference)
            blocks[name].append(block_means(image))
            results[name]["runs"].append(run)
    return results, blocks


def summary(results, blocks, reference):
    row = {}
    expected = block_means(reference)
    for name, result in results.items():
        mean, error = figures.relative_bias([float(np.mean(b)) for b in blocks[name]], float(np.mean(expected)))
        row[name] = {"samples_per_pixel": result["samples_per_pixel"], "bias": mean, "bias_standard_error": error,
                     "blocks_that_differ": figures.share_that_differs(blocks[name], expected, BLOCK_BIAS)}
        for key in ("seconds", "relmse", "relmse_trimmed"):
            row[name]["median_" + key] = statistics.median(run[key] for run in result["runs"])
        row[name]["runs"] = result["runs"]
    for key in ("relmse", "relmse_trimmed"):
        row["efficiency_ratio_" + key] = figures.efficiency_ratio(*(results[name]["runs"] for name in RENDERERS), key)
    return row


HEADING = ("scene", "size", "spp", "spp M.", "s", "s M.", "relMSE", "relMSE M.", "efficiency ratio", "without worst 0.1 %",
           "mean off by %", "mean off by %, M.")
WIDTHS = (18, 4, 5, 6, 5, 5, 9, 9, 19, 19, 14, 17)


def print_row(cells):
    print("  ".join(c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in enumerate(zip(cells, WIDTHS))), flush=True)


def print_summary(name, size, row):
    pair = [row[r] for r in RENDERERS]
    print_row([name, str(size)] + [str(r["samples_per_pixel"]) for r in pair] + ["%.2f" % r["median_seconds"] for r in pair] +
              ["%.3g" % r["median_relmse"] for r in pair] +
              ["%.2f [%.2f, %.2f]" % row["efficiency_ratio_" + key] for key in ("relmse", "relmse_trimmed")] +
              ["%+.2f +- %.2f" % (100 * r["bias"], 100 * r["bias_standard_error"]) for r in pair])


def check_agreement(name, size, row):
    for renderer in RENDERERS:
        bias, error, share = (row[renderer][key] for key in ("bias", "bias_standard_error", "blocks_that_differ"))
        if abs(bias) > IMAGE_BIAS + figures.NOISE_BOUND * error or share > DIFFERING_BLOCKS:
            fail("%s, %d: the mean of %s is off the reference by %.2f %%, and in %.0f %% of the blocks by more than %g %%"
                 % (name, size, renderer, 100 * bias, 100 * share, 100 * BLOCK_BIAS))


# ---- Where and what -----------------------------------------------------------------------------------------------

def output_of(words):
    try:
        return subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout.strip()
    except OSError:
        return ""


def processor():
    with open("/proc/cpuinfo") as file:
        names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    return names[0] if names else platform.machine()


def circumstances(program, mitsuba):
    changed = output_of(["git", "status", "--porcelain", "--untracked-files=no", "--", "src", "include", "CMakeLists.txt", "cmake"])
    return {"processor": processor(), "processors": os.cpu_count(), "system": platform.platform(),
            "load_average": os.getloadavg()[0], "caustica": output_of([program, "--version"]),
            "commit": output_of(["git", "rev-parse", "HEAD"]) + (" and changes" if changed else ""),
            **mitsuba.versions, "threads": THREADS, "max_depth": DEPTH, "roulette": "each renderer's default", "filter": "box"}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("--quick", action="store_true", help="fewer seeds and less time; writes no file")
    parser.add_argument("--only", metavar="SCENE", choices=[s[0] for s in SCENES], help="one scene; writes no file")
    return parser.parse_args()


def main():
    args = arguments()
    renderers = {"caustica": Caustica(args.program, args.folder), "mitsuba": Mitsuba()}
    document = {**circumstances(args.program, renderers["mitsuba"]), "scenes": {}}
    share, seeds = (QUICK_SHARE, QUICK_SEEDS) if args.quick else (1.0, SEEDS)
    print("M.: Mitsuba; medians over %d seeds; ratio above 1: Caustica is the better one" % seeds)
    print_row(HEADING)
    for name, path, integrator in SCENES:
        if args.only not in (None, name):
            continue
        path = path or write_balls(args.folder)
        large, content = write_scene(args.folder, name, path, LARGE)
        reference = reference_of(renderers["caustica"], name, large, content, integrator, share * REFERENCE_SECONDS)
        for size, seconds in SECONDS.items():
            written, _ = write_scene(args.folder, name, path, size)
            for renderer in renderers.values():
                renderer.load(written)
            own_reference = averaged(reference, size)
            row = summary(*measure(renderers, size, share * seconds, seeds, own_reference), own_reference)
            print_summary(name, size, row)
            check_agreement(name, size, row)
            document["scenes"].setdefault(name, {})[str(size)] = row
    if not args.quick and not args.only:
        with open("bench/peers.json", "w") as file:
            file.write(json.dumps(document, indent=1) + "\n")
        print("figures: bench/peers.json")


if __name__ == "__main__":
    main()
