"""Rendering, and measuring noise."""
import contextlib
import dataclasses
import os

import numpy as np

from caustica._dict import Object
from caustica._errors import ArgumentError, check, interruptible, new_error
from caustica._image import Image, as_record
from caustica._library import ffi, lib


@dataclasses.dataclass
class Settings:
    """What to render with; None or 0 means "as the scene says". The names are those of render()'s arguments. Can be
    pickled."""

    spp: int = 0
    seconds: float = 0.0
    noise: float = 0.0
    integrator: str | dict | Object | None = None
    sampler: str | None = None
    seed: int | None = None
    size: tuple[int, int] | None = None
    crop: tuple[int, int, int, int] | None = None
    max_depth: int | None = None
    radius: float = 0.0
    alpha: float | None = None
    light_paths: int = 0
    camera_paths: int = 0
    rays: str | os.PathLike | None = None
    rays_objective: str | None = None
    replicates: int = 0
    memory: float = 0.0
    threads: int = 0


# Numbers of ca_render_settings, and what Settings calls them.
_NUMBERS = {"samples_per_pixel": "spp", "seconds": "seconds", "noise_percent": "noise", "seed": "seed", "max_depth": "max_depth",
            "alpha": "alpha", "radius": "radius", "light_paths": "light_paths", "camera_paths": "camera_paths",
            "replicates": "replicates", "memory_mib": "memory", "threads": "threads"}


class _Call:
    """A ca_render_settings with its texts and its progress callback."""

    def __init__(self, settings, progress):
        self.progress, self.exception, self.kept = progress, None, []
        self.struct = s = ffi.new("ca_render_settings *")
        lib.ca_render_settings_init_sized(s, ffi.sizeof("ca_render_settings"))
        for name, called in _NUMBERS.items():
            self._number(name, called, getattr(settings, called) or 0)
        s.integrator, s.sampler = self._text(settings.integrator), self._text(settings.sampler)
        s.rays, s.rays_objective = self._text(settings.rays), self._text(settings.rays_objective)
        s.has_seed = settings.seed is not None
        if settings.size is not None:
            s.width, s.height = settings.size
        if settings.crop is not None:
            s.has_crop, s.crop = True, list(settings.crop)
        s.has_max_depth, s.has_alpha = settings.max_depth is not None, settings.alpha is not None
        self.handle = ffi.new_handle(self)
        s.progress, s.progress_user = lib.caustica_progress, self.handle

    def _number(self, name, called, value):
        try:
            setattr(self.struct, name, value)
        except OverflowError:
            raise ArgumentError(f"{called} {value} is out of range") from None
        except TypeError:
            raise TypeError(f"{called} must be a number, not {value!r}") from None

    def _text(self, text):
        if text is None:
            return ffi.NULL
        self.kept.append(ffi.new("char[]", os.fsencode(text)))
        return self.kept[-1]

    def report(self, progress):
        if self.progress is None:
            return True
        return self.progress({name: as_record(getattr(progress, name)) for name in _TOLD}) is not False

    def check(self, status, error):
        if self.exception is not None:
            raise self.exception
        check(status, error)


_TOLD = ("passes_done", "passes_total", "seconds", "seconds_total", "seconds_predicted", "noise_percent", "noise_target",
         "method")


def _keep_exception(_kind, exception, traceback):
    """It ends the render and is raised again by check(). Ctrl-C may arrive at any line."""
    ffi.from_handle(traceback.tb_frame.f_locals["user"]).exception = exception


@ffi.def_extern(error=False, onerror=_keep_exception)
def caustica_progress(progress, user):
    return ffi.from_handle(user).report(progress)


class _Bar:
    """A tqdm bar of the fraction done: of passes or seconds, or of the time that a noise target takes (noise falls with its
    root)."""

    def __init__(self):
        from tqdm.auto import tqdm
        self.bar = tqdm(total=1.0, bar_format="{l_bar}{bar}| {elapsed}{postfix}")

    def __call__(self, told):
        done = [told["passes_done"] / told["passes_total"] if told["passes_total"] else 0.0,
                told["seconds"] / told["seconds_total"] if told["seconds_total"] else 0.0,
                (told["noise_target"] / told["noise_percent"]) ** 2 if told["noise_percent"] > 0.0 else 0.0]
        self.bar.update(max(self.bar.n, min(1.0, max(done))) - self.bar.n)
        if told["noise_percent"] >= 0.0:
            self.bar.set_postfix_str(f"noise {told['noise_percent']:.3g} %")


