"""The scenes that `auto` is measured on: a name, and the file from the project's folder."""
SCENES = (
    ("bare wall", "scenes/weights/bare-wall.xml"),
    ("Cornell box", "scenes/cornell-box/cornell-box.xml"),
    ("mirror and glass", "scenes/speed/cornell-spheres.xml"),
    ("caustics", "scenes/caustics/caustics.xml"),
    ("lens", "scenes/weights/lens.xml"),
    ("glass slab", "scenes/glass-slab/glass-slab.xml"),
    ("pool", "scenes/paper-000/water-caustic.xml"),
    ("mirror room", "scenes/paper-004/mirror-room.xml"),
    ("rough metal", "scenes/weights/rough-metal.xml"),
    ("rough glass", "scenes/rough-glass/rough-glass.xml"),
    ("light through a gap", "scenes/weights/door.xml"),
    ("long diffuse", "scenes/long-diffuse/long-diffuse.xml"),
    ("small light, far", "scenes/small-light-far/small-light-far.xml"),
    ("wide lens", "scenes/depth-of-field/depth-of-field.xml"),
    ("textured", "scenes/textured/textured.xml"),
    ("behind glass", "scenes/paper-000/behind-glass.xml"),
)
