"""Renders: the same bits as the program's, arrays that own their picture, errors, callbacks, Ctrl-C."""
import csv
import gc
import math
import os
import pickle
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import caustica
from conftest import description

PROGRAM = os.environ.get("CA_PROGRAM")
TEXT = """<scene version="3.0.0"><integrator type="ovcm"><integer name="max_depth" value="4"/></integrator>
    <sensor type="perspective"><float name="fov" value="40"/><transform name="to_world">
        <lookat origin="0, 1, -4" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film></sensor>
    <shape type="sphere"><bsdf type="dielectric"/></shape>
    <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="4"/><translate y="-1"/></transform>
    </shape><emitter type="point"><point name="position" value="1, 4, -2"/></emitter></scene>"""


@pytest.mark.skipif(not PROGRAM, reason="CA_PROGRAM names no program")
@pytest.mark.parametrize("integrator, settings", [("ovcm", {}), ("path", {"seed": 3}), ("bdpt", {"crop": (3, 2, 20, 12)}), ("ppm", {}),
                                                  ("bdpm", {"light_paths": 200}), ("qmcppm", {}), ("vavcm", {"threads": 3})])
def test_the_bits_of_the_program(tmp_path, integrator, settings):
    file, out = tmp_path / "scene.xml", tmp_path / "out.exr"
    file.write_text(TEXT)
    options = [word for name, value in settings.items()
               for word in ("--" + name.replace("_", "-"), ",".join(map(str, value)) if isinstance(value, tuple) else str(value))]
    subprocess.run([PROGRAM, "render", file, "-i", integrator, "--spp", "4", *options, "-o", out, "--quiet"], check=True)
    theirs = caustica.Image.load(out)
    ours = caustica.render(caustica.load_file(file), spp=4, integrator=integrator, **{"threads": 1, **settings})
    assert len(theirs.channels) > 10 and set(theirs.channels) <= set(ours.channels)
    for name in theirs.channels:
        assert np.array_equal(theirs[name], ours[name], equal_nan=True), name


