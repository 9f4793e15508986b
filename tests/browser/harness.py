"""What the tests of pages share: expectations, TAP, the program, and a scene with a ball on a floor."""

import subprocess
import traceback


def expect(condition, *what):
    if not condition:
        raise AssertionError(" ".join(str(each) for each in what))


def attempt(number, name, action):
    """Runs a test and says how it went, as TAP."""
    try:
        action()
        print(f"ok {number} - {name}", flush=True)
        return True
    except Exception:  # a test's failure, whatever it is
        print(f"not ok {number} - {name}")
        print("".join(f"# {line}\n" for line in traceback.format_exc().splitlines()[-6:]), end="", flush=True)
        return False


def name_of(test):
    return test.__name__[5:].replace("_", " ")


def run_program(program, folder, *words):
    """What the program printed; it must succeed."""
    done = subprocess.run([program, *words], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def ball_scene(width, height, max_depth=4, radiance="6", defaults=""):
    return f"""<scene version="3.0.0">{defaults}
  <integrator type="path"><integer name="max_depth" value="{max_depth}"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="30"/>
    <transform name="to_world"><lookat origin="0,2,8" target="0,0.8,0" up="0,1,0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
    <film type="hdrfilm"><integer name="width" value="{width}"/><integer name="height" value="{height}"/></film>
  </sensor>
  <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="9"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.6,0.5,0.4"/></bsdf></shape>
  <shape type="sphere"><point name="center" value="0,1,0"/><float name="radius" value="1"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.2,0.4,0.7"/></bsdf></shape>
  <shape type="sphere"><point name="center" value="2,5,2"/><float name="radius" value="1"/>
    <emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>
  <emitter type="constant"><rgb name="radiance" value="0.1,0.1,0.15"/></emitter>
</scene>
"""
