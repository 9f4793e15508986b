import mitsuba as mi

mi.set_variant("scalar_rgb")

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
        "type": "roughconductor",
        "material": "Al",
        "distribution": "ggx",
        "alpha_u": 0.05,
        "alpha_v": 0.3,
    }},
})
image = mi.render(scene)
