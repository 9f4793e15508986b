import mitsuba as mi

mi.set_variant("scalar_rgb")

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
    "light": {"type": "constant"},
    "red": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.7, 0.1, 0.1]}},
    "disk": {"type": "disk", "to_world": mi.ScalarTransform4f().scale(1.5), "bsdf": {"type": "ref", "id": "red"}},
    "rod": {"type": "cylinder", "p0": [-1.5, 0, 1], "p1": [1.5, 0.5, 1], "radius": 0.2, "bsdf": {"type": "ref", "id": "red"}},
})
image = mi.render(scene)