@contextlib.contextmanager
def _callback(progress):
    """Gives a function, or None. True means a bar, where tqdm is installed."""
    bar = None
    if progress is True:
        with contextlib.suppress(ImportError):
            bar = _Bar()
    try:
        yield bar if progress is True else progress or None
    finally:
        if bar:
            bar.bar.close()


def _integrator(value):
    """As the library has it: a text such as "path:max_depth=4" of a dictionary or an object of load_dict()."""
    value = value.description if isinstance(value, Object) else value
    if not isinstance(value, dict):
        return value
    parameters = {key: str(v).lower() if isinstance(v, (bool, np.bool_)) else str(v)
                  for key, v in value.items() if key not in ("type", "id")}
    nested = [key for key, v in value.items() if isinstance(v, (dict, Object))]
    if "type" not in value or nested:
        raise ArgumentError(f"an integrator within another one is only read in a scene: {', '.join(nested)}" if nested else
                            "an integrator has its name as \"type\"")
    return value["type"] + (":" if parameters else "") + ",".join(f"{key}={text}" for key, text in parameters.items())


def _seen_by(scene, sensor):
    """A scene seen by another sensor: a dictionary or an object of load_dict(). A number is that which it was loaded with."""
    if sensor is None:
        return scene
    if isinstance(sensor, (int, np.integer)):
        if sensor != scene.sensor:
            raise ArgumentError(f"the scene was loaded with sensor {scene.sensor}: load it with sensor={sensor}")
        return scene
    return scene.with_sensor(sensor)


def _settings(settings, changes):
    unknown = set(changes) - {field.name for field in dataclasses.fields(Settings)}
    if unknown:
        raise TypeError(f"no setting is called {', '.join(sorted(unknown))}; there are "
                        f"{', '.join(field.name for field in dataclasses.fields(Settings))}")
    if changes.get("spp") == 0:
        raise ArgumentError("spp 0: there must be 1 sample per pixel at least; None: as the scene says")
    made = dataclasses.replace(settings or Settings(), **{k: v for k, v in changes.items() if v is not None})
    return dataclasses.replace(made, integrator=_integrator(made.integrator))


def _statistics(struct):
    """A function that makes a dict of ca_render_statistics: longer work than a small render, and few ask. Notes live as long
    as the scene, so that they are copied here."""
    notes = [ffi.string(struct.notes[i]).decode() for i in range(struct.note_count)]

    def tell():
        told = as_record(struct)
        del told["note_count"]
        told["notes"] = notes
        method = told["method"]
        method["trials"] = method["trials"][:method.pop("trial_count")]
        return told
    return tell


def render(scene, settings=None, *, sensor=None, progress=None, **changes):
    """Renders a scene to an Image.

    settings: a Settings, which the keyword arguments change:
        spp          camera paths per pixel, 1 at least
        seconds      stop after the pass in which this much time is reached
        noise        stop when the relative standard error of the image is below this many percent
        integrator   "auto", "path", "ovcm:max_depth=8,radius=0.01", ..., or a dictionary {"type": "path", "max_depth": 4}
        sampler      "independent", "halton", "sobol", ...
        seed         another one makes an independent picture
        size         (width, height) of the full film
        crop         (x0, y0, x1, y1), half open, in pixels of the full film
        max_depth, radius, alpha, light_paths, camera_paths, rays, rays_objective, replicates
                     as the options of `caustica render`
        memory       MiB for film and light paths
        threads      0: one per processor; the picture does not depend on it, to the bit
    sensor: a dictionary or an Object: the scene is seen by this sensor instead. A number: that which it was loaded with.
    progress: True for a bar (where tqdm is installed), or a function that is called after each pass with a dict
        (passes_done, passes_total, seconds, noise_percent, ...) and may return False to end the render.

    The picture's `statistics` tell what the render was. Ctrl-C ends it at once and raises KeyboardInterrupt. Other
    threads of Python go on meanwhile."""
    scene = _seen_by(scene, sensor)
    error, image, statistics = new_error(), ffi.new("ca_image_layers **"), ffi.new("ca_render_statistics *")
    with _callback(progress) as told:
        call = _Call(_settings(settings, changes), told)
        with interruptible() as call.struct.stop:
            call.struct.discard = call.struct.stop  # after Ctrl-C there is nobody to whom the picture could be given
            status = lib.ca_render(scene._pointer, call.struct, image, statistics, error)
    made = Image(image[0], _statistics(statistics)) if image[0] else None
    call.check(status, error)
    return made


