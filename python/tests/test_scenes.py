"""Scenes from dictionaries, texts, arrays and files."""
import gc
import pathlib
import re
import sys

import numpy as np
import pytest

import caustica
from caustica._dict import TAGS, Document
from conftest import description

ROOT = pathlib.Path(__file__).resolve().parents[2]
T = caustica.ScalarTransform4f


def pixels(scene, **settings):
    return np.asarray(caustica.render(scene, spp=4, threads=1, **settings))


def test_dictionary_is_the_text():
    text = """<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="4"/></integrator>
        <sensor type="perspective"><float name="fov" value="40"/>
            <transform name="to_world"><lookat origin="0, 1, -4" target="0, 0, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film></sensor>
        <shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/>
            <translate y="-1"/></transform><bsdf type="conductor"/></shape>
        <emitter type="constant"><rgb name="radiance" value="0.2, 0.3, 0.4"/></emitter></scene>"""
    made = description()
    made["floor"]["bsdf"] = {"type": "conductor"}
    made["light"] = {"type": "constant", "radiance": {"type": "rgb", "value": [0.2, 0.3, 0.4]}}
    a, b = pixels(caustica.load_string(text)), pixels(caustica.load_dict(made))
    assert np.allclose(a, b, rtol=1e-4) and a.mean() > 0.1


def test_mesh_is_the_rectangle():
    vertices, faces = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    made = description(light={"type": "constant"})
    rectangle = pixels(caustica.load_dict(made))
    place = made["floor"]["to_world"]
    made["floor"] = caustica.Mesh(vertices, faces, uvs=[[0, 0], [1, 0], [1, 1], [0, 1]], face_normals=True, to_world=place,
                                  bsdf={"type": "diffuse", "reflectance": 0.5})
    assert np.array_equal(pixels(caustica.load_dict(made)), rectangle)


def test_arrays_may_have_any_kind_of_numbers():
    mesh = caustica.Mesh(np.zeros((3, 3), np.float64)[:, ::-1], np.array([[0, 1, 2]], np.int64))
    assert mesh.vertices.dtype == np.float32 and mesh.faces.dtype == np.uint32


@pytest.mark.parametrize("arguments, words", [
    (([[0, 0]], [[0, 0, 0]]), "vertices have the shape (n, 3)"),
    (([[0, 0, 0]], [[0, -1, 0]]), "not negative"),
    (([[0, 0, 0]], [[0.5, 0, 0]]), "integers"),
    (([[0, 0, 0]], [[0, 0, 2**32]]), "below 2^32"),
    (([[0, 0, 0]], [[0, 0, 0]], [[0, 0, 1], [0, 0, 1]]), "2 normals for 1 vertices"),
])
def test_wrong_arrays(arguments, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        caustica.Mesh(*arguments)


def test_index_out_of_range_names_the_keys():
    mesh = caustica.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]])
    with pytest.raises(caustica.Error, match="^wing: .*triangle 0 uses vertex 3") as raised:
        caustica.load_dict(description(wing=mesh))
    assert raised.value.path == "wing"


def test_bitmaps():
    white = description(light={"type": "constant"})
    white["floor"]["bsdf"] = {"type": "diffuse", "reflectance": {"type": "bitmap", "data": np.full((2, 3), 0.5)}}
    plain = description(light={"type": "constant"})
    plain["floor"]["bsdf"] = {"type": "diffuse", "reflectance": 0.5}
    assert np.allclose(pixels(caustica.load_dict(white)), pixels(caustica.load_dict(plain)), rtol=1e-5)
    red = np.zeros((4, 4, 3))
    red[:, :, 0] = 1
    sky = description(light={"type": "envmap", "bitmap": caustica.Bitmap(red)})
    seen = pixels(caustica.load_dict(sky))
    assert seen[:, :, 0].mean() > 0.3 and seen[:, :, 1].max() == 0
    white["floor"]["bsdf"]["reflectance"]["data"] = np.zeros((2, 2, 5))
    with pytest.raises(caustica.SceneError, match="floor.bsdf.reflectance.data: pixels"):
        caustica.load_dict(white)


