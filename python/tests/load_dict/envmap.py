import numpy as np
import mitsuba as mi

mi.set_variant("scalar_rgb")
sky = np.ones((16, 32, 3), np.float32) * np.linspace(2, 0.1, 16, dtype=np.float32)[:, None, None]

scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "path"},
    "sensor": {
        "type": "perspective",
        "fov": 45,
        "to_world": mi.ScalarTransform4f().look_at(origin=[0, 2, 6], target=[0, 0, 0], up=[0, 1, 0]),
        "film": {"type": "hdrfilm", "width": 32, "height": 24},
        "sampler": {"type": "independent", "sample_count": 64},
    },
    "sky": {"type": "envmap", "bitmap": mi.Bitmap(sky), "scale": 0.8},
    "ball": {"type": "sphere", "bsdf": {"type": "diffuse"}},
})
image = mi.render(scene)
