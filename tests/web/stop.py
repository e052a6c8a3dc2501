#!/usr/bin/env python3
"""The button STOP of the page in Chromium, with a server that this script plays: which orders are sent
again when the connection is back.

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
        # The status of the answer to a POST; none: no answer.
        self.post_status = None
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
        if self.post_status is None:
            route.abort()
        else:
            route.fulfill(status=self.post_status, body="{}", content_type="application/json")

    def accept(self, connection):
        if not self.is_up:
            # There is no such server.
            connection.connect_to_server()
            return
        orders = []
        self.connections.append((connection, orders))
        connection.on_message(lambda text: self.note(orders, json.loads(text)))

    @staticmethod
    def note(orders, message):
        if message.get("stop"):
            orders.append(message["id"])

    def orders(self):
        """The numbers of the orders over the last connection."""
        return self.connections[-1][1]

    def answer(self, message):
        self.connections[-1][0].send(json.dumps(message))

    def refuse(self, number, status):
        self.answer({"id": number, "error": {"status": status, "what": "STOP is not delivered"}})

    def lose(self):
        self.connections[-1][0].close()

    def wait(self, state, *texts):
        """Waits for a state of the button, with one of these texts."""
        shown = ", ".join(f"#stop[data-state={state}]:text-is('{text}')" for text in texts)
        self.page.wait_for_selector(shown)

    def wait_for_connection(self, count):
        self.wait_for(f"connection {count}", lambda: len(self.connections) == count)

    def wait_for(self, what, find):
        def look():
            # Playwright calls the functions above only while it is asked something.
            self.page.evaluate("0")
            return find()
        return wait_for(what, look)

    def press(self):
        self.page.click("#stop")


UNCONFIRMED = "STOP not confirmed: the robot may be moving"
REFUSED = "STOP not delivered: use the switch on the robot"
LOST = "STOP not delivered: the robot may be moving"


def check_refused(browser):
    server = Server(browser)
    server.press()
    server.wait_for("the order", lambda: server.orders() == [1])
    server.refuse(1, 502)
    server.wait("failed", REFUSED)
    server.lose()
    server.wait_for_connection(2)
    server.wait("ready", "STOP")
    server.press()
    server.wait_for("an order", server.orders)
    check("a STOP that was refused is not ordered again, and the next one is", server.orders() == [2])


def check_unanswered(browser):
    server = Server(browser)
    server.press()
    server.wait_for("the order", lambda: server.orders() == [1])
    server.wait("failed", UNCONFIRMED)
    for count in (2, 3):
        server.lose()
        server.wait("failed", LOST)
        server.wait_for_connection(count)
        server.wait("sent", "STOP sent")
        server.wait_for("the order again", lambda: server.orders() == [1])
    check("a STOP without an answer is ordered again over each connection", True)
    server.refuse(1, 504)
    server.wait("failed", REFUSED)
    server.lose()
    server.wait_for_connection(4)
    server.wait_for("the order again", lambda: server.orders() == [1])
    check("a STOP whose delivery is not known is ordered again", True)
    server.answer({"id": 1, "stopped": True})
    server.wait("done", "STOPPED")
    server.wait("ready", "STOP")
    server.lose()
    server.wait_for_connection(5)
    server.wait("ready", "STOP")
    server.press()
    server.wait_for("an order", server.orders)
    check("a STOP that was confirmed is not ordered again", server.orders() == [2])


def check_posted(browser):
    lost = (UNCONFIRMED, LOST)
    for status, texts, again in ((502, (REFUSED,), False), (503, lost, True), (None, lost, True)):
        server = Server(browser)
        server.is_up, server.post_status = False, status
        server.lose()
        server.wait("lost", "STOP (not connected)")
        server.press()
        server.wait_for("the POST", lambda: server.posts == 1)
        server.wait("failed", *texts)
        server.is_up = True
        server.wait_for_connection(2)
        if not again:
            server.wait("ready", "STOP")
            server.press()
        server.wait_for("an order", server.orders)
        check(f"a STOP by POST with the answer {status} is {'' if again else 'not '}ordered again",
              server.orders() == [1 if again else 2])


def main():
    from playwright.sync_api import sync_playwright
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=os.environ.get("CHROMIUM", "/usr/bin/chromium"), args=["--no-sandbox"])
        check_refused(browser)
        check_unanswered(browser)
        check_posted(browser)
        browser.close()
    print("all is well")


if __name__ == "__main__":
    try:
        main()
    except AssertionError as error:
        sys.exit(f"failed: {error}")
