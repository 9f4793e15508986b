"""Headless Chromium driven through chromedriver (WebDriver: HTTP and JSON), with Python's standard library alone."""

import base64
import http.client
import json
import os
import re
import signal
import subprocess
import tempfile
import time

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"
KEYS = {"Space": " ", "Escape": "\ue00c", "ArrowLeft": "\ue012", "ArrowUp": "\ue013", "ArrowRight": "\ue014",
        "ArrowDown": "\ue015", "Shift": "\ue008", "Control": "\ue009", "Alt": "\ue00a"}


class Browser:
    def __init__(self, width=1280, height=860):
        # A profile of its own, removed at the end: nothing is left of a session that crashed. (Processes of a browser that was killed
        # may still write for a moment.)
        self.folder = tempfile.TemporaryDirectory(prefix="caustica-browser-", ignore_cleanup_errors=True)
        # In a session of its own: whatever becomes of the driver, its browser ends with us.
        self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                                       start_new_session=True)
        self.connection = self.base = None
        try:
            self._start(width, height)
        except BaseException:
            self.close()
            raise

    def _start(self, width, height):
        port = None
        for line in self.driver.stdout:
            if found := re.search(r"successfully on port (\d+)", line):
                port = found.group(1)
                break
        if not port:
            raise RuntimeError("chromedriver did not start")
        self.connection = http.client.HTTPConnection("127.0.0.1", int(port), timeout=120)
        arguments = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", "--disable-gpu",
                     "--force-device-scale-factor=1", "--force-color-profile=srgb", f"--window-size={width},{height}",
                     f"--user-data-dir={self.folder.name}"]
        capabilities = {"browserName": "chrome", "goog:chromeOptions": {"args": arguments},
                        "goog:loggingPrefs": {"browser": "ALL"}, "pageLoadStrategy": "none"}
        answer = self._call("POST", "/session", {"capabilities": {"alwaysMatch": capabilities}})
        self.base = "/session/" + answer["sessionId"]
        # The size of what the page sees, whatever the window's borders.
        self.command("Emulation.setDeviceMetricsOverride",
                     {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})

    def _call(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        self.connection.request(method, path, data, {"Content-Type": "application/json"})
        response = self.connection.getresponse()
        value = json.load(response)["value"]
        if response.status != 200:
            raise RuntimeError(f"{value['error']}: {value['message'].splitlines()[0]}")
        return value

    def close(self):
        try:
            if self.base:
                self._call("DELETE", self.base)
        finally:
            if self.connection:
                self.connection.close()
            try:
                os.killpg(self.driver.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            self.driver.wait()
            self.folder.cleanup()

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.close()

    def open(self, url):
        self._call("POST", self.base + "/url", {"url": url})

    def run(self, script, *arguments):
        """The value that the script returns (a promise's, if it is one)."""
        return self._call("POST", self.base + "/execute/sync", {"script": script, "args": list(arguments)})

    def command(self, name, parameters=None):
        """A command of the DevTools protocol."""
        return self._call("POST", self.base + "/goog/cdp/execute", {"cmd": name, "params": parameters or {}})

    def wait(self, script, *arguments, seconds=30):
        """Until the script returns something true; that value."""
        end = time.monotonic() + seconds
        while True:
            value = self.run(script, *arguments)
            if value:
                return value
            if time.monotonic() > end:
                raise RuntimeError(f"not within {seconds} s: {script}")
            time.sleep(0.05)

    def keys(self, *names, holding=()):
        """Presses keys one after the other, while others are held."""
        actions = [{"type": "keyDown", "value": KEYS[name]} for name in holding]
        for name in names:
            value = KEYS.get(name, name)
            actions += [{"type": "keyDown", "value": value}, {"type": "keyUp", "value": value}]
        actions += [{"type": "keyUp", "value": KEYS[name]} for name in holding]
        self._actions([{"type": "key", "id": "keyboard", "actions": actions}])

    def _actions(self, sources):
        self._call("POST", self.base + "/actions", {"actions": sources})

    def pointer(self, *steps):
        """Steps: ("move", x, y), "down", "up"; in the page's coordinates."""
        actions = []
        for step in steps:
            if step == "down" or step == "up":
                actions.append({"type": "pointerDown" if step == "down" else "pointerUp", "button": 0})
            else:
                actions.append({"type": "pointerMove", "duration": 0, "x": round(step[1]), "y": round(step[2])})
        self._actions([{"type": "pointer", "id": "mouse", "actions": actions}])

    def wheel(self, x, y, amount):
        self._actions([{"type": "wheel", "id": "wheel", "actions": [
            {"type": "scroll", "x": round(x), "y": round(y), "deltaX": 0, "deltaY": amount, "duration": 0}]}])

    def screenshot(self, path):
        with open(path, "wb") as file:
            file.write(base64.b64decode(self._call("GET", self.base + "/screenshot")))

    def log(self):
        """Console messages since the last call."""
        return self._call("POST", self.base + "/se/log", {"type": "browser"})
