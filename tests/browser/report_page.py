"""The page of `caustica compare --html` in a browser: keys, slider, zoom, values, layers, time. Speaks TAP.

report_page.py CAUSTICA FOLDER: the program, and where screenshots and inputs go."""

import json
import math
import os
import sys

from browser import Browser
from compare_page import Page, complaints, float32, near, open_page
from harness import attempt, ball_scene, expect, name_of, run_program

CAUSTICA, FOLDER = sys.argv[1:3]
WIDTH, HEIGHT = 96, 64
NASTY = "b<i>&amp;\"'</script><script>fail()<.exr"
SCENE = ball_scene(WIDTH, HEIGHT)


def caustica(*words):
    return run_program(CAUSTICA, FOLDER, *words)


SPOTS = [(3, 3), (48, 32), (50, 20), (95, 63), (0, 40), (70, 50)]


def test_opens(page):
    expect(page.captions() == ["1 a.exr"], page.captions())
    expect(page.browser.run("return document.title") == "caustica compare")
    expect(page.browser.run("return performance.getEntriesByType('resource').length") == 0, "something was fetched")
    page.browser.screenshot(os.path.join(FOLDER, "flip.png"))


def test_network_is_refused(page):
    kinds = page.browser.run(
        "const seen = []; document.addEventListener('securitypolicyviolation', (e) => seen.push(e.effectiveDirective));"
        "const image = new window.Image(); image.src = 'http://127.0.0.1:9/x.png';"
        "return fetch('http://127.0.0.1:9/').catch(() => 0).then(() => new Promise((r) => setTimeout(r, 100)))"
        ".then(() => { const s = document.createElement('script'); s.textContent = 'window.hacked = 1'; document.body.append(s);"
        "return new Promise((r) => setTimeout(r, 100)); }).then(() => [seen, window.hacked || 0])")
    expect(kinds[1] == 0 and {"img-src", "connect-src"} <= set(kinds[0]) and any("script-src" in k for k in kinds[0]), kinds)
    page.browser.log()  # these refusals are meant


def test_names_are_only_text(page):
    page.press("2")
    expect(page.captions() == ["2 " + NASTY], page.captions())
    expect(page.browser.run("return document.querySelectorAll('i').length") == 0)


def test_keys_flip(page):
    for key, number in (("1", 1), ("2", 2), ("0", 0), ("ArrowLeft", 2), ("ArrowRight", 0), ("ArrowRight", 1), ("Space", 0),
                        ("Space", 1), ("2", 2), ("Space", 0), ("Space", 2), ("7", 2)):
        page.press(key)
        expect(page.captions()[0].startswith(f"{number} "), key, page.captions())
        for x, y in SPOTS:
            found = page.color(*page.place(x, y))
            expect(near(found, page.expected_color(number, x, y)), key, x, y, found, page.expected_color(number, x, y))


def test_exposure_and_curve(page):
    page.press("e", "e", "e")
    expect(page.browser.run("return document.getElementById('exposure').value") == "1.5")
    for x, y in SPOTS:
        expect(near(page.color(*page.place(x, y)), page.expected_color(1, x, y, 1.5)), x, y)
    page.press("r")
    page.choose("curve", "linear")
    for x, y in SPOTS:
        expected = [255 * min(v, 1) for v in page.rgb(1, x, y)]
        expect(near(page.color(*page.place(x, y)), expected), x, y, expected)
    page.press("t")
    expect(page.browser.run("return document.getElementById('curve').value") == "sRGB")


def test_values_are_the_files(page):
    for x, y in SPOTS:
        page.hover(x, y)
        expect(page.pixel() == (x, y), page.pixel(), x, y)
        for number, texts in page.values().items():
            shown = [float32(float(text)) for text in texts[0:6:2]]
            expect(shown == page.rgb(number, x, y), number, x, y, texts, page.rgb(number, x, y))


