import mitsuba as mi

mi.set_variant("scalar_rgb")

scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "path"},
    "sensor": {
        "type": "thinlens",
        "fov": 35,
        "to_world": mi.ScalarTransform4f().look_at(origin=[0, 1, 6], target=[0, 0, 0], up=[0, 1, 0]),
        "focus_distance": 6.0,
        "aperture_radius": 0.2,
        "film": {"type": "hdrfilm", "width": 32, "height": 24, "rfilter": {"type": "gaussian", "stddev": 0.5}},
        "sampler": {"type": "multijitter", "sample_count": 64},
    },
    "light": {"type": "constant"},
    "near": {"type": "sphere", "center": [-1, 0, 2], "radius": 0.5},
    "far": {"type": "sphere", "center": [1, 0, -2], "radius": 0.5},
})
image = mi.render(scene)
