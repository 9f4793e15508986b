import mitsuba as mi

mi.set_variant("scalar_rgb")

scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "path"},
    "sensor": {
        "type": "orthographic",
        "to_world": mi.ScalarTransform4f().look_at(origin=[3, 3, 3], target=[0, 0, 0], up=[0, 1, 0]).scale([2, 2, 1]),
        "film": {"type": "hdrfilm", "width": 32, "height": 32, "crop_offset_x": 4, "crop_offset_y": 4, "crop_width": 16,
                 "crop_height": 16},
        "sampler": {"type": "stratified", "sample_count": 64},
    },
    "light": {"type": "constant"},
    "box": {"type": "cube", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.3, 0.6, 0.3]}}},
})
image = mi.render(scene)