def test_error_bars_are_the_files(page):
    at = 32 * WIDTH + 48
    page.hover(48, 32)
    for number, texts in page.values().items():
        layers = page.layers[number]
        for c, text in zip("RGB", texts[1:6:2], strict=True):
            error = math.sqrt(layers[f"Variance.{c}"][at] / layers["Samples.Y"][at])
            expect(text[0] == "±" and abs(float(text[1:]) - error) <= 0.056 * error, text, error)
    # Drawn: in the bar's own row the interval is the channel's colour, outside of it nothing.
    drawn = page.browser.run("return [...document.querySelectorAll('.values canvas')].map((c) =>"
                             "[...c.getContext('2d').getImageData(0, 0, c.width, c.height).data]"
                             ".filter((v, i) => i % 4 === 3 && v).length)")
    expect(len(drawn) == 3 and min(drawn) > 40, drawn)


def test_confidence_intervals_are_the_files(page):
    shown = 0
    for x, y in SPOTS:
        page.hover(x, y)
        for number, texts in page.values().items():
            if "ConfidenceLow.Y" not in page.layers[number]: # of too few samples: such layers are left out
                expect(texts[7] == "", texts)
                continue
            low, high = (page.layers[number][f"Confidence{end}.Y"][y * WIDTH + x] for end in ("Low", "High"))
            luminance = sum(w * v for w, v in zip((0.2126, 0.7152, 0.0722), page.rgb(number, x, y)))
            expect(abs(float(texts[6]) - luminance) <= 1e-6 * luminance, texts, luminance)
            if math.isinf(low):
                expect(texts[7] == "unknown", texts)
                continue
            shown += 1
            # The page keeps eight significant bits of each end's distance, and shows four digits of the end.
            for text, end in zip(texts[7].split("…"), (low, high)):
                expect(abs(float(text) - end) <= abs(end - luminance) / 256 + 6e-4 * abs(end), texts, low, high)
    expect(shown > 3, "too few intervals to tell", shown)


def test_a_click_keeps_the_pixel(page):
    page.hover(20, 30)
    page.browser.pointer("down", "up")
    page.browser.pointer(("move", *page.place(60, 60)))
    page.settle()
    expect(page.pixel() == (20, 30) and "kept" in page.status(), page.status())
    page.press("ArrowRight", "ArrowDown", holding=["Control"])
    expect(page.pixel() == (21, 31), page.status())
    expect([float32(float(t)) for t in page.values()[1][0:6:2]] == page.rgb(1, 21, 31))
    page.press("Escape")
    expect(page.pixel() is None, page.status())


def test_wheel_zooms_about_the_pointer(page):
    x, y = 30, 41
    screen = page.place(x, y)
    page.hover(x, y)
    scale = page.scale()
    while page.scale() < 190:
        page.browser.wheel(*screen, -240)
        page.settle()
        expect(page.pixel() == (x, y) and page.scale() > scale, page.status())
        scale = page.scale()
    left, top, _, _ = page.box()
    # A single pixel with its values written into it: its colour at the edges, something else within.
    inside = page.browser.run(
        "const d = document.querySelector('.pane canvas').getContext('2d').getImageData(arguments[0], arguments[1], 60, 90).data;"
        "return new Set(new Uint32Array(d.buffer)).size", screen[0] - left - 30, screen[1] - top - 45)
    expect(inside > 10, inside, "colours: no text in the pixel")
    page.browser.screenshot(os.path.join(FOLDER, "pixel.png"))
    page.press("a")
    page.browser.pointer(("move", *page.place(48, 32)))
    page.settle()
    expect(page.pixel() == (48, 32), page.status())


def test_zoomed_pixels_keep_their_colours(page):
    page.hover(48, 32)
    page.browser.pointer("down", "up")
    page.press("+", "+", "+")
    left, top, width, height = page.box()
    scale = page.scale()
    for dx in (-2, -1, 0, 1):
        found = page.color(left + width / 2 + (dx + 0.3) * scale, top + height / 2 - 0.3 * scale)
        expect(near(found, page.expected_color(1, 48 + dx, 32)), dx, found)


