"""The page of `caustica study` in a browser: two subjects take part, their answers are exported and analysed. Speaks TAP.

study_page.py CAUSTICA FOLDER: the program, and where screenshots and inputs go."""

import glob
import json
import os
import sys
import time

import exr
from browser import Browser
from harness import attempt, ball_scene, expect, name_of, run_program

CAUSTICA, FOLDER = sys.argv[1:3]
NAMES = ["visible-a", "occluded-a", "visible-b", "occluded-b"]
QUESTION = "Was there a noticeable difference <b>between</b> the two images? </script>"
SCENE = ball_scene(60, 40, max_depth=3, radiance="$light", defaults='<default name="light" value="6"/>')
# What the subjects see a difference in.
SEEN = {"anna": {"occluded-a", "occluded-b"}, "b 2": {"occluded-a", "visible-b"}}
# Every frame's time and whether the images can be seen in it, noted independently of the page's own clock.
WATCH = """window.seen = [];
const look = (now) => {
    const canvases = [...document.querySelectorAll('canvas.picture')];
    seen.push([now, canvases.length > 0 && canvases.every((c) => getComputedStyle(c).visibility === 'visible')]);
    requestAnimationFrame(look);
};
requestAnimationFrame(look);"""


def caustica(*words):
    return run_program(CAUSTICA, FOLDER, *words)


def config(name, seconds, screens):
    scenarios = [{"name": each, "scene": "scene.xml", "light": each[:-2], "pair": each[-1],
                  "define": {"light": str(3 + i)}} for i, each in enumerate(NAMES)]
    study = {"title": "A <study> & its page", "question": QUESTION, "seconds": seconds, "screens": screens, "magnify": 5,
             "viewing_distance_m": 1.25, "image": {"spp": 1}, "reference": {"spp": 4, "seed": 7}, "scenarios": scenarios}
    with open(os.path.join(FOLDER, name + ".json"), "w") as file:
        json.dump(study, file, indent=1)
    caustica("study", name + ".json", "-o", name, "--quiet")


def open_page(browser, name):
    browser.open("file://" + os.path.join(FOLDER, name, "index.html"))
    browser.wait("return performance.getEntriesByName('ready').length")
    browser.run(WATCH)


def click(browser, name):
    left, top, width, height = browser.run(
        "const b = document.getElementById(arguments[0]).getBoundingClientRect(); return [b.left, b.top, b.width, b.height]", name)
    expect(width > 0, name, "is not there")
    browser.pointer(("move", left + width / 2, top + height / 2), "down", "up")


def is_shown(browser, name):
    return browser.run("return document.getElementById(arguments[0]).getClientRects().length > 0", name)


def begin(browser, subject):
    browser.run("document.getElementById('subject').value = arguments[0]", subject)
    click(browser, "start")


def stored(browser):
    return browser.run("return JSON.parse(localStorage.getItem("
                       "'caustica-study-' + JSON.parse(document.getElementById('data').textContent).id) || '[]')")


def watched(browser):
    """How long, in ms, the images were seen: from the first frame that had them to the first that did not; and the longest time
    without a frame. The page changes images in a frame, this looks in the same or the next."""
    frames = browser.run("const all = seen; window.seen = []; return all")
    shown = [now for now, visible in frames if visible]
    after = [now for now, visible in frames if shown and not visible and now > shown[-1]]
    expect(shown and after, "no images were seen")
    times = [now for now, _ in frames]
    return after[0] - shown[0], max(b - a for a, b in zip(times, times[1:]))


def take_part(browser, subject, count=len(NAMES)):
    """Answers `count` trials of the session that is on; its times as watched."""
    times = []
    for _ in range(count):
        browser.run("window.seen = []")
        before = len(current(browser, subject)["trials"])
        scenario = current(browser, subject)["order"][before]
        click(browser, "show")
        browser.wait("return document.getElementById('asking').getClientRects().length")
        expect(browser.run("return document.getElementById('question').textContent") == QUESTION, "question")
        expect(not is_shown(browser, "ready"), "card")
        browser.run("return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        times.append(watched(browser))
        click(browser, "yes" if scenario in SEEN[subject] else "no")
        expect(len(current(browser, subject)["trials"]) == before + 1, "the answer is not kept")
    return times


def current(browser, subject):
    return next(each for each in stored(browser) if each["subject"] == subject)


def export(browser):
    before = set(glob.glob(os.path.join(FOLDER, "*.json")))
    browser.command("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": FOLDER})
    click(browser, "export")
    for _ in range(200):
        new = set(glob.glob(os.path.join(FOLDER, "answers-*.json"))) - before
        if new:
            return os.path.basename(new.pop())
        time.sleep(0.05)
    raise AssertionError("nothing was exported")


def test_starts_only_when_all_is_said(browser):
    open_page(browser, "short")
    click(browser, "start")
    expect("Which subject" in browser.run("return document.getElementById('problem').textContent"), "subject")
    browser.run("document.getElementById('distance').value = 'far'")
    begin(browser, "anna")
    expect("viewing distance" in browser.run("return document.getElementById('problem').textContent"), "distance")
    expect(is_shown(browser, "setup") and not is_shown(browser, "stage"), "started")
    browser.run("document.getElementById('distance').value = '1,5'")
    browser.screenshot(os.path.join(FOLDER, "setup.png"))


