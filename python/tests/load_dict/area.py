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
    "lamp": {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().translate([0, 3, 0]).rotate([1, 0, 0], 90),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [9.0, 8.0, 7.0]}},
    },
    "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, -1, 0]).rotate([1, 0, 0], -90).scale(4)},
    "ball": {"type": "sphere", "center": [0, -0.5, 0], "radius": 0.5},
})
image = mi.render(scene)