def test_drag_and_keys_move(page):
    page.press("+")
    page.hover(48, 32)
    screen, scale = page.place(48, 32), page.scale()
    before = page.pixel()
    page.browser.pointer(("move", *screen), "down", ("move", screen[0] + 4 * scale, screen[1] - 3 * scale), "up")
    page.settle()
    expect(page.pixel() == before, "the pixel under the pointer moves along", page.status())
    page.browser.pointer(("move", *screen))
    page.settle()
    expect(page.pixel() == (before[0] - 4, before[1] + 3), page.status())
    here = page.pixel()
    page.press("ArrowRight", holding=["Shift"])
    page.browser.pointer(("move", screen[0] + 1, screen[1]))
    page.settle()
    expect(page.pixel()[0] > here[0] and page.pixel()[1] == here[1], page.status())


def test_side_by_side_is_synchronous(page):
    page.press("g")
    expect(page.captions() == ["1 a.exr", "2 " + NASTY, "0 ref.exr"], page.captions())
    page.browser.screenshot(os.path.join(FOLDER, "side-by-side.png"))
    screen = page.place(50, 20, 1)
    page.hover(50, 20, 1)
    for _ in range(2):
        page.browser.wheel(*screen, -240)
        page.settle()
    left, top, _, _ = page.box(1)
    for pane, number in enumerate((1, 2, 0)):
        pane_left, pane_top, _, _ = page.box(pane)
        found = page.color(screen[0] - left + pane_left, screen[1] - top + pane_top, pane)
        expect(near(found, page.expected_color(number, 50, 20)), pane, found, page.expected_color(number, 50, 20))


def test_split_slider(page):
    page.press("s")
    y = 32
    left, top, width, _ = page.box()

    def check(split):
        for x in range(2, 94, 6):
            screen = page.place(x, y)
            if abs(screen[0] - split) < 8:
                continue
            number = 1 if screen[0] < split else 0
            expect(near(page.color(*screen), page.expected_color(number, x, y)), x, split, number)

    check(left + width / 2)
    page.browser.pointer(("move", left + width / 2, top + 90), "down", ("move", left + 0.3 * width, top + 95), "up")
    page.settle()
    check(left + 0.3 * width)
    page.press("]", "]", "]", "]", "]")
    check(left + 0.35 * width)
    page.press("2", holding=["Alt"])
    expect(near(page.color(*page.place(90, y)), page.expected_color(2, 90, y)))
    page.browser.screenshot(os.path.join(FOLDER, "split.png"))


def test_differences(page):
    for x, y in SPOTS:
        a, b = page.rgb(1, x, y), page.rgb(0, x, y)
        for key, expected in (("absolute", sum(abs(p - q) for p, q in zip(a, b)) / 3),
                              ("relative", sum((p - q) ** 2 / (q * q + 0.01) for p, q in zip(a, b)) / 3),
                              ("signed", sum(w * (p - q) for w, p, q in zip((0.2126, 0.7152, 0.0722), a, b)))):
            page.choose("layer", key)
            found = page.layer_value(1, x, y)
            expect(abs(found - expected) <= 2e-5 * abs(expected) + 1e-9, key, x, y, found, expected)
    page.choose("layer", "deviation")
    at = 32 * WIDTH + 48
    a, b = page.layers[1], page.layers[0]
    expected = math.sqrt(sum((a[c][at] - b[c][at]) ** 2 / sum(i[f"Variance.{c}"][at] / i["Samples.Y"][at] for i in (a, b))
                             for c in "RGB") / 3)
    found = page.layer_value(1, 48, 32)
    expect(abs(found - expected) <= 0.01 * expected, found, expected)


