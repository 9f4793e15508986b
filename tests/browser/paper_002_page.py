"""The report of paper 002's comparison (scripts/paper-002-report.sh) in a browser: a scene of eight images, everything that a
reader does with them driven and checked. Speaks TAP.

paper_002_page.py CAUSTICA FOLDER [SIZE SPP]: the program, and where pages, images and screenshots go; how large the images are and
how many samples they have (for a test: small, and of the first scene only, for all have the same page)."""

import os
import subprocess
import sys

from browser import Browser
from compare_page import Page, complaints, float32, near, open_page
from harness import attempt, expect, name_of

CAUSTICA, FOLDER = sys.argv[1:3]
SIZE, SPP = sys.argv[3:5] or ("96", "2")
SCENES = ["rough-glass", "long-diffuse"] if sys.argv[3:5] else ["rough-glass"]
INTEGRATORS = ["path", "bdpt", "vcm", "vcm-plus", "vcm-star", "ovcm", "cavcm"]
NUMBERS = [*range(1, len(INTEGRATORS) + 1), 0]


def spots(page):
    """Of the image, to every side: in tenths of its size."""
    return [(page.width * x // 10, page.height * y // 10) for x, y in ((0, 0), (5, 5), (3, 7), (9, 2), (6, 9), (8, 6))]


def caption(page, number):
    return f"{number} {page.files[number]}"


def shows(page, number, places=None, pane=0):
    """Is it this image that is seen, in its own colours?"""
    for x, y in places or spots(page):
        found, expected = page.color(*page.place(x, y, pane), pane), page.expected_color(number, x, y)
        expect(near(found, expected), number, x, y, found, expected)


def test_keys_flip(page, scene):
    for key, number in [*((str(n), n) for n in NUMBERS), ("ArrowLeft", 7), ("ArrowLeft", 6), ("ArrowRight", 7), ("ArrowRight", 0),
                        ("ArrowRight", 1), ("6", 6), ("Space", 0), ("Space", 6), ("9", 6)]:
        page.press(key)
        expect(page.captions() == [caption(page, number)], key, page.captions())
        shows(page, number)
    page.browser.screenshot(os.path.join(FOLDER, f"{scene}-flip.png"))


def test_slider(page, scene):
    page.press("2", "s")
    page.press("6", holding=["Alt"])  # bdpt on the left, ovcm on the right
    left, top, width, _ = page.box()
    row = page.height // 2

    def check(split):
        for x in range(0, page.width, max(1, page.width // 16)):
            screen, _ = page.place(x, row)
            if abs(screen - split) > 8:
                shows(page, 2 if screen < split else 6, [(x, row)])
    check(left + width / 2)
    page.browser.pointer(("move", left + width / 2, top + 80), "down", ("move", left + 0.42 * width, top + 90), "up")
    page.settle()
    check(left + 0.42 * width)
    page.press(*"]]]]]]]]]]")
    check(left + 0.52 * width)
    page.browser.screenshot(os.path.join(FOLDER, f"{scene}-split.png"))


def test_zoom(page, scene):
    """By the wheel about the pointer, the same in all panes, to single pixels with their values in them."""
    page.press("g")
    expect(page.captions() == [caption(page, number) for number in NUMBERS], page.captions())
    page.browser.screenshot(os.path.join(FOLDER, f"{scene}-side-by-side.png"))
    for pane, number in enumerate(NUMBERS):
        shows(page, number, spots(page)[1:3], pane)
    x, y = page.width * 4 // 10, page.height * 6 // 10
    screen = page.place(x, y, 2)
    page.hover(x, y, 2)
    left, top, _, _ = page.box(2)
    while page.scale() < 30:
        page.browser.wheel(*screen, -240)
        page.settle()
        expect(page.pixel() == (x, y), page.status())
    for pane, number in enumerate(NUMBERS):
        pane_left, pane_top, _, _ = page.box(pane)
        found = page.color(screen[0] - left + pane_left, screen[1] - top + pane_top, pane)
        expect(near(found, page.expected_color(number, x, y)), pane, found)
    page.browser.pointer("down", "up")  # kept: zooming is about it
    page.press("3")
    page.press("+", "+", "+")
    expect(page.scale() > 100 and page.pixel() == (x, y), page.status())
    left, top, width, height = page.box()
    colors = page.browser.run(
        "const d = document.querySelector('.pane canvas').getContext('2d').getImageData(arguments[0], arguments[1], 60, 60).data;"
        "return new Set(new Uint32Array(d.buffer)).size", width / 2 - 30, height / 2 - 30)
    expect(colors > 10, colors, "colours: no text in the pixel")
    page.browser.screenshot(os.path.join(FOLDER, f"{scene}-pixels.png"))


def test_values(page, scene):
    for x, y in spots(page):
        page.hover(x, y)
        expect(page.pixel() == (x, y), page.pixel(), x, y)
        values = page.values()
        expect(sorted(values) == sorted(NUMBERS), list(values))
        for number, texts in values.items():
            shown = [float32(float(text)) for text in texts[0:6:2]]
            expect(shown == page.rgb(number, x, y), number, x, y, texts, page.rgb(number, x, y))


def test_layers(page, scene):
    keys = page.browser.run("return [...document.getElementById('layer').options].map((o) => o.value)")
    for key in ("color", "absolute", "signed", "error", "deviation", "map:SSIM", "map:FLIP.LDR", "map:FLIP.HDR",
                "layer:StandardDeviation.Y"):
        expect(key in keys, key, keys)
    page.choose("layer", "layer:StandardDeviation.Y")  # the paper's figure 6
    for x, y in spots(page):
        for number in NUMBERS:
            found, expected = page.layer_value(number, x, y), page.layers[number]["StandardDeviation.Y"][y * page.width + x]
            expect(abs(found - expected) <= 6e-5 * abs(expected), number, x, y, found, expected)
    page.press("g")
    page.browser.screenshot(os.path.join(FOLDER, f"{scene}-deviation.png"))
    page.press("1", "f")
    for name in ("FLIP.LDR", "SSIM"):
        page.choose("layer", f"map:{name}")
        for x, y in spots(page):
            found, expected = page.layer_value(1, x, y), page.maps[name][y * page.width + x]
            expect(abs(found - expected) <= 6e-4 * abs(expected) + 1e-9, name, x, y, found, expected)
    for key in keys:  # each can be chosen with the keys, and is painted
        page.choose("layer", keys[keys.index(key) - 1])
        page.press("l")
        expect(page.browser.run("return document.getElementById('layer').value") == key, key)
        x, y = page.place(page.width // 2, page.height // 2)
        expect(page.color(x, y) is not None)
    page.choose("layer", "absolute")
    page.press("g")
    page.browser.screenshot(os.path.join(FOLDER, f"{scene}-difference.png"))


def test_nothing_was_fetched(page, scene):
    expect(page.browser.run("return performance.getEntriesByType('resource').length") == 0)
    expect(not (found := complaints(page.browser)), found)


TESTS = [value for name, value in list(globals().items()) if name.startswith("test_")]


def first_paint(browser, scene):
    """When all eight images are seen, coarsely as they are then, three times and more on a machine that is busy with other things, which
    makes it late: the best one counts."""
    times = []
    while len(times) < 3 or (min(times) >= 2 and len(times) < 8):
        previews, first, all_images = open_page(browser, os.path.join(FOLDER, f"{scene}.html"))
        paint = browser.run("return performance.getEntriesByName('first-contentful-paint')[0].startTime") / 1000
        times.append(previews)
        print(f"# {scene}: the browser's first paint after {paint:.2f} s, all 8 images seen after {previews:.2f} s, the first one with "
              f"all of its pixels after {first:.2f} s, all after {all_images:.2f} s", flush=True)
    expect(min(times) < 2, times)


def prepare():
    script = os.path.join(os.path.dirname(__file__), "..", "..", "scripts", "paper-002-report.sh")
    subprocess.run([script, os.path.dirname(CAUSTICA), FOLDER, SIZE, SPP, *SCENES], check=True, stdout=subprocess.DEVNULL)


def main():
    prepare()
    good, number = True, 0
    print(f"1..{len(SCENES) * (len(TESTS) + 1)}", flush=True)
    with Browser() as browser:
        for scene in SCENES:
            number += 1
            good &= attempt(number, f"{scene}: first paint", lambda: first_paint(browser, scene))
            files = {i + 1: f"{scene}/{name}.exr" for i, name in enumerate(INTEGRATORS)} | {0: f"{scene}/reference.exr"}
            page = Page(browser, FOLDER, f"{scene}.html", files, f"{scene}/maps-path.exr")
            for test in TESTS:
                def action(test=test):
                    page.reset()
                    test(page, scene)
                number += 1
                good &= attempt(number, f"{scene}: {name_of(test)}", action)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
