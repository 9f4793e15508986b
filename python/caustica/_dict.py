"""Scenes from dictionaries: load_dict's form becomes the text and the arrays that the library reads.

An object is a dictionary with its plugin's name as "type"; the other entries are its parameters and the objects in it.
References name an object by its "id", or by the keys that lead to it with dots between them. Each opening tag of the text is
on a line of its own, and the lines remember the keys that led there, so that an error names them."""
import os
from xml.sax.saxutils import quoteattr

import numpy as np

from caustica._errors import SceneError
from caustica._image import Bitmap, Image, pixels_of
from caustica._transform import ScalarTransform4f

#: Colours that are plugins.
_COLOR_PLUGINS = ("d65", "uniform", "regular", "irregular", "blackbody", "rawconstant", "srgb")
#: All types of a colour.
SPECTRA = ("rgb", "spectrum", *_COLOR_PLUGINS)

#: Which element a plugin is written as.
TAGS = {
    "scene": ["scene"],
    "integrator": ["auto", "path", "light", "bdpt", "ppm", "bdpm", "vcm", "vcm-plus", "vcm-star", "ovcm", "cavcm", "vavcm",
                   "qmcppm", "direct", "volpath", "volpathmis", "ptracer", "moment", "aov", "depth", "sppm", "photonmapper", "vpl",
                   "prb", "prb_basic", "prbvolpath", "prb_projective", "direct_projective",
                   "pssmlt", "mlt", "erpt", "adaptive", "irrcache"],
    "sensor": ["perspective", "thinlens", "orthographic", "realistic", "batch", "radiancemeter", "distant"],
    "film": ["hdrfilm", "ldrfilm", "mfilm"],
    "rfilter": ["box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"],
    "sampler": ["independent", "halton", "halton-plain", "sobol", "sobol-plain", "sobol-image", "sobol-tiles",
                "sobol-tiles-plain", "zsobol", "lattice", "lattice-plain", "lattice-image", "lattice-tiles",
                "lattice-tiles-plain",
                "stratified", "multijitter", "orthogonal", "ldsampler", "hammersley"],
    "shape": ["rectangle", "cube", "sphere", "disk", "cylinder", "obj", "ply", "serialized", "mesh", "shapegroup", "instance",
              "merge", "bsplinecurve", "linearcurve", "heightfield", "sdfgrid"],
    "bsdf": ["diffuse", "dielectric", "thindielectric", "roughdielectric", "conductor", "roughconductor", "plastic",
             "roughplastic", "principled", "null", "twosided", "mask", "blendbsdf", "bumpmap", "normalmap",
             "roughconductorGGX", "roughdielectricGGX", "phong", "roughdiffuse", "mixturebsdf", "difftrans",
             "ward", "principledthin", "coating", "roughcoating"],
    "emitter": ["area", "directionalarea", "point", "spot", "directional", "constant", "envmap", "projector"],
    "texture": ["bitmap", "checkerboard", "scale", "mix", "power", "clamp", "facing", "mapped", "mesh_attribute", "vertexcolors",
                *_COLOR_PLUGINS],
}
_TAG_OF = {name: tag for tag, names in TAGS.items() for name in names}


def _quoted(text):
    """As the value of an attribute, in which $ would begin the name of a definition."""
    return quoteattr(text.replace("$", "\\$"))


def tag_of(plugin):
    """None: there is no such plugin."""
    return _TAG_OF.get(plugin)


class Object:
    """One object that load_dict() made of a dictionary without a scene around it. It goes where its dictionary could: into
    other dictionaries, and to render() as `sensor` or `integrator`."""

    def __init__(self, description):
        self.description = description

    def __repr__(self):
        return f"<caustica.Object {self.description['type']}>"