def preflight(scene, settings=None, *, sensor=None, **changes):
    """What can be said of a render before it is made, with the settings of render(): a dict. `warnings` are sentences, as the
    program prints them; `lost_light` is the share of the picture's light that the integrator will find none or too little of,
    with its 95 % interval (NaN: not known). Takes 0.02 to 0.3 s of one thread."""
    scene = _seen_by(scene, sensor)
    error, told = new_error(), ffi.new("ca_preflight *")
    call = _Call(_settings(settings, changes), None)
    with interruptible() as call.struct.stop:
        status = lib.ca_preflight_make(scene._pointer, call.struct, told, error)
    call.check(status, error)
    record = as_record(told)
    record["warnings"] = record["warnings"][:record.pop("warning_count")]
    return record


class Noise:
    """Where the noise of a scene comes from: the result of measure_noise()."""

    def __init__(self, scene, call, pointer, image, statistics):
        self._scene, self._call = scene, call
        self._pointer = ffi.gc(pointer, lib.ca_noise_release)
        #: The picture, with the layers Noise.*.
        self.image = Image(image, _statistics(statistics))

    def average(self, light_paths, camera_paths, region=None):
        """What is predicted for other numbers of paths: a dict of averages over the pixels of a region (x0, y0, x1, y1), half
        open; None: of all."""
        error, summary = new_error(), ffi.new("ca_noise_summary *")
        where = ffi.NULL if region is None else ffi.new("uint32_t[4]", list(region))
        check(lib.ca_noise_average(self._pointer, where, light_paths, camera_paths, summary, error), error)
        return as_record(summary)

    def recommend(self, objective=None):
        """The numbers of paths with the least noise after a given time, as a dict; the picture gets a map of camera paths,
        Rays.Numbers. objective: "mean", "relative" or "worst-decile". Where paths connect (bdpt, vcm, ...) the light paths are
        among those that were measured for, and there is no map."""
        error, found = new_error(), ffi.new("ca_noise_recommendation *")
        text = ffi.NULL if objective is None else ffi.new("char[]", objective.encode())
        with interruptible() as self._call.struct.stop:
            status = lib.ca_noise_recommend(self._pointer, self._scene._pointer, self._call.struct, text, self.image._pointer,
                                            found, error)
        self._call.check(status, error)
        return as_record(found)


def measure_noise(scene, iterations, settings=None, *, counts=(), progress=None, **changes):
    """Measures the components of the noise in so many iterations (>= 2) of `bdpm`, `ppm`, `bdpt`, `vcm`, `ovcm` or `vavcm`, with
    the settings of render() that do not end one. Returns a Noise.

    counts: pairs of numbers (light_paths, camera_paths). Where paths connect, their weights depend on these numbers: average()
    is right for those measured with and for these, and recommend() chooses among them. Each takes 168 bytes a pixel and a
    quarter of an iteration's time."""
    error, noise = new_error(), ffi.new("ca_noise **")
    image, statistics = ffi.new("ca_image_layers **"), ffi.new("ca_render_statistics *")
    others = ffi.new("ca_noise_counts[]", [tuple(map(int, pair)) for pair in counts])
    with _callback(progress) as told:
        call = _Call(_settings(settings, changes), told)
        with interruptible() as call.struct.stop:
            call.struct.discard = call.struct.stop
            status = lib.ca_noise_measure_for(scene._pointer, call.struct, iterations, others, len(others), noise, image,
                                              statistics, error)
    made = Noise(scene, call, noise[0], image[0], statistics) if noise[0] else None
    call.check(status, error)
    return made