def test_maps_are_those_of_the_metrics(page):
    for name in ("FLIP.LDR", "FLIP.HDR", "SSIM"):
        page.choose("layer", f"map:{name}")
        for x, y in SPOTS:
            found, expected = page.layer_value(1, x, y), page.maps[name][y * WIDTH + x]
            expect(abs(found - expected) <= 6e-4 * abs(expected), name, x, y, found, expected)
    expect(page.values()[0][0] == "", "the reference has no map")
    page.choose("layer", "map:FLIP.HDR")
    page.browser.screenshot(os.path.join(FOLDER, "flip-map.png"))


def test_layers_of_the_file(page):
    page.choose("layer", "layer:N.Y")
    for x, y in SPOTS:
        found, expected = page.layer_value(1, x, y), page.layers[1]["N.Y"][y * WIDTH + x]
        expect(abs(found - expected) <= 6e-5 * abs(expected), x, y, found, expected)
    page.choose("layer", "group:Albedo")
    expected = [page.layers[1][f"Albedo.{c}"][32 * WIDTH + 48] for c in "RGB"]
    page.hover(48, 32)
    found = [float(t) for t in page.values()[1][0:6:2]]
    expect(near(found, expected, 1e-4), found, expected)
    page.press("l")
    expect(page.browser.run("return document.getElementById('layer').value") != "group:Albedo")


