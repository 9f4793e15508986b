import pytest

import caustica


def description(**objects):
    """A square on the floor under a point light, seen from the front, with other objects beside it."""
    T = caustica.ScalarTransform4f
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4},
        "sensor": {
            "type": "perspective",
            "fov": 40,
            "to_world": T().look_at(origin=[0, 1, -4], target=[0, 0, 0], up=[0, 1, 0]),
            "film": {"type": "hdrfilm", "width": 24, "height": 16},
            "sampler": {"type": "independent", "sample_count": 4},
        },
        "floor": {"type": "rectangle", "to_world": T().translate([0, -1, 0]).rotate([1, 0, 0], -90).scale(4)},
        "light": {"type": "point", "position": [2, 3, -2], "intensity": 20.0},
        **objects,
    }


@pytest.fixture(scope="session")
def scene():
    return caustica.load_dict(description())


@pytest.fixture(scope="session")
def image(scene):
    return caustica.render(scene, spp=16, threads=1)