def test_program_as_a_module():
    done = subprocess.run([sys.executable, "-m", "caustica", "version"], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == f"caustica {caustica.__version__}"
    assert subprocess.run([sys.executable, "-m", "caustica", "rendr"], capture_output=True).returncode == 2


def test_pictures(image):
    assert image.shape == (16, 24) and image.channels[:3] == ["R", "G", "B"] and "Variance.G" in image
    assert np.asarray(image).shape == (16, 24, 3) and np.array_equal(image.rgb[:, :, 1], image["G"])
    assert image.layer("Albedo").shape == (16, 24, 3)
    assert np.asarray(image, dtype=np.float64).dtype == np.float64
    if np.lib.NumpyVersion(np.__version__) >= "2.0.0":
        with pytest.raises(ValueError, match="copy"):
            np.array(image, copy=False)
        bitmap = caustica.Bitmap(image)
        assert np.array(bitmap, copy=False) is bitmap.array and np.array(bitmap) is not bitmap.array
        with pytest.raises(ValueError, match="copy"):
            np.array(bitmap, dtype=np.float64, copy=False)
    assert image.attributes["caustica.integrator"].startswith("path:max_depth=4")
    with pytest.raises(KeyError, match="no channel \"Q\""):
        image["Q"]
    with pytest.raises(ValueError):
        image["G"][0, 0] = 1
    assert image._repr_png_().startswith(b"\x89PNG")


def test_a_channel_outlives_its_picture(scene):
    channel = caustica.render(scene, spp=1, threads=1)["G"]
    before = channel.copy()
    gc.collect()
    for _ in range(20):
        caustica.render(scene, spp=1, threads=1, seed=7)
    assert np.array_equal(channel, before)


def test_statistics(image):
    s = image.statistics
    assert s["samples_per_pixel"] == 16 and s["camera_paths"] == 16 * 24 * 16 and s["rays"] > 0
    assert s["non_finite_from"] == [0] * 6 and s["interrupted"] is False and s["method"]["trials"] == []
    chosen = caustica.render(caustica.load_dict(description()), spp=64, integrator="auto").statistics["method"]
    assert chosen["reason"].startswith("auto: ") and 1 <= len(chosen["trials"]) <= 24


def test_settings(scene):
    settings = pickle.loads(pickle.dumps(caustica.Settings(spp=4, size=(8, 6), seed=3, threads=1)))
    a, b = caustica.render(scene, settings), caustica.render(scene, spp=4, size=(8, 6), seed=3)
    assert a.shape == (6, 8) and np.array_equal(a.rgb, b.rgb)
    assert not np.array_equal(a.rgb, caustica.render(scene, settings, seed=4).rgb)
    assert caustica.render(scene, spp=1, crop=(2, 3, 7, 9)).shape == (6, 5)
    assert np.array_equal(caustica.render(scene, spp=4, integrator={"type": "path", "max_depth": 2}).rgb,
                          caustica.render(scene, spp=4, integrator="path:max_depth=2").rgb)
    made = caustica.load_dict({"type": "bdpt", "max_depth": 3})
    assert caustica.render(scene, spp=1, integrator=made).attributes["caustica.integrator"].startswith("bdpt:max_depth=3")
    with pytest.raises(TypeError, match="no setting is called ssp"):
        caustica.render(scene, ssp=4)
    with pytest.raises(caustica.ArgumentError, match="did you mean \"vcm\""):
        caustica.render(scene, integrator="vmc")
    with pytest.raises(caustica.ArgumentError, match="seed -1 is out of range"):
        caustica.render(scene, seed=-1)
    with pytest.raises(caustica.ArgumentError, match="spp 0: there must be 1 sample per pixel at least"):
        caustica.render(scene, spp=0)
    with pytest.raises(caustica.ArgumentError, match="spp 18446744073709551616 is out of range"):
        caustica.render(scene, spp=2**64)
    with pytest.raises(TypeError, match="threads must be a number, not 'two'"):
        caustica.render(scene, threads="two")
    with pytest.raises(caustica.Error, match="\"path\" has no merge radius"):
        caustica.render(scene, radius=0.1)


def test_what_ends_a_render(scene):
    quiet, noisy = (caustica.render(scene, noise=target, threads=1).statistics for target in (2.0, 20.0))
    assert quiet["noise_percent"] <= 2.0 < noisy["noise_percent"] <= 20.0
    assert quiet["samples_per_pixel"] > noisy["samples_per_pixel"]
    assert 0.2 <= caustica.render(scene, seconds=0.2, threads=1).statistics["seconds"] < 1.0


def test_other_settings(scene):
    def rendered(**settings):
        return caustica.render(scene, spp=4, threads=1, **settings)

    assert rendered(sampler="sobol").attributes["caustica.sampler"] == "sobol"
    assert not np.array_equal(rendered(sampler="sobol").rgb, rendered().rgb)
    merged = {"integrator": "vcm", "radius": 0.3}
    fixed, shrinking = rendered(alpha=0.0, **merged), rendered(alpha=0.5, **merged)
    assert not np.array_equal(fixed.rgb, shrinking.rgb)
    with pytest.raises(caustica.Error, match="MiB"):
        rendered(memory=0.001)
    assert np.array_equal(rendered(memory=64.0).rgb, rendered().rgb)
    best = caustica.render(scene, seconds=0.3, integrator="bdpm", rays="auto", threads=1)
    assert best.statistics["light_paths"] > 0 and "Rays.Camera" in best
    grouped = caustica.render(scene, spp=64, replicates=16, threads=1)
    low, high = grouped.interval
    assert low.shape == high.shape == (16, 24, 3) and (low <= grouped.rgb).all() and (grouped.rgb <= high).all()
    assert np.isfinite(low).mean() > 0.9 and "16 replicates" in grouped.attributes["caustica.confidence"]


def test_progress(scene):
    told = []
    caustica.render(scene, spp=5, progress=told.append, threads=1)
    assert [p["passes_done"] for p in told] == [1, 2, 3, 4, 5] and told[0]["passes_total"] == 5
    ended = caustica.render(scene, spp=1000, progress=lambda p: p["passes_done"] < 3)
    assert ended.statistics["interrupted"] and ended.statistics["samples_per_pixel"] == 3
    with pytest.raises(ZeroDivisionError):
        caustica.render(scene, spp=1000, progress=lambda p: 1 / 0)


def test_a_bar(scene, monkeypatch):
    """It is full when the render has ended, and closed whatever ended it."""
    auto, bars = pytest.importorskip("tqdm.auto"), []

    class Seen(auto.tqdm):
        def __init__(self, **settings):
            super().__init__(**settings)
            self.closed = False
            bars.append(self)

        def close(self):
            self.closed = True
            super().close()

    monkeypatch.setattr(auto, "tqdm", Seen)
    caustica.render(scene, spp=2, progress=True, threads=1)
    caustica.render(scene, noise=20.0, progress=True, threads=1)
    caustica.measure_noise(scene, 2, integrator="bdpm", light_paths=100, progress=True, threads=1)
    with pytest.raises(caustica.ArgumentError):
        caustica.render(scene, spp=2, integrator="vmc", progress=True)
    assert [bar.closed for bar in bars] == [True] * 4 and [bar.n for bar in bars] == [1.0, 1.0, 1.0, 0]


def processor_seconds(pid):
    """What a process has worked so far: the time of other processes does not count."""
    with open(f"/proc/{pid}/stat") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def interrupt(call, work):
    """Presses Ctrl-C when a process has done so many seconds' work of a call: it ends within half a second."""
    code = f"""import caustica, sys, time
sys.path.insert(0, sys.argv[1])
from conftest import description
scene = caustica.load_dict(description())
try:
    print("begun", flush=True)
    {call}
except KeyboardInterrupt:
    print(time.process_time(), flush=True)"""
    process = subprocess.Popen([sys.executable, "-c", code, os.path.dirname(__file__)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "begun\n"
    begun = processor_seconds(process.pid)
    while (before := processor_seconds(process.pid)) - begun < work:
        assert process.poll() is None, "the call is shorter than that"
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    assert float(process.stdout.readline()) - before < 0.5 and process.wait() == 0


@pytest.mark.parametrize("settings", ["spp=10000000", "integrator='light:light_paths=50000000'",
                                      "spp=10000000, integrator='path', size=(3456, 2304)"])
def test_control_c(settings):
    """In short passes, in the middle of a pass of a minute, and where the picture has 8 megapixels."""
    interrupt(f"caustica.render(scene, {settings}, threads=1)", 5.0 if "size" in settings else 0.2)


@pytest.mark.parametrize("call", [
    "caustica.measure_noise(scene, 1000000, integrator='bdpm', light_paths=1000, size=(640, 480))",
    "rays = np.tile([[0.1, 0.2, -3.0]], (20000000, 1)); [scene.intersect(rays, [[0, 0, 1]]) for _ in range(9)]",
    "a = np.random.default_rng(1).random((2000, 3000, 3), np.float32); caustica.compare(a, a + 1)",
    "a = np.random.default_rng(1).random((2000, 3000, 3), np.float32); caustica.Image.from_array(a).save('never.exr')",
])
def test_control_c_elsewhere(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    interrupt(f"import numpy as np; {call}", 0.9)
    assert not any(tmp_path.iterdir())


def test_control_c_after_calls_of_many_threads():
    """The handler of before is there again, whichever threads begin and end at once."""
    script = ("import caustica, numpy as np, signal, threading\n"
              "image = caustica.Image.from_array(np.zeros((2, 2), np.float32))\n"
              "def work():\n    for _ in range(4000): caustica.compare(image, image)\n"
              "threads = [threading.Thread(target=work) for _ in range(4)]\n"
              "for t in threads: t.start()\n"
              "for t in threads: t.join()\n"
              "try:\n    signal.raise_signal(signal.SIGINT)\nexcept KeyboardInterrupt:\n    pass\n"
              "caustica.compare(image, image)\nprint('alive')\n")
    for _ in range(3):
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
        assert done.returncode == 0 and done.stdout == "alive\n", done.stderr


@pytest.fixture(scope="module")
def large_file(tmp_path_factory):
    """A mesh of 4 million triangles."""
    n, path = 1414, tmp_path_factory.mktemp("large") / "large.ply"
    x, y = np.meshgrid(np.arange(n + 1, dtype="<f4"), np.arange(n + 1, dtype="<f4"))
    vertices = np.stack([x, y, np.sin(0.01 * x)], axis=2).reshape(-1, 3)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.empty(2 * n * n, [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"] = 3
    faces["corners"] = np.stack([corner, corner + n + 2, corner + 1, corner, corner + n + 1, corner + n + 2], 1).reshape(-1, 3)
    header = ("ply\nformat binary_little_endian 1.0\n"
              f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
              f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    path.write_bytes(header.encode() + vertices.astype("<f4").tobytes() + faces.tobytes())
    return path


@pytest.mark.parametrize("work", [0.02, 0.15, 0.4, 0.8])
def test_control_c_while_loading(large_file, work):
    interrupt(f"caustica.load_dict(description(large={{'type': 'ply', 'filename': {str(large_file)!r}}}))", work)


def test_other_threads_go_on(scene):
    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count, daemon=True)
    thread.start()
    caustica.render(scene, spp=1000000, threads=1, seconds=0.3)
    stop.set()
    thread.join()
    assert counted[0] > 20


def test_threads_render_at_once(scene):
    found = [None] * 4

    def one(index):
        found[index] = caustica.render(scene, spp=8, threads=1).rgb

    threads = [threading.Thread(target=one, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(found[0], other) for other in found[1:])


LOADS = {
    "scenes": "caustica.render(caustica.load_dict(made()), spp=1, threads=1)",
    "meshes in place": "caustica.load_dict(made(copy=False))",
    "next versions": "global first; first = caustica.load_dict(made(height=len(seen) % 7), previous=first)",
    "views": "first.with_sensor(description()['sensor'])",
    "texts": "caustica.load_string('<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"sphere\"/></scene>')",
    "refused": "refused(lambda: caustica.load_dict(description(ball={'type': 'sphere', 'radus': 1})))",
    "damaged": "refused(lambda: caustica.load_dict(made(corner=99999)))",
    "noise": "caustica.measure_noise(first, 2, integrator='bdpm', light_paths=16, radius=0.1, size=(4, 4), threads=1).average(64, 4)",
    "pictures": "caustica.compare(picture, np.asarray(picture)); caustica.Image.from_array(picture)",
}


@pytest.mark.parametrize("loads", LOADS.values(), ids=LOADS)
def test_nothing_is_lost(loads):
    """1,250 loads in a process of its own: the bytes that malloc has lent, those of Python's objects too, at four points of the
    last thousand. What is lost adds up in each quarter. The memory of the process says less: it follows where blocks happen to lie."""
    code = f"""import caustica, ctypes, gc, sys
import numpy as np
sys.path.insert(0, sys.argv[1])
from conftest import description

def made(height=1.0, corner=0, **settings):
    mesh = np.random.default_rng(1).random((300, 3)) * [1, height, 1]
    faces = np.arange(300).reshape(100, 3) + [[corner, 0, 0]]
    picture = {{"type": "bitmap", "data": np.full((16, 16, 3), 0.5)}}
    return description(wave=caustica.Mesh(mesh, faces, bsdf={{"type": "diffuse", "reflectance": picture}}, **settings))

def refused(call):
    try:
        call()
    except caustica.Error:
        return
    raise SystemExit("not refused")

class Lent(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in (
        "arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost")]

mallinfo2 = ctypes.CDLL(None).mallinfo2
mallinfo2.restype = Lent

def memory():
    gc.collect()
    lent = mallinfo2()
    return lent.uordblks + lent.hblkhd

first, seen = caustica.load_dict(made()), []
picture = caustica.render(first, spp=1, threads=1)

def once():
    {loads}
    seen.append(None)

told = []
for _ in range(5):
    for _ in range(250):
        once()
    told.append(memory())
print(*np.diff(told))"""
    done = subprocess.run([sys.executable, "-c", code, os.path.dirname(__file__)], capture_output=True, text=True, check=True,
                          env={**os.environ, "PYTHONMALLOC": "malloc"})
    added = [int(word) for word in done.stdout.split()]  # bytes
    assert len(added) == 4 and min(added) < 1 << 16, added


def test_compare(scene, image):
    other = caustica.render(scene, spp=16, seed=5)
    found = caustica.compare(image, other)
    assert found["blocks"] > 0 and found["p_value"] > 1e-3 and found["rmse"] > 0
    flat = caustica.compare(np.full((16, 16), 0.75), np.full((16, 16), 0.5))
    assert math.isclose(flat["rmse"], 0.25) and math.isnan(flat["p_value"])
    with pytest.raises(caustica.ArgumentError):
        caustica.compare(np.zeros((4, 4)), np.zeros((4, 5)))
    left = np.full((16, 16), 0.5)
    left[:, :3] = 1.0
    assert math.isclose(caustica.compare(left, np.full((16, 16), 0.5), region=(0, 0, 4, 16))["mae"], 3 * 0.5 / 4)


def test_files_of_pictures(tmp_path, image):
    for name in ("a.exr", "a.png", "a.pfm"):
        caustica.util.write_bitmap(tmp_path / name, image)
    assert np.array_equal(np.asarray(caustica.Bitmap(tmp_path / "a.pfm")), image.rgb)
    for channels, names in ((1, "RGB"), (2, "RGBA"), (3, "RGB"), (4, "RGBA")):
        given = np.arange(2 * 3 * channels).reshape(2, 3, channels) / 24
        caustica.util.write_bitmap(filename=tmp_path / "c.exr", data=given, write_async=False, quality=3)
        found = caustica.Image.load(tmp_path / "c.exr")
        assert sorted(found.channels) == sorted(names) and np.allclose(found["R"], given[:, :, 0])
        assert np.allclose(found[names[-1]], given[:, :, -1])
        caustica.util.write_bitmap(tmp_path / "c.png", given)
    caustica.Bitmap(image.rgb).write(tmp_path / "b.exr")
    assert np.array_equal(caustica.Image.load(tmp_path / "b.exr").rgb, image.rgb)
    with pytest.raises(caustica.Error, match=".exr"):
        image.save(tmp_path / "a.tiff")
    with pytest.raises(caustica.FileError):
        image.save(tmp_path / "no" / "a.exr")


def test_preflight(scene):
    T = caustica.ScalarTransform4f
    water = {"type": "rectangle", "to_world": T().translate([0, -0.5, 0]).rotate([1, 0, 0], -90).scale(9),
             "bsdf": {"type": "dielectric"}}
    wet = caustica.load_dict(description(water=water))
    told = caustica.preflight(wet, integrator="path", spp=16)
    assert told["lost_light"] > 0.5 and told["lost_light_low"] <= told["lost_light"] <= told["lost_light_high"]
    assert len(told["warnings"]) == 1 and told["warnings"][0].startswith('"path" will find none or too little of about')
    dry = caustica.preflight(scene, spp=16)
    assert dry["lost_light"] < 0.02 and dry["warnings"] == [] and dry["rays"] > 0
    with pytest.raises(caustica.ArgumentError, match="pathh"):
        caustica.preflight(scene, integrator="pathh")


def test_noise(scene):
    noise = caustica.measure_noise(scene, 8, integrator="bdpm", light_paths=1000, threads=1)
    here, more = noise.average(1000, 4), noise.average(4000, 4)
    assert here["pixels"] == 16 * 24 and here["predicted"] > more["predicted"] > 0
    assert any(name.startswith("Noise.") for name in noise.image.channels)
    assert noise.average(1000, 4, (0, 0, 8, 8))["pixels"] == 64
    best = noise.recommend()
    assert best["best"]["light_paths"] >= 1 and "Rays.Numbers" in "".join(noise.image.channels)


def test_noise_of_what_connects(scene):
    alone = caustica.measure_noise(scene, 8, integrator="vcm", light_paths=1000, camera_paths=2, threads=1)
    with pytest.raises(caustica.Unsupported):
        alone.recommend()
    noise = caustica.measure_noise(scene, 8, integrator="vcm", light_paths=1000, camera_paths=2, counts=[(500, 2), (4000, 2)],
                                   threads=1)
    assert noise.average(4000, 2)["predicted"] != alone.average(4000, 2)["predicted"]
    assert 500 <= noise.recommend()["best"]["light_paths"] <= 4000


@pytest.mark.skipif(not PROGRAM, reason="CA_PROGRAM names no program")
def test_converge_is_the_programs(tmp_path):
    file, out = tmp_path / "scene.xml", tmp_path / "results"
    file.write_text(TEXT)
    scene = caustica.load_file(file)
    reference = caustica.render(scene, spp=64, seed=9)
    reference.save(tmp_path / "reference.exr")
    subprocess.run([PROGRAM, "converge", file, "-i", "path;ovcm", "--spp", "1,4", "--repeats", "2", "--reference",
                    tmp_path / "reference.exr", "-o", out, "--quiet"], check=True)
    with open(out / "renders.csv") as lines:
        theirs = list(csv.DictReader(lines))
    told = []
    ours = caustica.converge(scene, reference, ["path", "ovcm"], spp=[1, 4], repeats=2, progress=told.append)
    assert len(ours) == 8 and told == ours and list(ours[0]) == [name for name in theirs[0] if name != "file"]
    for a, b in zip(ours, theirs):
        assert a["integrator"] == b["integrator"] and a["method"] == b["method"]
        for name in set(a) - {"integrator", "method", "seconds"}:
            assert math.isclose(a[name], float(b[name] or "nan"), rel_tol=1e-5) or not b[name] and math.isnan(a[name]), name
    assert ours[0]["relmse"] > ours[-1]["relmse"]


def test_converge_by_time(scene, image):
    ours = caustica.converge(scene, image, ["path"], seconds=[0.01, 0.02], seed=4, threads=1)
    assert [record["time"] for record in ours] == [0.01, 0.02] and ours[0]["seed"] != ours[1]["seed"]
    with pytest.raises(TypeError, match="one of spp and seconds"):
        caustica.converge(scene, image, ["path"])


def test_variants():
    caustica.set_variant("llvm_ad_rgb")
    with pytest.raises(caustica.ArgumentError):
        caustica.set_variant("scalar_spectral")
