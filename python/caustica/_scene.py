"""Scenes: from files, texts and dictionaries."""
import os

import numpy as np

from caustica._dict import SPECTRA, Document, Object, tag_of
from caustica._errors import Error, SceneError, check, interruptible, new_error
from caustica._library import ffi, lib


class Scene:
    """A scene that is ready to render. It never changes; any number of threads may render it at once."""

    def __init__(self, pointer, sensor=0):
        self._pointer = ffi.gc(pointer, lib.ca_scene_release)
        #: The sensor that it was loaded with: a number from 0, or an id.
        self.sensor = sensor

    @property
    def builds(self):
        """How many acceleration structures were built for it, and not shared with the scene it was made from by `previous`."""
        return lib.ca_scene_builds(self._pointer)

    def with_sensor(self, sensor, integrator=None):
        """The same scene seen by another sensor, a dictionary or object of load_dict, with its film and sampler; and by another
        integrator. Shapes, lights and materials are shared, nothing is built again."""
        description = {"type": "scene", "sensor": sensor}
        if integrator is not None:
            description["integrator"] = integrator
        return _from_document(Document(description), lambda *args: lib.ca_scene_view(self._pointer, *args))

    def intersect(self, origins, directions, t_min=0.0, t_max=np.inf):
        """The nearest hits of rays (n, 3), (n, 3): a NumPy array of n records with the fields t (inf: nothing was met; in units of
        the direction's length), position, normal, shading_normal, uv, shape, primitive, instance (2^32 - 1: none)."""
        hits = np.empty(_ray_count(origins, directions), _HIT)
        for rays, found in _parts(hits, origins, directions, t_min, t_max):
            lib.ca_scene_intersect(self._pointer, ffi.from_buffer("ca_ray[]", rays), len(rays),
                                   ffi.from_buffer("ca_ray_hit[]", found, require_writable=True))
        return hits

    def occluded(self, origins, directions, t_min=0.0, t_max=np.inf):
        """Does each of the rays (n, 3), (n, 3) meet anything? bool (n,)"""
        occluded = np.empty(_ray_count(origins, directions), bool)
        for rays, found in _parts(occluded, origins, directions, t_min, t_max):
            lib.ca_scene_occluded(self._pointer, ffi.from_buffer("ca_ray[]", rays), len(rays),
                                  ffi.from_buffer("bool[]", found, require_writable=True))
        return occluded

    def shape_id(self, shape):
        """The key of a shape by its number in a hit; None where it has none."""
        return _text_or_none(lib.ca_scene_shape_id(self._pointer, shape))

    def instance_id(self, instance):
        """The key of an instance by its number in a hit; None where it has none, or nothing was met in an instance."""
        return _text_or_none(lib.ca_scene_instance_id(self._pointer, instance))


def _text_or_none(text):
    return ffi.string(text).decode() if text else None


def _ray_count(origins, directions):
    shape = np.broadcast_shapes(np.shape(origins), np.shape(directions))
    if len(shape) != 2 or shape[1] != 3:
        raise ValueError(f"rays have the shape (n, 3), not {shape}")
    return shape[0]


def _parts(answers, origins, directions, t_min, t_max, length=1 << 18):
    """The rays and the place of their answers, part by part: Ctrl-C comes between two of them."""
    count = len(answers)
    fields = {"origin": np.broadcast_to(origins, (count, 3)), "direction": np.broadcast_to(directions, (count, 3)),
              "t_min": np.broadcast_to(t_min, count), "t_max": np.broadcast_to(t_max, count)}
    for begin in range(0, count, length):
        part = slice(begin, begin + length)
        rays = np.empty(len(answers[part]), _RAY)
        for name, values in fields.items():
            rays[name] = values[part]
        yield rays, answers[part]


#: ca_ray and ca_ray_hit.
_RAY = np.dtype([("origin", "f4", 3), ("direction", "f4", 3), ("t_min", "f4"), ("t_max", "f4")])
_HIT = np.dtype([("t", "f4"), ("position", "f4", 3), ("normal", "f4", 3), ("shading_normal", "f4", 3), ("uv", "f4", 2),
                 ("shape", "u4"), ("primitive", "u4"), ("instance", "u4")])
assert _RAY.itemsize == ffi.sizeof("ca_ray") and _HIT.itemsize == ffi.sizeof("ca_ray_hit")


#: Arrays that the library uses in place, by the handle it knows them by.
_lent = {}


@ffi.def_extern()
def caustica_release(user):
    _lent.pop(user, None)


def _lend(*arrays):
    handle = ffi.new_handle(arrays)
    _lent[ffi.cast("void *", handle)] = handle
    return handle


