"""Renders: the same bits as the program's, arrays that own their picture, errors, callbacks, Ctrl-C."""
import csv
import gc
import math
import os
import pickle
import resource
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
def test_the_bits_of_the_program(tmp_path):
    file, out = tmp_path / "scene.xml", tmp_path / "out.exr"
    file.write_text(TEXT)
    subprocess.run([PROGRAM, "render", file, "--spp", "4", "-o", out, "--quiet"], check=True)
    theirs, ours = caustica.Image.load(out), caustica.render(caustica.load_file(file), spp=4, threads=1)
    assert len(theirs.channels) > 15 and set(theirs.channels) <= set(ours.channels)
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
    with pytest.raises(TypeError, match="no setting is called ssp"):
        caustica.render(scene, ssp=4)
    with pytest.raises(caustica.ArgumentError, match="did you mean \"vcm\""):
        caustica.render(scene, integrator="vmc")
    with pytest.raises(caustica.Error, match="\"path\" has no merge radius"):
        caustica.render(scene, radius=0.1)


def test_progress(scene):
    told = []
    caustica.render(scene, spp=5, progress=told.append, threads=1)
    assert [p["passes_done"] for p in told] == [1, 2, 3, 4, 5] and told[0]["passes_total"] == 5
    ended = caustica.render(scene, spp=1000, progress=lambda p: p["passes_done"] < 3)
    assert ended.statistics["interrupted"] and ended.statistics["samples_per_pixel"] == 3
    with pytest.raises(ZeroDivisionError):
        caustica.render(scene, spp=1000, progress=lambda p: 1 / 0)
    caustica.render(scene, spp=2, progress=True)


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
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    assert float(process.stdout.readline()) - before < 0.5 and process.wait() == 0


@pytest.mark.parametrize("settings", ["spp=10000000", "integrator='light:light_paths=50000000'",
                                      "spp=10000000, integrator='path', size=(3456, 2304)"])
def test_control_c(settings):
    """In short passes, in the middle of a pass of a minute, and where the picture has 8 megapixels."""
    interrupt(f"caustica.render(scene, {settings}, threads=1)", 5.0 if "size" in settings else 0.2)


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


def test_nothing_is_lost():
    def once():
        caustica.render(caustica.load_dict(description()), spp=1, threads=1)

    for _ in range(50):
        once()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(1000):
        once()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 3000  # KiB


def test_compare(scene, image):
    other = caustica.render(scene, spp=16, seed=5)
    found = caustica.compare(image, other)
    assert found["blocks"] > 0 and found["p_value"] > 1e-3 and found["rmse"] > 0
    flat = caustica.compare(np.full((16, 16), 0.75), np.full((16, 16), 0.5))
    assert math.isclose(flat["rmse"], 0.25) and math.isnan(flat["p_value"])
    with pytest.raises(caustica.ArgumentError):
        caustica.compare(np.zeros((4, 4)), np.zeros((4, 5)))


def test_files_of_pictures(tmp_path, image):
    for name in ("a.exr", "a.png", "a.pfm"):
        caustica.util.write_bitmap(tmp_path / name, image)
    assert np.array_equal(np.asarray(caustica.Bitmap(tmp_path / "a.pfm")), image.rgb)
    caustica.Bitmap(image.rgb).write(tmp_path / "b.exr")
    assert np.array_equal(caustica.Image.load(tmp_path / "b.exr").rgb, image.rgb)
    with pytest.raises(caustica.Error, match=".exr"):
        image.save(tmp_path / "a.tiff")
    with pytest.raises(caustica.FileError):
        image.save(tmp_path / "no" / "a.exr")


def test_noise(scene):
    noise = caustica.measure_noise(scene, 8, integrator="bdpm", light_paths=1000, threads=1)
    here, more = noise.average(1000, 4), noise.average(4000, 4)
    assert here["pixels"] == 16 * 24 and here["predicted"] > more["predicted"] > 0
    assert any(name.startswith("Noise.") for name in noise.image.channels)
    assert noise.average(1000, 4, (0, 0, 8, 8))["pixels"] == 64
    best = noise.recommend()
    assert best["best"]["light_paths"] >= 1 and "Rays.Numbers" in "".join(noise.image.channels)


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
        assert a["integrator"] == b["integrator"]
        for name in set(a) - {"integrator", "seconds"}:
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
