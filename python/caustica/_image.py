"""Pictures: named channels as NumPy arrays."""
import functools
import os
import tempfile

import numpy as np

from caustica._errors import check, interruptible, new_error
from caustica._library import ffi, lib


def linear(values, raw=False):
    """Linear float32 values: bytes and 16-bit integers are sRGB, as they are in files, or with raw fractions of the largest; a
    fourth or second channel, which is alpha, is linear."""
    array = np.asarray(values)
    if array.dtype.kind not in "iu":
        return np.asarray(array, dtype=np.float32)
    if array.dtype.kind != "u" or array.dtype.itemsize > 2:
        raise ValueError(f"pixels of integers are uint8 or uint16, not {array.dtype}")
    made = (array / np.iinfo(array.dtype).max).astype(np.float32)
    if raw:
        return made
    colors = made[:, :, :-1] if array.ndim == 3 and array.shape[2] in (2, 4) else made
    colors[...] = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
    return made


def pixels_of(values, raw=False):
    """The same as (height, width, 1 to 4). ValueError: they are no picture."""
    array = linear(values._given if raw and isinstance(values, Bitmap) else values, raw)
    array = array[:, :, None] if array.ndim == 2 else array
    if array.ndim != 3 or not 1 <= array.shape[2] <= 4:
        raise ValueError(f"pixels have the shape (height, width), or 1 to 4 channels behind it, not {array.shape}")
    return array


class _Pixels:
    """Lends a channel's memory to NumPy and keeps its picture alive."""

    def __init__(self, image, pointer, shape):
        self.image = image
        self.__array_interface__ = {"shape": shape, "typestr": "<f4", "version": 3,
                                    "data": (int(ffi.cast("uintptr_t", pointer)), True)}


class Image:
    """A picture: linear Rec. 709 radiance in the channels "R", "G" and "B", and whatever else was measured of each
    pixel, such as "Variance.G" or "Albedo.R" (docs/images.md).

    image["G"] is a float32 array (height, width), row 0 on top: a view of the picture's own memory, read-only, which keeps
    the picture alive. np.asarray(image) and image.rgb are copies (height, width, 3)."""

    def __init__(self, pointer, tell_statistics=None):
        self._pointer = ffi.gc(pointer, lib.ca_image_release)
        self._tell_statistics = tell_statistics

    @functools.cached_property
    def statistics(self):
        """What the render that made it tells: a dict, or None."""
        return self._tell_statistics and self._tell_statistics()

    @staticmethod
    def load(path):
        """All channels of an EXR file; R, G and B of a PFM, HDR or PNG file."""
        error, image = new_error(), ffi.new("ca_image_layers **")
        with interruptible() as stop:
            status = lib.ca_image_load_until(os.fsencode(path), stop, image, error)
        check(status, error)
        return Image(image[0])

    @staticmethod
    def from_array(array):
        """Of an array (height, width), or (height, width, 1 to 4): grey or R, G, B, and alpha as the channel "A". Values are
        linear; those of uint8 and uint16 are sRGB."""
        array = pixels_of(array)
        error, image = new_error(), ffi.new("ca_image_layers **")
        check(lib.ca_image_make(array.shape[1], array.shape[0], image, error), error)
        made = Image(image[0])
        places = [0, 0, 0, 1] if array.shape[2] <= 2 else [0, 1, 2, 3]
        for index, name in zip(places, "RGBA" if array.shape[2] in (2, 4) else "RGB"):
            channel = np.ascontiguousarray(array[:, :, index])
            check(lib.ca_image_add(made._pointer, name.encode(), ffi.from_buffer("float[]", channel), error), error)
        return made

    @property
    def shape(self):
        """(height, width)"""
        size = ffi.new("uint32_t[2]")
        lib.ca_image_size(self._pointer, size, size + 1)
        return size[1], size[0]

    @property
    def height(self):
        """Rows of pixels."""
        return self.shape[0]

    @property
    def width(self):
        """Pixels of a row."""
        return self.shape[1]

    @property
    def channels(self):
        """The names of all channels, in the order of the file."""
        count = lib.ca_image_channel_count(self._pointer)
        return [_name(lib.ca_image_channel_name(self._pointer, i)) for i in range(count)]

    @property
    def attributes(self):
        """What is said of the picture, such as "caustica.integrator": a dict of texts and numbers."""
        found, index = {}, 0
        name, text, number = ffi.new("char **"), ffi.new("char **"), ffi.new("double *")
        while lib.ca_image_attribute(self._pointer, index, name, text, number):
            found[_name(name[0])] = ffi.string(text[0]).decode(errors="replace") if text[0] else number[0]
            index += 1
        return found

    def __contains__(self, name):
        return lib.ca_image_channel(self._pointer, name.encode(errors="surrogateescape")) != ffi.NULL

    def __getitem__(self, name):
        pointer = lib.ca_image_channel(self._pointer, name.encode(errors="surrogateescape"))
        if not pointer:
            raise KeyError(f"no channel \"{name}\"; there are {', '.join(self.channels)}")
        return np.asarray(_Pixels(self, pointer, self.shape))

    def layer(self, name):
        """The channels NAME.R, NAME.G and NAME.B: (height, width, 3)."""
        return np.stack([self[f"{name}.{c}"] for c in "RGB"], axis=2)

    @property
    def rgb(self):
        """R, G and B: float32 (height, width, 3), a copy; linear Rec. 709 radiance, in the units of the scene's lights."""
        return np.stack([self[c] for c in "RGB"], axis=2)

    @property
    def interval(self):
        """Low and high ends of the 95 % intervals of R, G and B: two arrays (height, width, 3); -inf and inf where nothing is
        known (docs/images.md). KeyError: the picture has none."""
        return self.layer("ConfidenceLow"), self.layer("ConfidenceHigh")

    def __array__(self, dtype=None, copy=None):
        if copy is False:
            raise ValueError("R, G and B are apart in memory: an array of all three is a copy")
        return self.rgb if dtype is None else self.rgb.astype(dtype)

    def save(self, path, exposure=0.0):
        """.exr (all channels), .png (sRGB, times 2^exposure) or .pfm; complete or not at all."""
        error = new_error()
        with interruptible() as stop:
            status = lib.ca_image_save_until(self._pointer, os.fsencode(path), exposure, stop, error)
        check(status, error)

    def _repr_png_(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "image.png")
            self.save(path)
            with open(path, "rb") as file:
                return file.read()

    def __repr__(self):
        return f"<caustica.Image of {self.width} x {self.height} pixels, {len(self.channels)} channels>"


