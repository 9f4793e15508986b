"""What a person does on the page of `caustica compare --html`, and what is seen there."""

import os
import re
import struct

import exr


def float32(x):
    return struct.unpack("<f", struct.pack("<f", x))[0]


def near(found, expected, tolerance=1.01):
    return all(abs(a - b) <= tolerance for a, b in zip(found, expected, strict=True))


def complaints(browser):
    # That canvases are read often is these tests' doing.
    return [entry["message"] for entry in browser.log()
            if entry["level"] in ("SEVERE", "WARNING") and "willReadFrequently" not in entry["message"]]


def open_page(browser, path):
    """Until all is there. Seconds until all images were shown coarsely, the first one and all of them with all of their pixels."""
    browser.open("file://" + path)
    browser.wait("return performance.getEntriesByName('all-errors').length", seconds=120)
    return [browser.run("return performance.getEntriesByName(arguments[0])[0].startTime", name) / 1000
            for name in ("previews", "first-image", "all-images")]


class Page:
    """A page in a folder; files: its images by their number there, 0 the reference; maps: file with the maps of image 1."""

    def __init__(self, browser, folder, name, files, maps):
        self.browser = browser
        self.files = files
        pictures = {number: exr.read(os.path.join(folder, file)) for number, file in files.items()}
        self.width, self.height = pictures[0][:2]
        self.layers = {number: layers for number, (_, _, layers) in pictures.items()}
        self.maps = exr.read(os.path.join(folder, maps))[2]
        open_page(browser, os.path.join(folder, name))
        self.settle()

    def settle(self):
        """Until the page has painted what it was told: it paints in the next frame, and is asked in the one after that."""
        self.browser.run("return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def press(self, *keys, holding=()):
        self.browser.keys(*keys, holding=holding)
        self.settle()

    def reset(self):
        """Image 1 alone, all of it, as on opening."""
        self.browser.pointer(("move", 5, 5))
        self.press("Escape", "r", "f", "1", "a")
        self.choose("layer", "color")
        self.choose("curve", "sRGB")
        self.choose("map", "magma")

    def choose(self, select, value):
        self.browser.run("const s = document.getElementById(arguments[0]); s.value = arguments[1]; s.dispatchEvent(new Event('change'))",
                         select, value)
        self.settle()

    def box(self, pane=0):
        return self.browser.run("const b = document.querySelectorAll('.pane canvas')[arguments[0]].getBoundingClientRect();"
                                "return [b.left, b.top, b.width, b.height]", pane)

    def scale(self):
        return float(re.search(r"([\d.]+) %", self.status()).group(1)) / 100

    def status(self):
        return self.browser.run("return document.getElementById('status').textContent")

    def pixel(self):
        """Whose values are shown."""
        found = re.search(r"x +(\d+) +y +(\d+)", self.status())
        return found and (int(found.group(1)), int(found.group(2)))

    def place(self, x, y, pane=0):
        """Where the middle of an image pixel is on the screen, when all of the image is shown."""
        left, top, width, height = self.box(pane)
        return (left + width / 2 + (x + 0.5 - self.width / 2) * self.scale(), top + height / 2 + (y + 0.5 - self.height / 2) * self.scale())

    def color(self, screen_x, screen_y, pane=0):
        left, top, _, _ = self.box(pane)
        return self.browser.run(
            "return [...document.querySelectorAll('.pane canvas')[arguments[0]].getContext('2d')"
            ".getImageData(arguments[1], arguments[2], 1, 1).data].slice(0, 3)", pane, round(screen_x - left), round(screen_y - top))

    def hover(self, x, y, pane=0):
        self.browser.pointer(("move", *self.place(x, y, pane)))
        self.settle()

    def captions(self):
        return self.browser.run("return [...document.querySelectorAll('.caption')].map((c) => "
                                "c.querySelector('b').textContent + ' ' + c.querySelector('span').textContent)")

    def values(self):
        """Texts of the table's last cell, by the image's number."""
        return dict(self.browser.run(
            "return [...document.querySelectorAll('#table tbody tr')].map((r) => [Number(r.cells[0].textContent),"
            "[...r.querySelectorAll('.values span')].map((s) => s.textContent.trim())])"))

    def layer_value(self, number, x, y):
        """What the table shows of a layer that has one value."""
        self.hover(x, y)
        text = self.values()[number][0]
        return float(text) if text else None

    def rgb(self, number, x, y):
        return [self.layers[number][c][y * self.width + x] for c in "RGB"]

    def expected_color(self, number, x, y, exposure=0.0):
        def level(v):
            v = min(max(v * 2 ** exposure, 0.0), 1.0)
            return 255 * (12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055)
        return [level(v) for v in self.rgb(number, x, y)]