def test_order_is_random(browser):
    """Of 240 sessions: each scenario is as often at each place; 5 standard deviations of a binomial are allowed."""
    open_page(browser, "short")
    orders = browser.run(
        "for (let i = 0; i < 240; i++) { document.getElementById('subject').value = `s${i}`; document.getElementById('start').click(); }"
        "const kept = Object.values(localStorage).flatMap((text) => JSON.parse(text)); return kept.map((session) => session.order)")
    expect(len(orders) == 240 and all(sorted(order) == sorted(NAMES) for order in orders), len(orders))
    deviation = (240 / 4 * 3 / 4) ** 0.5
    for place in range(4):
        for name in NAMES:
            count = sum(order[place] == name for order in orders)
            expect(abs(count - 60) <= 5 * deviation, name, "is", count, "of 240 times number", place + 1)
    browser.run("localStorage.clear()")


def test_sides_are_drawn(browser):
    """The reference is on the right for one half of the random numbers, on the left for the other."""
    open_page(browser, "short")
    begin(browser, "sides")
    for number, side in ((0, "right"), (2 ** 31 - 1, "right"), (2 ** 31, "left"), (2 ** 32 - 1, "left")):
        browser.run("crypto.getRandomValues = (numbers) => numbers.fill(arguments[0])", number)
        click(browser, "show")
        browser.wait("return document.getElementById('asking').getClientRects().length")
        click(browser, "yes")
        trial = current(browser, "sides")["trials"][-1]
        expect(trial["reference_side"] == side, number, trial)
    browser.run("localStorage.clear()")


def check_times(session, times, wanted):
    """False where the machine was too busy to keep the time, and the page has said so."""
    own = [trial["shown_ms"] for trial in session["trials"]]
    print(f"# shown for {wanted} ms: by the page {own}, as watched {[round(seen, 1) for seen, _ in times]}", flush=True)
    for trial, (seen, gap) in zip(session["trials"], times, strict=True):
        expect(abs(trial["shown_ms"] - seen) <= 2 * gap + 1, trial, seen, gap)
        expect((abs(trial["shown_ms"] - wanted) > 50) == (trial["disturbed"] == "the time was not kept"), trial)
    return not any(trial["disturbed"] for trial in session["trials"])


def undisturbed(browser, action):
    """Again with no answers while the machine is too busy for 50 ms."""
    for _ in range(8):
        if action(browser):
            return
        click(browser, "clear")
        click(browser, "clear")
    raise AssertionError("this machine is too busy to show images for a time")


def two_subjects(browser):
    open_page(browser, "short")
    begin(browser, "anna")
    times = take_part(browser, "anna", 2)
    open_page(browser, "short")  # the session goes on
    browser.run("document.getElementById('distance').value = '1,5'")
    begin(browser, "anna")
    times += take_part(browser, "anna", 2)
    expect(is_shown(browser, "thanks"), "the end")
    session = current(browser, "anna")
    expect(session["finished"] and session["viewing_distance_m"] == 1.5 and session["screens"] == 1, session)
    expect(sorted(session["order"]) == sorted(NAMES), session["order"])
    expect([t["scenario"] for t in session["trials"]] == session["order"], "order")
    in_time = check_times(session, times, 400)
    click(browser, "next")
    begin(browser, "anna")
    expect("has taken part" in browser.run("return document.getElementById('problem').textContent"), "twice")
    begin(browser, "b 2")
    times = take_part(browser, "b 2")
    in_time &= check_times(current(browser, "b 2"), times, 400)
    click(browser, "next")
    return in_time


def test_two_subjects_analysed(browser):
    undisturbed(browser, two_subjects)
    name = export(browser)
    answers = json.load(open(os.path.join(FOLDER, name)))
    expect(answers["study"]["question"] == QUESTION, "question")
    expect(answers["sessions"] == stored(browser), "what is exported is what is kept")
    text = caustica("study", "--analyse", name, "--stats", "analysis.json")
    print("".join(f"# {line}\n" for line in text.splitlines()), end="")
    result = json.load(open(os.path.join(FOLDER, "analysis.json")))
    expect({each["name"]: (each["yes"], each["answers"], each["ratio"]) for each in result["scenarios"]} ==
           {"visible-a": (0, 2, 0.0), "occluded-a": (2, 2, 1.0), "visible-b": (1, 2, 0.5), "occluded-b": (1, 2, 0.5)}, result)
    expect([(p["name"], p["only_occluded"], p["only_visible"], p["p_more"]) for p in result["pairs"]] ==
           [("a", 2, 0, 0.25), ("b", 1, 1, 0.75)], result["pairs"])
    expect((result["all_pairs"]["more"], result["all_pairs"]["fewer"], result["all_pairs"]["as_many"]) == (1, 0, 1), result)