def _name(text):
    """A file's name of something, which may be no UTF-8."""
    return ffi.string(text).decode(errors="surrogateescape")


def _with_alpha(image):
    return np.stack([image[c] for c in ("RGBA" if "A" in image else "RGB")], axis=2)


class Bitmap:
    """A picture from a file or an array (height, width[, 1 to 4]), as textures take it: linear float32 values, whatever the file
    or the array has; uint8 and uint16 are sRGB. np.asarray(bitmap) is its array. A texture with "raw" takes what the file or the
    array has as it is."""

    def __init__(self, source):
        self._file = os.path.abspath(source) if isinstance(source, (str, os.PathLike)) else None
        self._given = source if self._file is None else None
        self.array = linear(source if self._file is None else _with_alpha(Image.load(source)))

    def write(self, path):
        """To an .exr, .png or .pfm file."""
        write_bitmap(path, self.array)

    def __array__(self, dtype=None, copy=None):
        if copy is False and dtype is not None and np.dtype(dtype) != np.float32:
            raise ValueError(f"values are float32: an array of {np.dtype(dtype)} is a copy")
        return self.array.astype(dtype or np.float32, copy=bool(copy))

    def _repr_png_(self):
        return Image.from_array(self.array)._repr_png_()


def write_bitmap(filename, data, write_async=True, quality=-1):
    """Writes a picture, or an array as Image.from_array has it, to .exr, .png or .pfm; complete or not at all.

    write_async, quality: accepted so that scripts for Mitsuba run; the file is there when the call returns, and no format loses
    more than its own precision."""
    (data if isinstance(data, Image) else Image.from_array(data)).save(filename)


def compare(image, reference, region=None):
    """How much a picture differs from another one, in a region (x0, y0, x1, y1) of pixels, half open; None: everywhere. A dict
    with rmse, mae, relmse, smape, ssim, flip_ldr, flip_hdr, and a test block by block of what noise does not explain (blocks,
    blocks_rejected, p_value, detectable_bias); docs/metrics.md."""
    image, reference = (i if isinstance(i, Image) else Image.from_array(i) for i in (image, reference))
    error, difference = new_error(), ffi.new("ca_image_difference *")
    where = ffi.NULL if region is None else ffi.new("uint32_t[4]", list(region))
    with interruptible() as stop:
        status = lib.ca_image_compare_within(image._pointer, reference._pointer, where, stop, difference, error)
    check(status, error)
    return as_record(difference)


def as_record(struct):
    """A plain dict of a C struct: texts, numbers, lists and dicts."""
    if isinstance(struct, (bool, int, float)):
        return struct
    kind = ffi.typeof(struct)
    if kind.kind == "pointer" and kind.item.kind == "struct":
        struct, kind = struct[0], kind.item
    if kind.kind == "struct":
        return {name: as_record(getattr(struct, name)) for name, _ in kind.fields}
    if kind.cname == "char * *":
        return None  # a list, whose length is told elsewhere
    if kind.kind == "array" and kind.item.cname == "char" or kind.cname in ("char *", "const char *"):
        return ffi.string(struct).decode(errors="replace") if struct else None
    return [as_record(item) for item in struct]