def test_colours_agree_with_the_scale(page):
    page.choose("layer", "absolute")
    page.choose("map", "grey")
    page.browser.run("for (const [id, v] of [['low', '0.05'], ['high', '0.55']]) { "
                     "const e = document.getElementById(id); e.value = v; e.dispatchEvent(new Event('change')); }")
    page.settle()
    for x, y in SPOTS:
        value = sum(abs(p - q) for p, q in zip(page.rgb(1, x, y), page.rgb(0, x, y))) / 3
        level = 255 * min(max((value - 0.05) / 0.5, 0), 1)
        found = page.color(*page.place(x, y))
        expect(near(found, [level] * 3), x, y, found, level)
    scale = page.browser.run("const c = document.getElementById('scale'), "
                             "d = c.getContext('2d').getImageData(44, 8, c.clientWidth - 88, 1).data;"
                             "return [...d].filter((v, i) => i % 4 === 0)")
    for i in (0, len(scale) // 4, len(scale) // 2, len(scale) - 1):
        expect(abs(scale[i] - 255 * (i + 0.5) / len(scale)) <= 1.5, i, scale[i])
    page.press("o")
    expect(page.browser.run("return document.getElementById('log').checked"))
    # A pixel in the middle of the range, where the two scales differ most.
    def value_at(x, y):
        return sum(abs(p - q) for p, q in zip(page.rgb(1, x, y), page.rgb(0, x, y))) / 3
    x, y = min(((x, y) for x in range(WIDTH) for y in range(HEIGHT)), key=lambda place: abs(value_at(*place) - 0.16))
    level = 255 * math.log(value_at(x, y) / 0.05) / math.log(11)
    expect(near(page.color(*page.place(x, y)), [level] * 3), x, y, level)
    page.press("o", "r")
    page.choose("map", "magma")
    page.press("g")
    page.browser.screenshot(os.path.join(FOLDER, "difference.png"))


def test_metrics_are_those_of_the_program(page):
    with open(os.path.join(FOLDER, "stats.json")) as file:
        images = json.load(file)["images"]
    table = page.browser.run("const t = document.querySelector('#table table'); const text = (r) => [...r.cells].map((c) => c.textContent);"
                             "return [...t.rows].map(text)")
    heads = [head.split(" ")[0] for head in table[0]]
    for row, image in zip(table[1:], images):
        for head, key in (("RMSE", "rmse"), ("MAE", "mae"), ("relMSE", "relmse"), ("SMAPE", "smape"), ("SSIM", "ssim"),
                          ("FLIP.LDR", "flip_ldr"), ("FLIP.HDR", "flip_hdr")):
            found = float(row[heads.index(head)])
            expect(abs(found - image[key]) <= 6e-5 * image[key], head, found, image[key])
    expect(len(table) == 4 and table[3][1] == "ref.exr (reference)", table[3])


def test_help(page):
    page.press("?")
    expect(page.browser.run("return document.getElementById('help').open"))
    page.press("Escape")
    expect(not page.browser.run("return document.getElementById('help').open"))


def test_small_window(page):
    page.browser.command("Emulation.setDeviceMetricsOverride", {"width": 700, "height": 500, "deviceScaleFactor": 2, "mobile": False})
    page.settle()
    try:
        x, y, width, height = page.box()
        expect(width > 400 and height > 150 and x >= 0, width, height)
        found = page.browser.run("const c = document.querySelector('.pane canvas'); return [c.width, c.clientWidth]")
        expect(found[0] == 2 * found[1], found, "canvases have the screen's own pixels")
        page.browser.screenshot(os.path.join(FOLDER, "small.png"))
    finally:
        page.browser.command("Emulation.setDeviceMetricsOverride", {"width": 1280, "height": 860, "deviceScaleFactor": 1, "mobile": False})
        page.settle()


def test_first_paint(browser):
    """Eight images of 1024 x 1024, seven and their reference. A machine that is busy with other things makes it late: the best of three."""
    for _ in range(3):
        previews, first, all_images = open_page(browser, os.path.join(FOLDER, "large.html"))
        if previews < 2:
            break
    print(f"# 8 images of 1024 x 1024: all shown coarsely after {previews:.2f} s, the first one with all of its pixels after "
          f"{first:.2f} s, all after {all_images:.2f} s")
    expect(previews < 2, previews, "s")
    browser.keys("3", "g")
    browser.wait("return document.querySelectorAll('.pane').length === 8")
    expect(not complaints(browser), "console")
    browser.screenshot(os.path.join(FOLDER, "eight.png"))


def prepare():
    os.makedirs(FOLDER, exist_ok=True)
    with open(os.path.join(FOLDER, "scene.xml"), "w") as file:
        file.write(SCENE)
    os.makedirs(os.path.dirname(os.path.join(FOLDER, NASTY)), exist_ok=True)
    for name, spp, seed in (("ref.exr", "64", "1"), ("a.exr", "8", "2"), (NASTY, "4", "3")):
        caustica("render", "scene.xml", "--spp", spp, "--seed", seed, "-o", name, "--quiet")
    caustica("compare", "a.exr", NASTY, "--reference", "ref.exr", "--html", "page.html", "--stats", "stats.json",
             "--html-layers", "Albedo,N")
    caustica("compare", "a.exr", "--reference", "ref.exr", "--maps", "maps-a.exr")
    caustica("render", "scene.xml", "--spp", "2", "--resolution", "1024x1024", "-o", "large.exr", "--quiet")
    names = [f"large-{i}.exr" for i in range(8)]
    for name in names:
        if not os.path.lexists(os.path.join(FOLDER, name)):
            os.symlink("large.exr", os.path.join(FOLDER, name))
    caustica("compare", *names[:7], "--reference", names[7], "--flip", "none", "--html", "large.html")


PAGE_TESTS = [value for name, value in list(globals().items()) if name.startswith("test_") and name != "test_first_paint"]


def main():
    prepare()
    good = True
    print(f"1..{len(PAGE_TESTS) + 2}", flush=True)
    with Browser() as browser:
        page = Page(browser, FOLDER, "page.html", {1: "a.exr", 2: NASTY, 0: "ref.exr"}, "maps-a.exr")
        for number, test in enumerate(PAGE_TESTS, 1):
            def action(test=test):
                page.reset()
                test(page)
            good &= attempt(number, name_of(test), action)
        good &= attempt(len(PAGE_TESTS) + 1, "no complaint on the console", lambda: expect(not (found := complaints(browser)), found))
        good &= attempt(len(PAGE_TESTS) + 2, "first paint", lambda: test_first_paint(browser))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
