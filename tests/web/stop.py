#!/usr/bin/env python3
"""The button STOP of the page in Chromium, with a server that this script plays: which orders are sent
again, and for how long.

Needs `pip install playwright` and Debian's `chromium`; no robot and no build.
"""

import json
import os
import sys

from run import ROOT, check, wait_for

PAGE = ROOT / "web/src/page"
TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
SITE = "http://stop.test"


class Server:
    """Serves the page with nothing but STOP, and notes the orders of each of its connections."""

    def __init__(self, browser):
        self.page = browser.new_context().new_page()
        self.connections = []
        self.posts = 0
        self.is_up = True
        # The status and the body of the answer to a POST; none: no answer.
        self.post_answer = None
        # The script moves the page's time forward, which otherwise passes as usual.
        self.page.clock.install()
        self.page.route(SITE + "/**", self.serve_file)
        self.page.route(SITE + "/api/stop", self.serve_post)
        self.page.route_web_socket("ws://stop.test/api/stop/live", self.accept)
        self.page.goto(SITE + "/stop.html")
        self.wait("ready", "STOP")

    def serve_file(self, route):
        file = PAGE / route.request.url.removeprefix(SITE + "/")
        route.fulfill(body=file.read_bytes(), content_type=TYPES[file.suffix])

    def serve_post(self, route):
        self.posts += 1
        if self.post_answer is None:
            route.abort()
        else:
            status, body = self.post_answer
            route.fulfill(status=status, body=body)

    def accept(self, connection):
        if not self.is_up:
            # There is no such server.
            connection.connect_to_server()
            return
        orders, beats = [], []
        self.connections.append((connection, orders, beats))
        connection.on_message(lambda text: self.note(orders, beats, json.loads(text)))

    @staticmethod
    def note(orders, beats, message):
        (orders if message.get("stop") else beats).append(message["id"])

    def orders(self):
        """The numbers of the orders over the last connection."""
        return self.connections[-1][1]

    def count_orders(self):
        return self.posts + sum(len(orders) for _, orders, _ in self.connections)

    def wait_for_orders(self, *numbers):
        self.wait_for(f"the orders {numbers}", lambda: self.orders() == list(numbers))

    def answer(self, message):
        self.connections[-1][0].send(json.dumps(message))

    def refuse(self, number, status):
        self.answer({"id": number, **failure(status)})
        self.page.evaluate("0")

    def send_state(self, number, is_stopped):
        self.answer({"id": number, "state": {"ordered": is_stopped}})

    def lose(self):
        self.connections[-1][0].close()

    def wait(self, state, *texts):
        """Waits for a state of the button, with one of these texts."""
        shown = ", ".join(f"#stop[data-state={state}]:text-is('{text}')" for text in texts)
        self.page.wait_for_selector(shown)

    def wait_for_connection(self, count):
        """Waits until the page has noticed that this connection is open."""
        self.wait_for(f"connection {count}",
                      lambda: len(self.connections) == count and self.connections[-1][2])

    def is_shown(self, text):
        return self.page.inner_text("#stop") == text

    def wait_for(self, what, find):
        def look():
            # Playwright calls the functions above only while it is asked something.
            self.page.evaluate("0")
            return find()
        return wait_for(what, look)

    def press(self):
        self.page.click("#stop")


def failure(status):
    """A failure as `armor web` answers it."""
    return {"error": {"status": status, "what": "STOP is not delivered"}}


UNANSWERED = "STOP not confirmed: the robot may be moving"
REPEATED = "STOP not confirmed, ordered again: use the switch if the robot moves"
UNCONFIRMED = "STOP not confirmed: use the switch on the robot"
REFUSED = "STOP not delivered: use the switch on the robot"
RELEASED = "STOP was released: press again to stop the robot"


def check_refused(browser):
    server = Server(browser)
    server.press()
    server.wait_for_orders(1)
    server.refuse(1, 502)
    server.wait("failed", REFUSED)
    server.lose()
    server.wait_for_connection(2)
    check("a refusal stays in sight when the connection is back", server.is_shown(REFUSED))
    server.press()
    server.wait_for("an order", server.orders)
    check("a STOP that was refused is not ordered again, and the next one is", server.orders() == [2])


def check_unanswered(browser):
    server = Server(browser)
    server.press()
    server.wait_for_orders(1)
    server.wait("failed", UNANSWERED)
    for count in (2, 3):
        server.lose()
        server.wait_for_connection(count)
        server.wait("failed", REPEATED)
        server.wait_for_orders(count)
    check("a STOP without an answer is ordered again over each connection", True)
    server.refuse(3, 504)
    server.page.clock.run_for(6000)
    server.wait_for_orders(3, 4)
    check("a STOP whose delivery is not known is ordered again over the open connection", True)
    server.refuse(3, 502)
    check("a refusal of an earlier order does not end it", server.is_shown(REPEATED))
    server.answer({"id": 4, "stopped": True})
    server.wait("done", "STOPPED")
    server.wait("ready", "STOP")
    server.lose()
    server.wait("lost", "STOP (not connected)")
    server.wait_for_connection(4)
    server.wait("ready", "STOP")
    server.press()
    server.wait_for("an order", server.orders)
    check("a STOP that was confirmed is not ordered again", server.orders() == [5])