def test_raw_bitmaps(tmp_path):
    """Bytes and 16-bit numbers are what they are, of either byte order, in arrays, in pictures and in files."""
    def seen(value, **texture):
        scene = description(light={"type": "constant"})
        scene["floor"]["bsdf"] = {"type": "diffuse", "reflectance": {"type": "bitmap", "data": value, **texture}}
        return pixels(caustica.load_dict(scene))

    plain = description(light={"type": "constant"})
    plain["floor"]["bsdf"] = {"type": "diffuse", "reflectance": 0.5019608}
    expected = pixels(caustica.load_dict(plain))
    for kind, value in (("u1", 128), ("<u2", 32896), (">u2", 32896)):
        array = np.full((2, 3, 3), value, kind)
        assert np.allclose(seen(array, raw=True), expected, rtol=1e-5)
        assert np.allclose(seen(caustica.Bitmap(array), raw=True), expected, rtol=1e-5)
        assert np.allclose(seen(array), seen(np.full((2, 3), 0.2158605)), rtol=1e-4)
    caustica.Bitmap(np.full((4, 4, 3), 0.2158605, np.float32)).write(tmp_path / "grey.png")
    assert np.allclose(seen(caustica.Bitmap(tmp_path / "grey.png"), raw=True), expected, rtol=1e-5)
    with pytest.raises(caustica.SceneError, match="uint8 or uint16, not int64"):
        seen(np.full((2, 3), 1, np.int64))


def test_alpha_of_a_file(tmp_path):
    path = str(tmp_path / "alpha.exr")
    array = np.linspace(0, 1, 2 * 3 * 4, dtype=np.float32).reshape(2, 3, 4)
    caustica.Bitmap(array).write(path)
    assert np.array_equal(caustica.Bitmap(path).array, array)