def five_seconds(browser):
    open_page(browser, "five")
    begin(browser, "one")
    browser.run("window.seen = []")
    click(browser, "show")
    browser.wait("return document.getElementById('asking').getClientRects().length")
    browser.run("return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    seen = watched(browser)
    click(browser, "yes")
    in_time = check_times(current(browser, "one"), [seen], 5000)
    open_page(browser, "five")
    return in_time


def test_five_seconds(browser):
    undisturbed(browser, five_seconds)


def test_images_are_those_of_the_files(browser):
    """The canvases show image and reference, pixel for pixel, on the sides that the answers say."""
    open_page(browser, "five")
    begin(browser, "sides")
    click(browser, "show")
    browser.wait("return getComputedStyle(document.querySelector('canvas.picture')).visibility === 'visible'")
    browser.screenshot(os.path.join(FOLDER, "shown.png"))
    boxes = browser.run("return [...document.querySelectorAll('canvas.picture')].map((c) => "
                        "[c.width, c.height, c.clientWidth, c.clientHeight])")
    expect(boxes == [[300, 200, 300, 200]] * 2, boxes)
    found = browser.run(
        "return [...document.querySelectorAll('canvas.picture')].map((c) => [...c.getContext('2d').getImageData(0, 0, 300, 200).data]"
        ".filter((v, i) => (i >> 2) % 5 === 0 && Math.floor((i >> 2) / 300) % 5 === 0))")
    browser.wait("return document.getElementById('asking').getClientRects().length")
    browser.screenshot(os.path.join(FOLDER, "asking.png"))
    click(browser, "yes")
    trial = current(browser, "sides")["trials"][0]
    sides = ["reference", "image"] if trial["reference_side"] == "left" else ["image", "reference"]
    for side, pixels in zip(sides, found, strict=True):
        expected = expected_pixels(os.path.join("five", "images", f"{trial['scenario']}-{side}.exr"))
        worst = max(abs(a - b) for a, b in zip(pixels, expected, strict=True))
        expect(worst <= 1, side, worst)


def expected_pixels(path):
    """RGBA bytes of the file under the sRGB curve."""
    width, height, layers = exr.read(os.path.join(FOLDER, path))

    def level(v):
        v = min(max(v, 0.0), 1.0)
        return round(255 * (12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055))
    return [value for i in range(width * height) for value in (*(level(layers[c][i]) for c in "RGB"), 255)]


def windows(browser):
    return browser._call("GET", browser.base + "/window/handles")


def test_two_windows(browser):
    open_page(browser, "two")
    begin(browser, "two")
    expect("second window" in browser.run("return document.getElementById('problem').textContent"), "second window")
    main, = windows(browser)
    click(browser, "second")
    for _ in range(100):
        if len(windows(browser)) == 2:
            break
        time.sleep(0.05)
    expect(len(windows(browser)) == 2, "no second window")
    begin(browser, "two")
    problem = browser.run("return document.getElementById('problem').textContent")
    expect(is_shown(browser, "ready"), "did not start:", problem)
    click(browser, "show")
    browser.wait("return getComputedStyle(document.querySelector('canvas.picture')).visibility === 'visible'")
    other = next(each for each in windows(browser) if each != main)
    browser._call("POST", browser.base + "/window", {"handle": other})
    found = browser.run("const c = document.querySelectorAll('canvas'); "
                        "return [c.length, c[0].width, c[0].clientWidth, c[0].style.visibility]")
    browser.screenshot(os.path.join(FOLDER, "second.png"))
    browser._call("POST", browser.base + "/window", {"handle": main})
    expect(found == [1, 300, 300, "visible"], found)
    browser.wait("return document.getElementById('asking').getClientRects().length")
    click(browser, "no")
    # A window that closes while images are shown: the answer is marked.
    click(browser, "show")
    browser._call("POST", browser.base + "/window", {"handle": other})
    browser._call("DELETE", browser.base + "/window")
    browser._call("POST", browser.base + "/window", {"handle": main})
    browser.wait("return document.getElementById('asking').getClientRects().length")
    click(browser, "no")
    session = current(browser, "two")
    expect([len(session["display"]["windows"]), session["monitor_spacing_m"]] == [2, 1], session)
    expect("closed" in session["trials"][1]["disturbed"] and "closed" not in session["trials"][0]["disturbed"], session["trials"])
    click(browser, "show")
    expect(is_shown(browser, "setup"), "goes on without a second window")


def prepare():
    os.makedirs(FOLDER, exist_ok=True)
    with open(os.path.join(FOLDER, "scene.xml"), "w") as file:
        file.write(SCENE)
    config("short", 0.4, 1)
    config("five", 5, 1)
    config("two", 1.5, 2)


TESTS = [value for name, value in list(globals().items()) if name.startswith("test_")]


def complaints(browser):
    return [entry["message"] for entry in browser.log() if "favicon" not in entry["message"]]


def main():
    prepare()
    good = True
    print(f"1..{len(TESTS) + 1}", flush=True)
    with Browser() as browser:
        for number, test in enumerate(TESTS, 1):
            good &= attempt(number, name_of(test), lambda: test(browser))
        good &= attempt(len(TESTS) + 1, "no complaint on the console", lambda: expect(not (found := complaints(browser)), found))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
