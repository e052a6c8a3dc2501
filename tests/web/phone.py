#!/usr/bin/env python3
"""Uses the page from a phone as a person does: an invitation, STOP, a role, a revocation.

Needs what run.py needs. Runs missions/web.xml with keys of its own, and serves the page over HTTPS.
Chromium is made to trust the robot's key (`--ignore-certificate-errors-spki-list`), as a phone does
that has the certificate of the authority.
"""

import argparse
import os
import pathlib
import sys

from playwright.sync_api import sync_playwright

from run import PHONE, ROOT, check, is_map_painted, wait_for
from site_with_keys import Site


def open_phone(browser, errors):
    context = browser.new_context(viewport=PHONE, device_scale_factor=2, has_touch=True, is_mobile=True,
                                  color_scheme="dark")
    page = context.new_page()
    page.on("pageerror", lambda error: errors.append(str(error)))
    return page


def is_connected(page):
    return page.evaluate("document.getElementById('link').dataset.state === 'good'")


def use_page(browser, site, out):
    errors = []
    watcher = site.log_in(site.invite("watcher", "observer"))
    is_stopped = lambda: site.ask("api/stop", watcher)[1]["ordered"] is True

    stranger = open_phone(browser, errors)
    stranger.goto(site.url)
    stranger.wait_for_selector("#login:not([hidden])")
    check("a stranger is asked for an invitation", not stranger.locator("footer").is_visible())
    check("nothing is wider than a phone",
          stranger.evaluate("document.documentElement.scrollWidth <= innerWidth"))
    stranger.click("#login summary")
    stranger.wait_for_timeout(300)
    stranger.screenshot(path=out / "phone-login.png")
    stranger.fill("#invite", "https://robot/#invite=" + "0" * 40)
    stranger.click("#log-in")
    stranger.wait_for_selector("#login-problem:has-text('not accepted')")
    check("a wrong link is refused with the reason", True)

    link = site.invite("alice", "operator")
    phone = open_phone(browser, errors)
    phone.goto(link)
    phone.wait_for_selector("#who:has-text('alice · operator')")
    check("the link logs in, and its secret leaves the address", phone.url == site.url)
    wait_for("the connection", lambda: is_connected(phone))
    wait_for("the map", lambda: is_map_painted(phone))
    wait_for("STOP", lambda: phone.locator("#stop[data-state=ready]").is_visible())
    check("the page is connected over HTTPS", True)
    check("nothing is wider than a phone", phone.evaluate("document.documentElement.scrollWidth <= innerWidth"))
    phone.wait_for_timeout(1500)
    phone.screenshot(path=out / "web-phone.png")
    phone.tap("#stop")
    wait_for("STOP", is_stopped)
    phone.wait_for_selector("#banner[data-kind=stop]:not([hidden])")
    check("STOP stops the robot", True)
    phone.screenshot(path=out / "phone-stopped.png")
    phone.tap("#control")
    phone.wait_for_selector("#stick:not([hidden])")
    phone.tap("#release")
    wait_for("the release", lambda: not is_stopped())
    check("the operator takes control and releases STOP", True)
    phone.reload()
    phone.wait_for_selector("#who:has-text('alice · operator')")
    check("the session survives a reload", True)
    phone.evaluate("navigator.serviceWorker.ready.then(() => true)")
    check("the page is installed for the time without a network", True)
    phone.goto(link)
    phone.wait_for_selector("#who:has-text('alice')")
    check("the same browser may open the link again", phone.locator("#login").is_hidden())
    stranger.goto(link)
    stranger.reload()
    stranger.goto(link + "&")
    stranger.wait_for_selector("#login-problem:has-text('used already')")
    check("another browser may not", True)

    observer = open_phone(browser, errors)
    observer.goto(site.invite("olga", "observer"))
    observer.wait_for_selector("#who:has-text('olga · observer')")
    wait_for("the connection", lambda: is_connected(observer))
    observer.wait_for_selector("[data-order=resume]:disabled")
    check("an observer's page shows what the role does not allow",
          observer.locator("#control").is_disabled() and observer.locator("#role-note").is_visible())
    observer.screenshot(path=out / "phone-observer.png", full_page=True)
    observer.tap("#stop")
    wait_for("STOP", is_stopped)
    check("an observer may stop the robot", True)

    site.run_keys("revoke", "alice")
    phone.wait_for_selector("#login-problem:has-text('revoked')")
    check("a revocation ends the page, with the reason",
          phone.locator("#places").inner_text() == "" and phone.locator("#login").is_visible())
    phone.screenshot(path=out / "phone-revoked.png")
    check("others stay", is_connected(observer))
    observer.click("#log-out")
    observer.wait_for_selector("#login:not([hidden])")
    check("a person logs out", True)
    faults = [error for error in errors if "Failed to fetch" not in error]
    check(f"the pages have no errors {faults}", not faults)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/phone"))
    parser.add_argument("--registry", default="127.0.0.1:17422")
    parser.add_argument("--port", type=int, default=18443)
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    armor = os.path.abspath(os.environ.get("ARMOR", ROOT / "target/release/armor"))
    site = Site(armor, out, arguments.registry, arguments.port)
    try:
        spki = wait_for("the page", site.spki)
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(
                executable_path=os.environ.get("CHROMIUM", "/usr/bin/chromium"),
                args=["--no-sandbox", f"--ignore-certificate-errors-spki-list={spki}"])
            use_page(browser, site, out)
            browser.close()
    finally:
        if site.process.poll() is None:
            site.end()
    print(f"all is well; the pictures are in {out}")


if __name__ == "__main__":
    try:
        main()
    except AssertionError as error:
        sys.exit(f"failed: {error}")