class Mesh:
    """Triangles from arrays, to be put into a scene's dictionary.

    vertices (n, 3) in the mesh's own space; faces (m, 3), indices of vertices, counterclockwise seen from outside; normals
    (n, 3) or None: smooth ones are made; uvs (n, 2) or None. Other arguments are the parameters and objects of a shape:
    bsdf={...}, emitter={...}, to_world=..., face_normals=True.

    copy=False: scenes use the arrays (float32, and uint32 for faces; others are converted first) where they are, if they can
    (positions only without to_world); the arrays are kept alive, and must not change while such a scene is there."""

    def __init__(self, vertices, faces, normals=None, uvs=None, copy=True, **parameters):
        self.copy = copy
        self.vertices = _rows(vertices, np.float32, 3, "vertices")
        self.faces = _rows(faces, np.uint32, 3, "faces")
        self.normals = None if normals is None else _rows(normals, np.float32, 3, "normals")
        self.uvs = None if uvs is None else _rows(uvs, np.float32, 2, "uvs")
        for name, array in (("normals", self.normals), ("uvs", self.uvs)):
            if array is not None and len(array) != len(self.vertices):
                raise ValueError(f"{len(array)} {name} for {len(self.vertices)} vertices")
        self.parameters = parameters


def _rows(array, kind, columns, name):
    given = np.asarray(array)
    if kind == np.uint32 and given.size and (given.dtype.kind not in "iu" or given.min() < 0 or given.max() >= 2**32):
        raise ValueError(f"{name} are indices, which are integers, not negative and below 2^32")
    array = np.ascontiguousarray(given, dtype=kind)
    if array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"{name} have the shape (n, {columns}), not {array.shape}")
    return array


class Document:
    """The text of a dictionary, and the arrays that the text names."""

    def __init__(self, description, unsaid=()):
        """unsaid: keys at the beginning that paths do not tell."""
        self.lines, self.paths = [], []
        self.unsaid = len(unsaid)
        self.meshes, self.bitmaps = [], []
        self.references = _References(description)
        self._open('<scene version="3.0.0">', ())
        for key, value in description.items():
            if key != "type":
                self._add(key, value, (key,), "")
        self._open("</scene>", ())

    @property
    def text(self):
        return "\n".join(self.lines)

    def path_of(self, line):
        """The keys that lead to what is on a line (from 1), with dots between them."""
        return self._told(self.paths[line - 1]) if 0 < line <= len(self.paths) else ""

    def _told(self, path):
        return ".".join(map(str, path[self.unsaid:]))

    def _open(self, line, path):
        self.lines.append(line)
        self.paths.append(path)

    def _fail(self, path, message):
        told = self._told(path)
        error = SceneError(f"{told}: {message}" if told else message)
        error.path = told
        raise error

    def _array(self, arrays, array):
        arrays.append(array)
        return f"array-{len(arrays)}"

    def _add(self, key, value, path, naming):
        if isinstance(value, Mesh):
            self._add_object({"type": "mesh", "data": value, **value.parameters}, path, naming)
        elif isinstance(value, (Bitmap, Image)):
            self._add_object({"type": "bitmap", "data": value}, path, naming)
        elif isinstance(value, (dict, Object)):
            self._add_object(_plain(value), path, naming)
        else:
            self._add_value(key, value, path)

    # ---- Objects -------------------------------------------------------------------------------------------------------

    def _add_object(self, value, path, naming):
        kind = value.get("type")
        if kind in ("rgb", "spectrum"):
            return self._add_color(kind, value, path)
        if kind == "ref":
            if "id" not in value:
                self._fail(path, "a reference has the id of an object as \"id\"")
            return self._open(f"<ref {naming} id={_quoted(self.references.resolve(str(value['id'])))}/>", path)
        if kind == "resources":
            if "path" not in value:
                self._fail(path, "resources have a folder as \"path\"")
            return self._open(f"<path value={_quoted(os.fspath(value['path']))}/>", path)
        if kind is None:
            self._fail(path, "\"type\" is missing: the name of a plugin")
        if kind not in _TAG_OF:
            nearest = _nearest(str(kind), _TAG_OF)
            self._fail(path, f"there is no plugin \"{kind}\"; the nearest known one is \"{nearest}\"")
        tag = _TAG_OF[kind]
        name = self.references.name_of(value, path)
        self._open(f'<{tag} type="{kind}" {naming}{f" id={_quoted(name)}" if name else ""}>', path)
        for key, inner in value.items():
            if key in ("type", "id"):
                continue
            if kind in ("bitmap", "envmap") and key in ("bitmap", "data"):
                self._add_bitmap(inner, bool(value.get("raw", False)), (*path, key))
            elif kind == "mesh" and key == "data":
                name = self._array(self.meshes, inner)
                self._open(f'<string name="data" value="{name}"/>', (*path, key))
            else:
                self._add(key, inner, (*path, key), f"name={_quoted(key)}")
        return self._open(f"</{tag}>", path)

    def _add_bitmap(self, value, raw, path):
        if raw and isinstance(value, Bitmap) and value._file:
            return self._open(f'<string name="filename" value={_quoted(value._file)}/>', path)
        try:
            array = np.ascontiguousarray(pixels_of(value, raw))
        except ValueError as error:
            self._fail(path, str(error))
        return self._open(f'<string name="data" value="{self._array(self.bitmaps, array)}"/>', path)

    def _add_color(self, kind, value, path):
        given = value.get("value", 1.0)
        if kind == "spectrum" and "filename" in value:
            return self._open(f'<spectrum name="{path[-1]}" filename={_quoted(str(value["filename"]))}/>', path)
        try:
            numbers = np.asarray(given, dtype=float)
        except (TypeError, ValueError):
            numbers = np.empty((0, 0))
        if kind == "spectrum" and numbers.ndim == 2 and numbers.shape[1] == 2:
            text = ", ".join(f"{float(wavelength)!r}:{float(v)!r}" for wavelength, v in numbers)
        elif numbers.shape in ((), (1,), (3,)):
            text = ", ".join(repr(float(v)) for v in np.atleast_1d(numbers))
        else:
            self._fail(path, "a colour is one number or three" + (", or pairs of a wavelength and a value"
                                                                  if kind == "spectrum" else "") + f", not {given!r:.80}")
        return self._open(f'<{kind} name="{path[-1]}" value="{text}"/>', path)

    # ---- Values --------------------------------------------------------------------------------------------------------

    def _add_value(self, key, value, path):
        name = f"name={_quoted(key)}"
        if isinstance(value, (bool, np.bool_)):
            self._open(f'<boolean {name} value="{str(bool(value)).lower()}"/>', path)
        elif isinstance(value, (int, np.integer)):
            self._open(f'<integer {name} value="{int(value)}"/>', path)
        elif isinstance(value, (float, np.floating)):
            self._open(f'<float {name} value="{float(value)!r}"/>', path)
        elif isinstance(value, (str, os.PathLike)):
            self._open(f"<string {name} value={_quoted(os.fspath(value))}/>", path)
        elif isinstance(value, ScalarTransform4f) or np.shape(value) == (4, 4):
            numbers = " ".join(repr(float(v)) for v in ScalarTransform4f(value).matrix.flat)
            self._open(f'<transform {name}><matrix value="{numbers}"/></transform>', path)
        elif np.shape(value) == (3,):
            self._open(f'<point {name} value="{", ".join(repr(float(v)) for v in value)}"/>', path)
        else:
            self._fail(path, f"a parameter is a number, a text, three numbers, a transform or a dictionary, not {value!r:.80}")


