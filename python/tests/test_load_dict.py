"""Scripts for Mitsuba 3 run with only the import changed: load_dict/*.py, in the manner of its documentation. What Mitsuba
3.9.1 (scalar_rgb) makes of each is told by the mean of its picture, which is noisy to half a percent (with
the rough dielectric, that of 4,096 samples)."""
import pathlib

import numpy as np
import pytest

SCRIPTS = pathlib.Path(__file__).resolve().parent / "load_dict"

#: Of R, G and B.
MEANS = {
    "area": [0.1107, 0.0984, 0.0861],
    "bitmap": [0.284, 0.2322, 0.202],
    "blendbsdf": [0.2687, 0.2487, 0.2417],
    "bumpmap": [0.3155, 0.3123, 0.309],
    "checkerboard": [0.3239, 0.3341, 0.4109],
    "conductor": [0.3871, 0.3523, 0.2579],
    "dielectric": [0.344, 0.3429, 0.3418],
    "diffuse": [0.2397, 0.2516, 0.3703],
    "directional": [0.2159, 0.2159, 0.1799],
    "envmap": [0.6541, 0.6541, 0.6541],
    "first_scene": [0.9228, 0.9228, 0.9228],
    "instances": [0.9996, 0.9996, 0.9996],
    "mask": [0.3639, 0.3, 0.2759],
    "normalmap": [0.322, 0.3188, 0.3155],
    "orthographic": [0.4022, 0.6582, 0.4022],
    "plastic": [0.2378, 0.2767, 0.2955],
    "principled": [0.4416, 0.2903, 0.2643],
    "projector": [0.0177, 0.0098, 0.0059],
    "references": [0.8883, 0.6857, 0.6857],
    "roughconductor": [0.3889, 0.3828, 0.3794],
    "roughdielectric": [0.355, 0.3533, 0.3516],
    "roughplastic": [0.239, 0.2374, 0.2358],
    "spot": [0.0396, 0.0396, 0.0396],
    "thindielectric": [0.3602, 0.3592, 0.3583],
    "thinlens": [0.912, 0.912, 0.912],
    "twosided": [0.2954, 0.2925, 0.2896],
}


def test_all_are_here():
    assert len(MEANS) >= 20 and {path.stem for path in SCRIPTS.glob("*.py")} == set(MEANS)


@pytest.mark.parametrize("name", MEANS)
def test_script(name, tmp_path, monkeypatch):
    text = (SCRIPTS / f"{name}.py").read_text()
    assert text.count("import mitsuba as mi\n") == 1 and text.count("mitsuba") == 1
    monkeypatch.chdir(tmp_path)
    made = {}
    exec(compile(text.replace("import mitsuba as mi", "import caustica as mi"), name, "exec"), made)
    picture = np.array(made["image"])
    assert picture.ndim == 3 and picture.shape[2] == 3
    assert np.allclose(picture.mean((0, 1)), MEANS[name], rtol=0.02)
