"""The page of `caustica render --serve` in a browser, while a render goes on: passes, layers, values, pause, save, stop. Speaks TAP.

live_page.py CAUSTICA FOLDER: the program, and where screenshots and images go."""

import math
import os
import re
import signal
import subprocess
import sys
import time

import exr
from browser import Browser
from harness import attempt, ball_scene, expect, name_of

CAUSTICA, FOLDER = sys.argv[1:3]
SCENE = ball_scene(96, 64)
PIXEL = (40, 30)


class Render:
    """A render that serves its page."""

    def __init__(self, *words):
        # One thread that steps back: the browser is to have the processors when it needs them.
        command = ["nice", "-n", "10", CAUSTICA, "render", "--threads", "1", "scene.xml", "--serve", *words]
        self.process = subprocess.Popen(command, cwd=FOLDER, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.url = re.search(r"http://\S+", self.process.stdout.readline()).group(0)

    def finish(self):
        output, errors = self.process.communicate(timeout=120)
        expect(self.process.returncode == 0, "exit status", self.process.returncode, errors)
        return output

    def kill(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.communicate()


def status(browser):
    return browser.run("return document.getElementById('status').textContent")


def shown_pass(browser):
    """Of the picture that is painted."""
    text = browser.run("const e = document.querySelector('.caption .right'); return e ? e.textContent : ''")
    found = re.search(r"(?:pass|block) (\d+)", text)
    return int(found.group(1)) if found else 0


def wait(browser, script, *arguments):
    return browser.wait(script, *arguments, seconds=90)


def press(browser, name):
    browser.run("document.getElementById(arguments[0]).click()", name)


def pick(browser, x, y):
    """Clicks on a pixel of the image, which is fitted into its pane."""
    place = browser.run("""const box = document.querySelector('.pane canvas').getBoundingClientRect(), [w, h, x, y] = arguments;
        const fit = Math.min(box.width / w, box.height / h), scale = fit >= 1 ? Math.floor(fit) : fit;
        return [box.left + box.width / 2 + (x + 0.5 - w / 2) * scale, box.top + box.height / 2 + (y + 0.5 - h / 2) * scale];""",
                        96, 64, x, y)
    browser.pointer(("move", *place), "down", "up")


def values(browser):
    """What the inspector shows of the kept pixel."""
    return browser.run("""const found = {};
        for (const cell of document.querySelectorAll('[data-channel]'))
            if (cell.dataset.channel) found[cell.dataset.channel] = cell.nextElementSibling.textContent.trim();
        return found;""")


def complaints(browser):
    return [entry for entry in browser.log() if entry["level"] in ("SEVERE", "WARNING")]


def compare_pixel(browser, path):
    """Every channel of the file against what the page shows."""
    width, _, channels = exr.read(path)
    at = PIXEL[1] * width + PIXEL[0]
    shown = values(browser)
    expect(set(channels) <= set(shown), "channels", sorted(set(channels) - set(shown)))
    for name, plane in channels.items():
        if math.isfinite(plane[at]):
            expect(float(shown[name]) == float(f"{plane[at]:.9g}"), name, shown[name], plane[at])
        else:
            expect(shown[name] in ("inf", "-inf", "NaN", "not finite"), name, shown[name], plane[at])
    return len(channels)


def test_a_render_to_its_end(browser):
    """Three passes seen, layers and values, pause, save; then stop, and the last picture is the file's."""
    render = Render("--spp", "1000000", "-o", "a.exr", "-o", "a.png")
    try:
        browser.open(render.url)
        seen = set()
        end = time.monotonic() + 120
        while len(seen) < 4 and time.monotonic() < end:
            seen.add(shown_pass(browser))
            time.sleep(0.05)
        seen.discard(0)
        print(f"# pictures seen: of the passes {', '.join(map(str, sorted(seen)))}")
        expect(len(seen) >= 3, seen)
        expect("rendering" in status(browser), status(browser))
        wait(browser, "return /noise [0-9.]+ %/.test(document.getElementById('status').textContent)")
        pick(browser, *PIXEL)

        press(browser, "pause")
        wait(browser, "return document.getElementById('status').textContent.startsWith('paused')")
        passes = int(re.search(r"pass (\d+)", status(browser)).group(1))
        press(browser, "save")
        wait(browser, "return document.getElementById('said').textContent.startsWith('saved a.exr, a.png with')")
        said = browser.run("return document.getElementById('said').textContent")
        expect(said == f"saved a.exr, a.png with {passes:.4g} sample{'' if passes == 1 else 's'} per pixel", said)
        wait(browser, "return document.querySelector('.caption .right').textContent.endsWith(` ${arguments[0]}`)", passes)
        wait(browser, "return document.querySelector('[data-channel=\"ConfidenceHigh.Y\"]').nextElementSibling.textContent.trim()")
        time.sleep(0.3)
        count = compare_pixel(browser, os.path.join(FOLDER, "a.exr"))
        print(f"# paused after pass {passes}: all {count} channels of the saved file's pixel are those of the page")
        browser.screenshot(os.path.join(FOLDER, "paused.png"))

        for key in ("noise", "relative-noise", "group:Albedo", "layer:N.X"):
            browser.run("const s = document.getElementById('layer'); s.value = arguments[0]; s.dispatchEvent(new Event('change'))", key)
            time.sleep(0.3)
            browser.screenshot(os.path.join(FOLDER, f"{key.replace(':', '-')}.png"))
        browser.run("const s = document.getElementById('layer'); s.value = 'color'; s.dispatchEvent(new Event('change'))")

        press(browser, "pause")
        wait(browser, "return document.getElementById('status').textContent.startsWith('rendering')")
        wait(browser, "return Number(/pass ([0-9]+)/.exec(document.querySelector('.caption .right').textContent)[1]) > arguments[0]",
             passes)
        os.remove(os.path.join(FOLDER, "a.exr"))
        press(browser, "stop")
        wait(browser, "return document.getElementById('status').textContent.startsWith('done')")
        output = render.finish()
        expect("ended early by the live view" in output, output)
        final = int(float(re.search(r"([\d.e+]+) samples? per pixel", output).group(1)))
        time.sleep(0.3)
        expect(abs(shown_pass(browser) - final) <= 0.0005 * final, shown_pass(browser), final)
        count = compare_pixel(browser, os.path.join(FOLDER, "a.exr"))
        print(f"# stopped at pass {shown_pass(browser)}: all {count} channels of the final file's pixel are those of the page")
        browser.run("const s = document.getElementById('layer'); s.value = 'relative-noise'; s.dispatchEvent(new Event('change'))")
        time.sleep(0.3)
        browser.screenshot(os.path.join(FOLDER, "done.png"))
        expect(not (found := complaints(browser)), found)
    finally:
        render.kill()


def test_blocks(browser):
    render = Render("-i", "qmcppm", "--spp", "1000000", "-o", "b.exr")
    try:
        browser.open(render.url)
        wait(browser, "return /block/.test((document.querySelector('.caption .right') || {}).textContent || '')")
        pick(browser, *PIXEL)
        press(browser, "stop")
        wait(browser, "return document.getElementById('status').textContent.startsWith('done')")
        render.finish()
        time.sleep(0.3)
        compare_pixel(browser, os.path.join(FOLDER, "b.exr"))
        expect(not (found := complaints(browser)), found)
    finally:
        render.kill()


def test_numbers_of_rays(browser):
    """Of --rays auto there is no picture before the pilot has ended; then it is that of the file."""
    render = Render("-i", "bdpm", "--rays", "auto", "--time", "8", "-o", "c.exr")
    try:
        browser.open(render.url)
        wait(browser, "return /pass/.test((document.querySelector('.caption .right') || {}).textContent || '')")
        pick(browser, *PIXEL)
        wait(browser, "return document.getElementById('status').textContent.startsWith('done')")
        expect("light paths" in status(browser), status(browser))
        render.finish()
        time.sleep(0.3)
        compare_pixel(browser, os.path.join(FOLDER, "c.exr"))
        expect(not (found := complaints(browser)), found)
    finally:
        render.kill()


def test_a_signal_while_paused(browser):
    render = Render("--time", "300", "-o", "d.exr")
    try:
        browser.open(render.url)
        wait(browser, "return document.querySelector('.pane') !== null")
        press(browser, "pause")
        wait(browser, "return document.getElementById('status').textContent.startsWith('paused')")
        time.sleep(1)
        render.process.send_signal(signal.SIGINT)
        output = render.finish()
        expect("ended early by a signal" in output, output)
        expect(float(re.search(r"per pixel, ([\d.]+) s", output).group(1)) < 250, output)
        exr.read(os.path.join(FOLDER, "d.exr"))
    finally:
        render.kill()


def test_a_browser_that_dies(_):
    """The render does not notice."""
    render = Render("--time", "300", "-o", "e.exr")
    try:
        with Browser() as other:
            other.open(render.url)
            wait(other, "return document.querySelector('.pane') !== null")
            with open(f"/proc/{other.driver.pid}/task/{other.driver.pid}/children") as children:
                for child in children.read().split():
                    os.kill(int(child), signal.SIGKILL)
            other.base = None
        time.sleep(1)
        expect(render.process.poll() is None, "the render has ended")
        render.process.send_signal(signal.SIGINT)
        render.finish()
        exr.read(os.path.join(FOLDER, "e.exr"))
    finally:
        render.kill()


TESTS = [value for name, value in list(globals().items()) if name.startswith("test_")]


def main():
    os.makedirs(FOLDER, exist_ok=True)
    with open(os.path.join(FOLDER, "scene.xml"), "w") as file:
        file.write(SCENE)
    good = True
    print(f"1..{len(TESTS)}", flush=True)
    with Browser() as browser:
        for number, test in enumerate(TESTS, 1):
            if not attempt(number, name_of(test), lambda: test(browser)):
                good = False
                browser.screenshot(os.path.join(FOLDER, f"failed-{number}.png"))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
