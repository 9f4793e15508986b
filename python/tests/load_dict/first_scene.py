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
    "sphere": {"type": "sphere", "bsdf": {"type": "diffuse"}},
})
image = mi.render(scene, spp=16)
mi.util.write_bitmap("first_scene.png", image)
