"""Caustica: a physically based renderer for light through glass and mirrors, which knows its own noise.

    import caustica
    scene = caustica.load_file("scene.xml")
    image = caustica.render(scene, spp=64)
    image.save("scene.exr")
    image["Variance.G"]         # a NumPy array (height, width)
"""
from caustica import util
from caustica._converge import converge
from caustica._dict import Mesh, Object
from caustica._errors import ArgumentError, Error, FileError, FormatError, OutOfMemory, SceneError, Unsupported
from caustica._image import Bitmap, Image, compare
from caustica._library import ffi as _ffi
from caustica._library import lib as _lib
from caustica._render import Noise, Settings, measure_noise, preflight, render
from caustica._scene import Scene, load_dict, load_file, load_string
from caustica._transform import ScalarTransform4f

__version__ = _ffi.string(_lib.ca_version()).decode()

__all__ = ["ArgumentError", "Bitmap", "Error", "FileError", "FormatError", "Image", "Mesh", "Noise", "Object",
           "OutOfMemory", "ScalarTransform4f", "Scene", "SceneError", "Settings", "Unsupported", "compare", "converge", "load_dict",
           "load_file", "load_string", "measure_noise", "preflight", "render", "set_variant", "util", "variant", "variants"]


def variants():
    """What set_variant accepts: Mitsuba's names for what is done here, RGB without gradients."""
    return ["scalar_rgb", "llvm_ad_rgb", "cuda_ad_rgb"]


def set_variant(*names):
    """Accepted so that scripts for Mitsuba run: all variants are the same here. Others than RGB are refused."""
    if not any(name in variants() for name in names):
        raise ArgumentError(f"no variant {' or '.join(names)}: this renderer works in RGB ({', '.join(variants())})")


def variant():
    """The one there is."""
    return "scalar_rgb"
