#!/usr/bin/env python3
"""Uses the operator's page in Chromium as a person does, with the mission missions/web.xml.

Needs `pip install playwright` and Debian's `chromium`; ARMOR names the program (target/release/armor
by default). Checks each effect at the server, not only on the page, and saves pictures to --out.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import time
import urllib.error
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
DESKTOP = {"width": 1280, "height": 800}
PHONE = {"width": 390, "height": 844}
# Only a hang takes this long.
DEADLINE_S = 60


class Robot:
    """A running system, asked over HTTP."""

    def __init__(self, armor, folder, registry, listen):
        self.url = f"http://{listen}"
        self.registry = registry
        log = open(folder / "run.log", "w")
        command = [armor, "run", str(ROOT / "missions/web.xml"), "--headless", "--registry", registry,
                   "--out", str(folder / "robot"), "--set", f"web.listen={listen}"]
        self.process = subprocess.Popen(command, stdout=log, stderr=log, cwd=folder)

    def get(self, path):
        with urllib.request.urlopen(self.url + path, timeout=10) as response:
            return json.load(response)

    def order(self, **order):
        body = json.dumps(order).encode()
        request = urllib.request.Request(self.url + "/api/mission/orders", body,
                                         {"Content-Type": "application/json"})
        with urllib.request.urlopen(request, timeout=10) as response:
            return json.load(response)

    def is_stopped(self):
        return self.get("/api/stop")["ordered"] is True

    def places(self):
        marking = self.get("/api/mission")["marking"]
        return [it["place"] for it in marking["places"]] if marking else []

    def place(self):
        position = self.get("/api/data/simulator.truth?wait=10")["value"]["pose"]["pose"]["position"]
        return position["x"], position["y"]

    def end(self):
        self.process.terminate()
        self.process.wait(DEADLINE_S)


def wait_for(what, find):
    """Returns what `find` returns, once that is true."""
    end = time.monotonic() + DEADLINE_S
    while time.monotonic() < end:
        try:
            found = find()
        except (OSError, KeyError, TypeError, urllib.error.URLError):
            found = None
        if found:
            return found
        time.sleep(0.05)
    raise AssertionError(f"{what} has not happened")


def check(what, is_so):
    print(("ok    " if is_so else "FAILED") + f"  {what}", flush=True)
    if not is_so:
        raise AssertionError(what)


def open_page(browser, robot, size, requests, errors, **options):
    context = browser.new_context(viewport=size, **options)
    page = context.new_page()
    page.on("request", lambda request: requests.append(request.url))
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda line: line.type == "error" and errors.append(line.text))
    page.goto(robot.url)
    wait_for("a state of the page", lambda: page.evaluate("document.getElementById('link').dataset.state === 'good'"))
    return page


def is_map_painted(page):
    return page.evaluate("""() => {
        const canvas = document.getElementById('map');
        const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        let painted = 0;
        for (let at = 3; at < data.length; at += 4) painted += data[at] > 0;
        return painted > data.length / 4 / 50;
    }""")


def stop_button(page):
    """The middle of STOP, wherever it is shown."""
    box = page.locator("footer").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def use_page(browser, robot, out):
    requests, errors = [], []
    page = open_page(browser, robot, DESKTOP, requests, errors, color_scheme="dark")
    wait_for("a state of the page", lambda: page.evaluate("document.getElementById('map-note').hidden"))
    wait_for("the map", lambda: is_map_painted(page))
    check("the map is painted", True)
    wait_for("the camera", lambda: page.evaluate("document.getElementById('camera').naturalWidth"))
    check("the camera's image is shown", True)
    wait_for("a state of the page", lambda: page.evaluate("document.getElementById('stop-frame').hidden === false"))
    check("STOP is in a frame of its own", True)
    page.screenshot(path=out / "desktop.png")

    page.mouse.click(*stop_button(page))
    wait_for("STOP", robot.is_stopped)
    wait_for("the place", lambda: robot.places() == ["by-hand"])
    page.wait_for_selector("#banner[data-kind=stop]:not([hidden])")
    check("STOP by a click stops the robot, and the banner shows it", True)
    page.wait_for_timeout(1500)
    before = robot.place()
    page.wait_for_timeout(1500)
    after = robot.place()
    check("the robot stands", abs(before[0] - after[0]) + abs(before[1] - after[1]) < 0.02)
    page.screenshot(path=out / "stopped.png")

    check("STOP cannot be released without control", page.locator("#release").is_disabled())
    page.click("#control")
    page.wait_for_selector("#stick:not([hidden])")
    page.click("#release")
    wait_for("the release", lambda: not robot.is_stopped())
    check("STOP is released by the client in control", True)

    box = page.locator("#stick").bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    before = robot.place()
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(middle[0] + 20, middle[1] - 50, steps=4)
    moved = lambda: sum(abs(a - b) for a, b in zip(before, robot.place())) > 0.15
    wait_for("the drive", moved)
    page.screenshot(path=out / "driving.png")
    page.mouse.up()
    check("the stick drives the robot", True)
    page.wait_for_timeout(1200)
    before = robot.place()
    page.wait_for_timeout(800)
    after = robot.place()
    check("the robot stands when the stick is let go",
          abs(before[0] - after[0]) + abs(before[1] - after[1]) < 0.02)

    page.click("#enabled li:has-text('go-on') button")
    wait_for("the order", lambda: robot.places() == ["explore"])
    check("a transition is fired from the page", True)
    page.click("button[data-order=pause]")
    page.wait_for_selector("#banner:has-text('PAUSED')")
    page.click("button[data-order=resume]")
    page.wait_for_selector("#stage[data-stage=playing]")
    check("the mission is paused and resumed", True)
    x, y = stop_button(page)

    # The page hangs for long: only the process of the frame is left.
    page.evaluate("""setTimeout(() => {
        const begin = Date.now();
        while (Date.now() < begin + 8000);
        window.hung = [begin, Date.now()];
    }, 0)""")
    time.sleep(0.5)
    pressed = time.monotonic()
    session = page.context.new_cdp_session(page)
    for kind in ("mousePressed", "mouseReleased"):
        session.send("Input.dispatchMouseEvent",
                     {"type": kind, "x": x, "y": y, "button": "left", "clickCount": 1})
    wait_for("STOP of a page that hangs", robot.is_stopped)
    took_s, stopped_at = time.monotonic() - pressed, time.time() * 1000
    begin, end = wait_for("the end of the hang", lambda: page.evaluate("window.hung"))
    check(f"STOP works while the page hangs (after {took_s:.2f} s)", begin < stopped_at < end)
    page.wait_for_selector("#banner[data-kind=stop]:not([hidden])")

    page.wait_for_selector("#drive-note:has-text('No control')")
    check("a page that hangs loses control", True)
    page.click("#control")
    page.click("#release")
    wait_for("the release", lambda: not robot.is_stopped())
    page.keyboard.press("Space")
    wait_for("STOP by Space", robot.is_stopped)
    check("Space is STOP", True)
    page.click("#release")
    wait_for("the release", lambda: not robot.is_stopped())

    robot.order(order="fire", transition="go-on")
    phone = open_page(browser, robot, PHONE, requests, errors, device_scale_factor=2, has_touch=True,
                      is_mobile=True, color_scheme="dark")
    wait_for("a state of the page", lambda: phone.evaluate("document.getElementById('map-note').hidden"))
    phone.wait_for_timeout(1500)
    check("nothing is wider than a phone",
          phone.evaluate("document.documentElement.scrollWidth <= innerWidth"))
    box = phone.locator("footer").bounding_box()
    check("STOP is in sight on a phone", box["y"] + box["height"] <= PHONE["height"])
    phone.screenshot(path=out / "phone.png")
    phone.screenshot(path=out / "phone-all.png", full_page=True)
    phone.click("#control")
    wait_for("a state of the page", lambda: phone.evaluate("document.getElementById('control').dataset.force === 'yes'"))
    phone.click("#control")
    phone.wait_for_selector("#stick:not([hidden])")
    page.wait_for_selector("#drive-note:has-text('another client has taken control')")
    check("control is taken over by another client, and the first one is informed", True)
    phone.screenshot(path=out / "phone-drive.png")

    light = open_page(browser, robot, DESKTOP, requests, errors, color_scheme="light")
    wait_for("a state of the page", lambda: light.evaluate("document.getElementById('map-note').hidden"))
    light.click("#processes summary")
    light.wait_for_timeout(1500)
    light.screenshot(path=out / "light.png")
    light.evaluate("navigator.serviceWorker.ready.then(() => true)")

    robot.end()
    light.wait_for_selector("#banner:has-text('Not connected')")
    check("the page shows that it is not connected", True)
    light.reload()
    light.wait_for_selector("#banner:has-text('Not connected')")
    light.screenshot(path=out / "offline.png")
    check("the page opens without a server", light.locator("#stop").is_visible())

    hosts = ("http://127.0.0.1:", "http://localhost:", "ws://127.0.0.1:", "ws://localhost:", "blob:")
    strange = [url for url in requests if not url.startswith(hosts)]
    check("nothing is loaded from elsewhere", not strange)
    # A refused take-over and the end of the server are errors that were meant.
    wanted = ("ERR_CONNECTION_REFUSED", "409", "net::ERR", "WebSocket connection", "Failed to fetch")
    faults = [error for error in errors if not any(it in error for it in wanted)]
    check(f"the page has no errors {faults}", not faults)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/web"))
    parser.add_argument("--registry", default="127.0.0.1:17421")
    parser.add_argument("--listen", default="127.0.0.1:18081")
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    armor = os.path.abspath(os.environ.get("ARMOR", ROOT / "target/release/armor"))
    robot = Robot(armor, out, arguments.registry, arguments.listen)
    from playwright.sync_api import sync_playwright
    try:
        wait_for("the page", lambda: robot.places() == ["explore"])
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(
                executable_path=os.environ.get("CHROMIUM", "/usr/bin/chromium"), args=["--no-sandbox"])
            use_page(browser, robot, out)
            browser.close()
    finally:
        if robot.process.poll() is None:
            robot.end()
    print(f"all is well; the pictures are in {out}")


if __name__ == "__main__":
    try:
        main()
    except AssertionError as error:
        sys.exit(f"failed: {error}")