class _References:
    """What references call the objects of a scene: each name, and the identifier that the text has for it."""

    def __init__(self, description):
        self.wanted, self.given, self.objects = set(), set(), {}
        self._find(description, ())
        self.wanted = {self.resolve(name) for name in self.wanted}

    def _find(self, value, path):
        """All references and all objects, by the keys that lead there."""
        if value.get("type") == "ref":
            self.wanted.add(str(value.get("id")))
        elif path:
            self.objects[".".join(map(str, path))] = value
            self.given |= {str(value["id"])} if "id" in value else set()
        for key, inner in value.items():
            inner = inner.parameters if isinstance(inner, Mesh) else _plain(inner)
            if isinstance(inner, dict):
                self._find(inner, (*path, key))

    def resolve(self, name):
        """The identifier for the "id" of a reference."""
        if name in self.given or name not in self.objects:
            return name
        return str(self.objects[name].get("id", name))

    def name_of(self, value, path):
        """An object's own identifier, or the keys that lead there if something refers to it or they are one; else None."""
        name = str(value.get("id", ".".join(map(str, path))))
        return name if "id" in value or len(path) == 1 or name in self.wanted else None


def _plain(value):
    return value.description if isinstance(value, Object) else value


def _nearest(word, names):
    import difflib
    return difflib.get_close_matches(word, names, 1, 0.0)[0]
