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
        "type": "spot",
        "to_world": mi.ScalarTransform4f().look_at(origin=[1, 4, 1], target=[0, -1, 0], up=[0, 0, 1]),
        "intensity": {"type": "rgb", "value": 30.0},
        "cutoff_angle": 25,
        "beam_width": 15,
    },
    "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, -1, 0]).rotate([1, 0, 0], -90).scale(4)},
})
image = mi.render(scene)