def check_silent(browser):
    server = Server(browser)
    server.post_answer = 502, json.dumps(failure(502))
    server.press()
    server.wait_for_orders(1)
    server.page.clock.run_for(6000)
    server.wait("failed", REFUSED)
    check("a STOP over a connection that is silent is ordered again by POST",
          server.posts == 1 and server.orders() == [1])
    server.answer({"id": 1, "stopped": True})
    server.wait("done", "STOPPED")
    check("a late confirmation is shown", True)


def check_limit(browser):
    def put_clock_back(clock):
        clock.set_system_time(0)
        clock.run_for(60_000)

    for what, pass_time in (("60 s", lambda clock: clock.run_for(60_000)),
                            ("60 s with a clock that was put back", put_clock_back),
                            ("an hour of sleep", lambda clock: clock.fast_forward(3_600_000))):
        server = Server(browser)
        server.press()
        server.wait_for_orders(1)
        server.refuse(1, 504)
        server.wait("failed", REPEATED)
        pass_time(server.page.clock)
        server.wait("failed", UNCONFIRMED)
        # By the next connection all requests before it have arrived.
        server.lose()
        server.wait_for_connection(2)
        count = server.count_orders()
        check(f"after {what} STOP is not confirmed (orders: {count})", count <= 10)
        server.page.clock.run_for(60_000)
        server.lose()
        server.wait_for_connection(3)
        check("it is not ordered again later",
              server.count_orders() == count and server.is_shown(UNCONFIRMED))


def check_released(browser):
    server = Server(browser)
    server.send_state(0, True)
    server.press()
    server.wait_for_orders(1)
    server.refuse(1, 504)
    server.send_state(1, False)
    server.page.clock.run_for(6000)
    server.wait_for_orders(1, 2)
    check("a release before the press does not end it", server.is_shown(REPEATED))
    server.send_state(2, True)
    server.send_state(2, False)
    server.wait("failed", RELEASED)
    server.page.clock.run_for(12_000)
    check("a STOP is not ordered again after its release", server.count_orders() == 2)


def check_posted(browser):
    own, page = json.dumps(failure(502)), "<h1>Bad Gateway</h1>"
    for answer, text in (((502, own), REFUSED), ((502, page), REPEATED), ((503, "{}"), REPEATED),
                         ((504, json.dumps(failure(504))), REPEATED), ((200, page), REPEATED),
                         (None, UNANSWERED)):
        server = Server(browser)
        server.is_up, server.post_answer = False, answer
        server.lose()
        server.wait("lost", "STOP (not connected)")
        server.press()
        server.wait_for("the POST", lambda: server.posts == 1)
        server.wait("failed", text)
        server.is_up = True
        server.wait_for_connection(2)
        is_refused = text == REFUSED
        if is_refused:
            check("the refusal stays in sight", server.is_shown(REFUSED) and not server.orders())
            server.press()
        server.wait_for("an order", server.orders)
        check(f"a STOP by POST with the answer {answer} is {'not ' if is_refused else ''}ordered again",
              server.orders() == [2])


def check_posted_stop(browser):
    server = Server(browser)
    server.is_up, server.post_answer = False, (200, json.dumps({"stopped": True}))
    server.lose()
    server.wait("lost", "STOP (not connected)")
    server.page.evaluate("window.shown = []; Stop.listen((state) => window.shown.push(state))")
    server.press()
    server.wait("done", "STOPPED")
    server.wait("lost", "STOP (not connected)")
    check("a button without a connection is not ready after a STOP by POST",
          "ready" not in server.page.evaluate("window.shown"))


def serve_page(route):
    file = PAGE / (route.request.url.removeprefix(SITE + "/") or "index.html")
    if file.suffix in TYPES and file.exists():
        route.fulfill(body=file.read_bytes(), content_type=TYPES[file.suffix])
    else:
        route.abort()


def check_covered(browser):
    for width, height in ((390, 844), (320, 568), (844, 390), (1280, 800)):
        page = browser.new_page(viewport={"width": width, "height": height}, has_touch=True)
        page.route("**/*", serve_page)
        page.goto(SITE + "/")
        page.evaluate("""() => {
            document.getElementById('values').innerHTML = '<dt>a value<dd>1'.repeat(50);
            document.querySelectorAll('aside details').forEach((it) => { it.open = true; });
            for (const box of [document.scrollingElement, document.querySelector('aside')]) {
                box.scrollTop = box.scrollHeight;
            }
        }""")
        last, button = (page.locator(it).bounding_box() for it in ("aside section >> nth=-1", "footer"))
        check(f"STOP covers nothing at the end of a page of {width} x {height}",
              last["y"] + last["height"] <= button["y"])
        page.close()


def main():
    from playwright.sync_api import sync_playwright
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=os.environ.get("CHROMIUM", "/usr/bin/chromium"), args=["--no-sandbox"])
        for check_button in (check_refused, check_unanswered, check_silent, check_limit, check_released,
                             check_posted, check_posted_stop, check_covered):
            check_button(browser)
        browser.close()
    print("all is well")


if __name__ == "__main__":
    try:
        main()
    except AssertionError as error:
        sys.exit(f"failed: {error}")
