import numpy as np
import mitsuba as mi

mi.set_variant("scalar_rgb")
slide = np.full((32, 32, 3), [0.9, 0.5, 0.3], np.float32)

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
    "lamp": {
        "type": "projector",
        "irradiance": {"type": "bitmap", "bitmap": mi.Bitmap(slide), "raw": True},
        "fov": 40,
        "to_world": mi.ScalarTransform4f().look_at(origin=[0, 3, 4], target=[0, -1, 0], up=[0, 1, 0]),
        "scale": 4.0,
    },
    "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, -1, 0]).rotate([1, 0, 0], -90).scale(4)},
})
image = mi.render(scene)