def test_dollars_are_plain(tmp_path):
    folder = tmp_path / "$HOME"
    folder.mkdir()
    (folder / "one.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert caustica.load_dict(description(wing={"type": "obj", "id": "$a", "filename": str(folder / "one.obj")}))


def test_errors_of_files_name_the_keys(tmp_path):
    with pytest.raises(caustica.FileError, match="^wing: .*no.ply") as raised:
        caustica.load_dict(description(wing={"type": "ply", "filename": str(tmp_path / "no.ply")}))
    assert raised.value.path == "wing"


@pytest.mark.parametrize("objects, path, words", [
    ({"ball": {"type": "sphre"}}, "ball", "\"sphere\""),
    ({"ball": {"type": "sphere", "radus": 2}}, "ball.radus", "\"radius\""),
    ({"ball": {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": "red"}}}, "ball.bsdf.reflectance", "string"),
    ({"ball": {"type": "sphere", "radius": object()}}, "ball.radius", "three numbers"),
    ({"ball": {"type": "sphere", "bsdf": {"type": "ref", "id": "flor"}}}, "ball.bsdf", "\"floor\""),
])
def test_errors_name_the_keys(objects, path, words):
    with pytest.raises(caustica.SceneError) as raised:
        caustica.load_dict(description(**objects))
    assert raised.value.path == path and str(raised.value).startswith(path) and words in str(raised.value)


def test_no_scene():
    for wrong in ({}, {"sphere": {"type": "sphere"}}, 3):
        with pytest.raises(caustica.SceneError, match="that of a scene is \"scene\""):
            caustica.load_dict(wrong)


GLASS = {"type": "dielectric"}


@pytest.mark.parametrize("objects, name", [
    ({"glass": GLASS}, "glass"),
    ({"glass": {**GLASS, "id": "pane"}}, "pane"),
    ({"glass": {**GLASS, "id": "pane"}}, "glass"),
    ({"cube": {"type": "cube", "to_world": T().translate([0, 9, 0]), "bsdf": GLASS}}, "cube.bsdf"),
    ({"cube": {"type": "cube", "to_world": T().translate([0, 9, 0]), "bsdf": {**GLASS, "id": "pane"}}}, "pane"),
    ({"wing": caustica.Mesh([[0, 9, 0], [1, 9, 0], [0, 9, 1]], [[0, 1, 2]], bsdf=GLASS)}, "wing.bsdf"),
])
def test_references(objects, name):
    """By the key, by an "id", by the keys that lead there; as Mitsuba 3.9.1 takes them."""
    made = description(**objects, ball={"type": "sphere", "bsdf": {"type": "ref", "id": name}})
    nested = description(**objects, ball={"type": "sphere", "bsdf": GLASS})
    plain = description(**objects, ball={"type": "sphere"})
    assert np.array_equal(pixels(caustica.load_dict(made)), pixels(caustica.load_dict(nested)))
    assert not np.array_equal(pixels(caustica.load_dict(made)), pixels(caustica.load_dict(plain)))


def test_objects_of_their_own():
    whole = pixels(caustica.load_dict(description(ball={"type": "sphere", "bsdf": GLASS})))
    ball = caustica.load_dict({"type": "sphere", "bsdf": caustica.load_dict(GLASS)}, parallel=False)
    assert np.array_equal(pixels(caustica.load_dict(description(ball=ball), optimize=False)), whole)
    sensor = description()["sensor"]
    sensor["film"] = caustica.load_dict({**sensor["film"], "rfilter": caustica.load_dict({"type": "tent"})})
    sensor["sampler"] = caustica.load_dict(sensor["sampler"])
    made = description(ball=ball, sensor=caustica.load_dict(sensor), light=caustica.load_dict(description()["light"]))
    assert repr(made["light"]) == "<caustica.Object point>"
    tent = description(ball=ball)
    tent["sensor"]["film"]["rfilter"] = {"type": "tent"}
    assert np.array_equal(pixels(caustica.load_dict(made)), pixels(caustica.load_dict(tent)))


@pytest.mark.parametrize("wrong, path, words", [
    ({"type": "sphere", "radus": 2}, "radus", "\"radius\""),
    ({"type": "diffuse", "reflectance": {"type": "rgb", "value": [1, 2]}}, "reflectance", "one number or three"),
    ({"type": "checkerboard", "colour0": 1.0}, "colour0", "\"color0\""),
    ({"type": "area", "radiance": {"type": "spectrum", "value": "bright"}}, "radiance", "pairs of a wavelength"),
    ({"type": "hdrfilm", "width": "wide"}, "width", "integer"),
    ({"type": "sampler"}, "", "no plugin \"sampler\""),
    ({"type": "sphere", "bsdf": {"alpha": 0.1}}, "bsdf", "\"type\" is missing"),
    ({"type": "sphere", "bsdf": {"type": "ref"}}, "bsdf", "\"id\""),
    ({"type": "resources"}, "", "\"path\""),
])
def test_errors_of_objects(wrong, path, words):
    with pytest.raises(caustica.SceneError) as raised:
        caustica.load_dict(wrong)
    assert raised.value.path == path and words in str(raised.value) and str(raised.value).startswith(path)


@pytest.mark.parametrize("radiance, seen", [
    ({"type": "d65", "scale": 2.0}, 2.0),
    ({"type": "d65", "color": {"type": "rgb", "value": [0.1, 0.2, 0.3]}}, [0.1, 0.2, 0.3]),
    ({"type": "uniform", "value": 0.4}, 0.4),
    ({"type": "srgb", "color": {"type": "rgb", "value": [0.1, 0.2, 0.3]}}, [0.1, 0.2, 0.3]),
    ({"type": "rgb", "value": 0.3}, 0.3),
    (caustica.load_dict({"type": "rgb", "value": [0.1, 0.2, 0.3]}), [0.1, 0.2, 0.3]),
])
def test_colors(radiance, seen):
    """What Mitsuba 3.9.1 (scalar_rgb) shows of each."""
    scene = {"type": "scene", "light": {"type": "constant", "radiance": radiance}, "sensor": description()["sensor"]}
    scene["sensor"]["film"]["rfilter"] = {"type": "box"}
    assert np.allclose(pixels(caustica.load_dict(scene)), seen, rtol=1e-5)


def test_a_spectrum_of_wavelengths():
    flat, pairs = ({"type": "irregular", "wavelengths": "300, 900", "values": "0.25, 0.25"},
                   {"type": "spectrum", "value": [(300, 0.25), (900, 0.25)]})
    made = [pixels(caustica.load_dict(description(light={"type": "constant", "radiance": value}))) for value in (flat, pairs)]
    assert np.array_equal(*made) and made[0].mean() > 0.1


def test_folders_of_files(tmp_path):
    caustica.util.write_bitmap(tmp_path / "red.pfm", np.full((2, 2, 3), [0.5, 0.0, 0.0]))
    textured = {"type": "rectangle", "to_world": T().translate([0, 0, 1]).rotate([0, 1, 0], 180).scale(9),
                "bsdf": {"type": "diffuse", "reflectance": {"type": "bitmap", "filename": "red.pfm"}}}
    with pytest.raises(caustica.Error, match="red.pfm"):
        caustica.load_dict(description(wall=textured))
    found = pixels(caustica.load_dict(description(folder={"type": "resources", "path": tmp_path}, wall=textured)))[:4]
    assert found[:, :, 0].mean() > 0 and found[:, :, 1].max() == 0
    textured["bsdf"]["reflectance"]["filename"] = tmp_path / "red.pfm"
    assert np.array_equal(pixels(caustica.load_dict(description(wall=textured)))[:4], found)


def test_bytes_are_srgb():
    def floor(value):
        made = description(light={"type": "constant"})
        made["floor"]["bsdf"] = {"type": "diffuse", "reflectance": value}
        return pixels(caustica.load_dict(made))

    grey = np.full((2, 2, 3), 128, np.uint8)
    linear = ((128 / 255 + 0.055) / 1.055) ** 2.4
    assert np.allclose(floor({"type": "bitmap", "data": grey}), floor(linear), rtol=1e-5)
    assert np.allclose(floor({"type": "bitmap", "bitmap": caustica.Bitmap(grey)}), floor(linear), rtol=1e-5)
    alpha = np.asarray(caustica.Bitmap(np.array([[[0, 257, 65535, 32768]]], np.uint16)))
    assert np.allclose(alpha, [[[0, 1 / 255 / 12.92, 1, 32768 / 65535]]], rtol=1e-5)


def test_one_of_several_sensors():
    other = {**description()["sensor"], "to_world": T().look_at([2, 1, -3], [0, 0, 0], [0, 1, 0]), "id": "side"}
    both = description(second=other)
    first, second = caustica.load_dict(both), caustica.load_dict(both, sensor=1)
    alone = pixels(caustica.load_dict(description(sensor=other)))
    assert np.array_equal(pixels(second), alone) and not np.array_equal(pixels(first, sensor=0), alone)
    assert np.array_equal(pixels(caustica.load_dict(both, sensor="side")), alone)
    with pytest.raises(caustica.ArgumentError, match="load it with sensor=1"):
        caustica.render(first, sensor=1)
    with pytest.raises(caustica.Error, match="no sensor 2"):
        caustica.load_dict(both, sensor=2)


def test_files():
    path = ROOT / "scenes" / "cornell-box" / "cornell-box.xml"
    assert pixels(caustica.load_file(path), size=(16, 16)).mean() > 0.0
    with pytest.raises(caustica.FileError, match="No such file"):
        caustica.load_file("nowhere.xml")
    with pytest.raises(caustica.SceneError) as raised:
        caustica.load_string("<scene version='3.0.0'>\n <sensr/></scene>")
    assert (raised.value.file, raised.value.line, raised.value.column) == ("load_string", 2, 2)
    text = """<scene version="3.0.0"><default name="w" value="8"/><sensor type="perspective"><film type="hdrfilm">
        <integer name="width" value="$w"/></film></sensor><emitter type="constant"/></scene>"""
    assert caustica.render(caustica.load_string(text, w=12), spp=1).width == 12


def test_views_share_the_scene(scene):
    elsewhere = description()["sensor"]
    elsewhere["to_world"] = T().look_at([2, 1, -3], [0, 0, 0], [0, 1, 0])
    whole = description()
    whole["sensor"] = elsewhere
    view = scene.with_sensor(elsewhere)
    assert np.array_equal(pixels(view), pixels(caustica.load_dict(whole)))
    assert np.array_equal(pixels(scene, sensor=elsewhere), pixels(view))
    assert np.array_equal(pixels(scene, sensor=caustica.load_dict(elsewhere)), pixels(view))
    assert not np.array_equal(pixels(scene), pixels(view))
    with pytest.raises(caustica.SceneError, match="sensor.fov"):
        scene.with_sensor({"type": "perspective", "fov": "wide"})


def grid(n):
    """A wavy square of 2 n^2 triangles."""
    x, y = np.meshgrid(np.linspace(-1, 1, n + 1, dtype=np.float32), np.linspace(-1, 1, n + 1, dtype=np.float32))
    vertices = np.stack([x, y, 0.1 * np.sin(5 * x)], axis=2).reshape(-1, 3)
    corner = np.arange((n + 1) * n, dtype=np.uint32).reshape(n, n + 1)[:, :-1].ravel()
    faces = np.stack([corner, corner + n + 2, corner + 1, corner, corner + n + 1, corner + n + 2], axis=1).reshape(-1, 3)
    return vertices, faces


def test_edits_share_what_is_the_same():
    def made(x=0.0, grey=0.5, height=1.0):
        vertices, faces = grid(20)
        return description(
            wave=caustica.Mesh(vertices * [1, 1, height], faces, bsdf={"type": "diffuse", "reflectance": grey}),
            group={"type": "shapegroup", "ball": {"type": "sphere"}},
            one={"type": "instance", "shapegroup": {"type": "ref", "id": "group"}, "to_world": T().translate([x, 0, -1]).scale(0.2)})

    first = caustica.load_dict(made())
    before = pixels(first)
    assert first.builds == 3
    for changes, builds in (({}, 0), ({"grey": 0.8}, 0), ({"x": 0.5}, 1), ({"height": 2.0}, 1)):
        edited = caustica.load_dict(made(**changes), previous=first)
        assert edited.builds == builds and np.array_equal(pixels(edited), pixels(caustica.load_dict(made(**changes))))
        assert np.array_equal(pixels(first), before) and (not changes or not np.array_equal(pixels(edited), before))
    kept = caustica.load_dict(made(), previous=edited)
    del first, edited
    assert np.array_equal(pixels(kept), before)


def test_arrays_in_place_are_kept_alive():
    from caustica._scene import _lent
    there = len(_lent)
    vertices, faces = grid(20)
    copied = pixels(caustica.load_dict(description(wave=caustica.Mesh(vertices, faces))))
    scene = caustica.load_dict(description(wave=caustica.Mesh(vertices, faces, copy=False)))
    assert len(_lent) == there + 1
    counts = sys.getrefcount(vertices)
    del vertices, faces
    view = scene.with_sensor(description()["sensor"])
    del scene
    gc.collect()
    assert counts > 2 and np.array_equal(pixels(view), copied)
    del view
    gc.collect()
    assert len(_lent) == there
    with pytest.raises(caustica.Error):
        caustica.load_dict(description(wave=caustica.Mesh([[0, 0, 0]], [[0, 1, 2]], copy=False)))
    assert len(_lent) == there


def test_rays():
    scene = caustica.load_dict(description(ball={"type": "sphere", "center": [0, 0, 5]}))
    hits = scene.intersect([[0, 0, -3], [0, 3, 5], [9, 9, 9]], [[0, 0, 2], [0, -1, 0], [0, 0, 1]])
    assert np.allclose(hits["t"], [3.5, 2, np.inf]) and np.allclose(hits["normal"][:2], [[0, 0, -1], [0, 1, 0]])
    assert scene.shape_id(hits["shape"][0]) == "ball" and scene.shape_id(hits["shape"][2]) is None
    assert scene.occluded([[0, 0, -3]], [[0, 0, 2], [0, 2, 0]]).tolist() == [True, False]
    assert scene.occluded([[0, 0, -3]], [[0, 0, 2]], t_max=3.0).tolist() == [False]
    with pytest.raises(ValueError, match="shape"):
        scene.intersect([0, 0, 0], [0, 0, 1])


def test_names_of_what_was_met():
    placed = {f"at{x}": {"type": "instance", "shapegroup": {"type": "ref", "id": "balls"}, "to_world": T().translate([x, 0, 0])}
              for x in (2, -2)}
    scene = caustica.load_dict(description(balls={"type": "shapegroup", "ball": {"type": "sphere", "id": "inner"}}, **placed))
    hits = scene.intersect([[-2, 0, -5], [2, 0, -5], [0, 9, 0], [99, 9, 0]], [[0, 0, 1], [0, 0, 1], [0, -1, 0], [0, -1, 0]])
    assert [scene.shape_id(hit["shape"]) for hit in hits] == ["inner", "inner", "floor", None]
    assert [scene.instance_id(hit["instance"]) for hit in hits] == ["at-2", "at2", None, None]


def test_many_rays():
    """More than are traced without asking for Ctrl-C."""
    scene = caustica.load_dict(description(ball={"type": "sphere", "center": [0, 0, 5]}))
    x = np.linspace(-2, 2, (1 << 20) + 100001)
    origins = np.stack([x, np.zeros_like(x), np.zeros_like(x)], axis=1)
    hits, hidden = scene.intersect(origins, [[0, 0, 1]]), scene.occluded(origins, [[0, 0, 1]])
    inside = np.abs(x) < 0.999
    assert np.allclose(hits["t"][inside], 5 - np.sqrt(1 - x[inside] ** 2), rtol=1e-4)
    assert hidden[inside].all() and not hidden[np.abs(x) > 1.001].any() and np.isinf(hits["t"][np.abs(x) > 1.001]).all()


def test_all_documented_plugins_have_a_tag():
    """The tables of docs/scenes.md, by their headings."""
    tags = {"shape": "shape", "bsdf": "bsdf", "emitter": "emitter", "texture": "texture"}
    heading, seen = None, 0
    for line in (ROOT / "docs" / "scenes.md").read_text().splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) > 1 and cells[0] in tags:
            heading = tags[cells[0]]
        elif len(cells) < 2:
            heading = None
        elif heading and not cells[0].startswith("-"):
            for name in re.findall(r"`([^`]+)`", cells[0]):
                assert name in TAGS[heading], f"{heading} {name}"
                seen += 1
    assert seen > 30


def test_text_has_a_line_for_each_place():
    document = Document(description())
    lines = document.text.split("\n")
    assert len(lines) == len(document.paths)
    fov = next(i for i, line in enumerate(lines) if 'name="fov"' in line)
    assert document.path_of(fov + 1) == "sensor.fov"


def test_transforms():
    t = T().translate([1, 2, 3]).rotate([0, 0, 2], 90).scale(2)
    assert np.allclose(t @ [1, 0, 0], [1, 4, 3])
    assert np.allclose((t.inverse() @ t).matrix, np.eye(4))
    assert T.translate(1, 2, 3) == T().translate([1, 2, 3])
    assert np.allclose(T.look_at([0, 0, -2], [0, 0, 0], [0, 1, 0]) @ np.array([[0, 0, 2], [1, 0, 0]]), [[0, 0, 0], [1, 0, -2]])
    with pytest.raises(ValueError, match="4 x 4"):
        T(np.eye(3))
    with pytest.raises(TypeError):
        T.scale(1, 2)
