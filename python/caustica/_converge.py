"""How fast integrators converge: renders of several lengths against a reference, as `caustica converge` makes them."""
import math

from caustica._image import compare
from caustica._render import render

_METRICS = ("rmse", "mae", "relmse", "smape", "ssim", "flip_ldr", "flip_hdr")


def converge(scene, reference, integrators, *, spp=(), seconds=(), repeats=1, seed=None, settings=None, progress=None, **changes):
    """Renders a scene with each integrator for each of several lengths, and measures the pictures against a reference.

    reference: an Image or an array (height, width, 3).
    integrators: texts such as "path" or "ovcm:max_depth=8".
    spp or seconds: the lengths, as samples per pixel or as times.
    repeats: so many renders of each; all have random numbers of their own, which integrators share.
    seed: what these are made of; None: the scene's. settings and other arguments: as render() has them.
    progress: a function that is called with each record once it is made.

    Returns a list of dicts, one for each render, which pandas.DataFrame takes as it is: integrator, spp or time (the length),
    repeat (from 1), seed, seconds, samples_per_pixel, iterations, the metrics rmse, mae, relmse, smape, ssim, flip_ldr and
    flip_hdr, mean_luminance, mean_standard_deviation (of one iteration's pixel luminance; NaN: not known), and method, the integrator
    with all parameters, or what "auto" took. Names, seeds and pictures of `spp` are those of `caustica converge`."""
    if bool(len(spp)) == bool(len(seconds)):
        raise TypeError("converge() takes one of spp and seconds, a list of lengths")
    kind, unit, lengths = ("time", "s", seconds) if len(seconds) else ("spp", "spp", spp)
    if seed is None:
        seed = render(scene, spp=1, size=(1, 1), integrator="path").statistics["seed"]
    records = []
    for length in lengths:
        for integrator in integrators:
            for repeat in range(repeats):
                own = _seed(seed, repeat, f"{length:.12g} {unit}")
                image = render(scene, settings, integrator=integrator, seed=own,
                               **{"seconds" if unit == "s" else "spp": length}, **changes)
                records.append({"integrator": integrator, kind: length, "repeat": repeat + 1, "seed": own,
                                **_measured(image, reference)})
                if progress:
                    progress(records[-1])
    return records


def _measured(image, reference):
    told, found = image.statistics, compare(image, reference)
    record = {name: told[name] for name in ("seconds", "samples_per_pixel", "iterations")}
    record.update((name, found[name]) for name in (*_METRICS, "mean_luminance"))
    record["mean_standard_deviation"] = told["mean_standard_deviation"] if told["iterations"] >= 2 else math.nan
    record["method"] = image.attributes["caustica.integrator"]
    return record


def _seed(seed, repeat, step):
    """That of the program: a hash (src/base/hash.h) below 2^53."""
    data = step.encode()
    pieces = [data[i:i + 8] for i in range(0, len(data), 8)]
    if len(pieces[-1]) < 8:
        pieces[-1] = pieces[-1].ljust(7, b"\0") + bytes([len(pieces[-1])])
    made = 0x243F6A8885A308D3
    for value in (seed, repeat, *(int.from_bytes(piece, "little") for piece in pieces)):
        made = (made ^ value) * 0x9E3779B97F4A7C15 % 2**64
        made ^= made >> 29
    return made >> 11
