import numpy as np
import mitsuba as mi

mi.set_variant("scalar_rgb")
waves = 0.5 + 0.5 * np.sin(np.linspace(0, 60, 128))[:, None, None] * np.ones((1, 128, 1))

scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 6},
    "sensor": {
        "type": "perspective",
        "fov": 40,
        "to_world": mi.ScalarTransform4f().look_at(origin=[0, 1.5, 4], target=[0, 0, 0], up=[0, 1, 0]),
        "film": {"type": "hdrfilm", "width": 32, "height": 24, "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": 64},
    },
    "sky": {"type": "constant", "radiance": 0.5},
    "lamp": {"type": "point", "position": [2, 3, 3], "intensity": {"type": "rgb", "value": [12, 11, 10]}},
    "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, -1, 0]).rotate([1, 0, 0], -90).scale(4)},
    "ball": {"type": "sphere", "material": {
        "type": "bumpmap",
        "arbitrary": {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(waves.astype(np.float32))},
        "scale": 0.05,
        "bsdf": {"type": "roughplastic"},
    }},
})
image = mi.render(scene)