class _Source:
    """A ca_scene_source, with all that it points to."""

    def __init__(self, text, path, defines=None, meshes=(), bitmaps=(), previous=None, sensor=0):
        self.kept, self.sensor = [previous], sensor
        self.struct = ffi.new("ca_scene_source *")
        if isinstance(sensor, str):
            self.struct.camera = self._text(sensor)
        else:
            self.struct.sensor = sensor
        self.struct.text, self.struct.size = (self._text(text), len(text.encode())) if text is not None else (ffi.NULL, 0)
        self.struct.path = self._path(path)
        self.struct.previous = previous._pointer if previous is not None else ffi.NULL
        self.struct.defines, self.struct.define_count = self._defines(defines or {})
        self.struct.meshes, self.struct.mesh_count = self._meshes(meshes)
        self.struct.bitmaps, self.struct.bitmap_count = self._bitmaps(bitmaps)

    def _keep(self, cdata):
        self.kept.append(cdata)
        return cdata

    def _text(self, text):
        return self._keep(ffi.new("char[]", text.encode()))

    def _path(self, path):
        return self._keep(ffi.new("char[]", os.fsencode(path)))

    def _numbers(self, kind, array):
        return ffi.NULL if array is None else self._keep(ffi.from_buffer(f"{kind}[]", array))

    def _defines(self, defines):
        list_ = self._keep(ffi.new("ca_define[]", len(defines)))
        for define, (name, value) in zip(list_, defines.items()):
            text = str(value).lower() if isinstance(value, bool) else str(value)
            define.name, define.value = self._text(name), self._text(text)
        return list_, len(defines)

    def _meshes(self, meshes):
        list_ = self._keep(ffi.new("ca_mesh_data[]", len(meshes)))
        for index, (data, mesh) in enumerate(zip(list_, meshes)):
            data.name = self._text(f"array-{index + 1}")
            data.vertex_count, data.triangle_count = len(mesh.vertices), len(mesh.faces)
            data.positions, data.indices = self._numbers("float", mesh.vertices), self._numbers("uint32_t", mesh.faces)
            data.normals, data.uvs = self._numbers("float", mesh.normals), self._numbers("float", mesh.uvs)
            if not mesh.copy:
                data.release = lib.caustica_release
                data.release_user = _lend(mesh.vertices, mesh.faces, mesh.uvs)
        return list_, len(meshes)

    def _bitmaps(self, bitmaps):
        list_ = self._keep(ffi.new("ca_bitmap_data[]", len(bitmaps)))
        for index, (data, pixels) in enumerate(zip(list_, bitmaps)):
            data.name = self._text(f"array-{index + 1}")
            data.height, data.width, data.channels = pixels.shape
            data.pixels = self._numbers("float", pixels)
        return list_, len(bitmaps)


def _make(source, parse):
    error, scene = new_error(), ffi.new("ca_scene **")
    with interruptible() as source.struct.stop:
        status = parse(source.struct, scene, error)
    check(status, error)
    return Scene(scene[0], source.sensor)


#: What messages call the text of a dictionary; relative file names start in the current folder.
_NAME = "load_dict"


def _from_document(document, parse, previous=None, sensor=0):
    try:
        source = _Source(document.text, _NAME, meshes=document.meshes, bitmaps=document.bitmaps, previous=previous, sensor=sensor)
        return _make(source, parse)
    except Error as error:
        if error.file != _NAME:
            raise
        path = document.path_of(error.line)
        message = str(error).split(": ", 1)[1]
        told = type(error)(f"{path}: {message}" if path else message)
        told.path = path
        raise told from None


def load_file(path, parallel=True, optimize=True, *, sensor=0, previous=None, **defines):
    """Reads a scene, Mitsuba's XML, pbrt's or glTF, with its meshes and textures. Keyword arguments replace the values of the
    scene's <default name="..."> elements.

    sensor: of several, the number from 0, or the id.
    previous: a Scene that this one is the next version of: what is the same, meshes and pictures of files that did not change
        and the structures that rays are traced with, is shared instead of made again.
    parallel, optimize: accepted so that scripts for Mitsuba run; neither changes what the scene is."""
    return _make(_Source(None, os.fspath(path), defines, previous=previous, sensor=sensor), lib.ca_scene_parse)


def load_string(text, parallel=True, optimize=True, *, sensor=0, previous=None, **defines):
    """The same for a text of XML; relative file names start in the current folder."""
    return _make(_Source(text, "load_string", defines, previous=previous, sensor=sensor), lib.ca_scene_parse)


def load_dict(description, parallel=True, optimize=True, *, sensor=0, previous=None):
    """A scene from a dictionary, {"type": "scene", ...}: the form of Mitsuba 3's load_dict, with the plugins and parameters of
    docs/scenes.md. Values are numbers, texts, booleans, three numbers, ScalarTransform4f, {"type": "rgb", "value": [r, g, b]},
    {"type": "spectrum", ...}, {"type": "ref", "id": KEY}, dictionaries of objects, Mesh objects, and arrays of pixels as the
    "data" of a bitmap. Errors name the keys that lead to what is wrong. sensor, previous: as load_file has them; arrays are the same where
    their content is. Of a dictionary that is no scene, such as {"type": "diffuse"}, it is an Object, to be put into others.

    parallel, optimize: accepted so that scripts for Mitsuba run; neither changes what the scene is."""
    if not isinstance(description, dict) or "type" not in description:
        raise SceneError("a dictionary has the name of a plugin as \"type\"; that of a scene is \"scene\"")
    if description["type"] == "scene":
        return _from_document(Document(description), lib.ca_scene_parse, previous, sensor)
    made = Object(dict(description))
    around, keys = _around(made)
    _from_document(Document({"type": "scene", "sensor": _SENSOR, **around}, keys), lib.ca_scene_parse)  # tells what is wrong with it
    return made


_SENSOR = {"type": "perspective"}


def _around(made):
    """The entries of a scene in which an object can stand, and the keys that lead to it."""
    kind = made.description["type"]
    tag = tag_of(kind)
    if tag in ("film", "sampler"):
        return {"sensor": {**_SENSOR, tag: made}}, ("sensor", tag)
    if tag == "rfilter":
        return {"sensor": {**_SENSOR, "film": {"type": "hdrfilm", tag: made}}}, ("sensor", "film", tag)
    if kind in ("area", "directionalarea"):
        return {"shape": {"type": "sphere", "emitter": made}}, ("shape", "emitter")
    if kind in SPECTRA:
        return {"light": {"type": "constant", "radiance": made}}, ("light", "radiance")
    if tag == "texture":
        return {"bsdf": {"type": "diffuse", "reflectance": made}}, ("bsdf", "reflectance")
    return {("sensor" if tag == "sensor" else "object"): made}, ("object",)

