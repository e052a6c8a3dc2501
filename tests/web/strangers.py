#!/usr/bin/env python3
"""Attacks the page for other hosts as a stranger on the network would, and measures STOP meanwhile.

Runs missions/web.xml with keys of its own, as phone.py does; needs Python alone. ARMOR names the
program (target/release/armor by default). It ends with 1 if an attack succeeds.
"""

import argparse
import collections
import json
import os
import pathlib
import socket
import sys
import tempfile
import threading
import time

from run import ROOT, check, wait_for
from site_with_keys import HOST, Site

STOP = '{"stop":true}'


class Stranger:
    """Requests over TLS and without, byte by byte."""

    def __init__(self, site):
        self.site = site
        self.host = f"{HOST}:{site.port}"

    def connect(self):
        stream = socket.create_connection((HOST, self.site.port), timeout=30)
        # As browsers do: a request does not wait for the acknowledgement of the handshake.
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return stream

    def connect_tls(self):
        return self.site.context.wrap_socket(self.connect(), server_hostname=HOST)

    def ask(self, method, path, headers="", body="", host=None, stream=None):
        """Returns the status, 0 without one, and the response."""
        stream = stream or self.connect_tls()
        stream.sendall(f"{method} {path} HTTP/1.1\r\nHost: {host or self.host}\r\n{headers}"
                       f"Content-Length: {len(body)}\r\nConnection: close\r\n\r\n{body}".encode())
        response = b""
        try:
            while part := stream.recv(65536):
                response += part
        except OSError:
            pass
        stream.close()
        return (int(response.split(b" ")[1]) if response else 0), response.decode(errors="replace")

    def log_in(self, secret):
        return self.ask("POST", "/api/login", body=json.dumps({"invite": secret}))

    def open(self, path, cookie):
        """Opens a WebSocket."""
        stream = self.connect_tls()
        stream.sendall(f"GET {path} HTTP/1.1\r\nHost: {self.host}\r\nOrigin: https://{self.host}\r\n{cookie}"
                       "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                       "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode())
        return stream, int(stream.recv(4096).split(b" ")[1])


def send_text(stream, text):
    content = text.encode()
    stream.sendall(bytes([0x81, 0x80 | len(content), 0, 0, 0, 0]) + content)


def describe(times):
    times.sort()
    return (f"{len(times)} times, p50 {times[len(times) // 2]:.1f} ms, "
            f"p99 {times[int(len(times) * 0.99)]:.1f} ms, longest {times[-1]:.1f} ms")


def time_stop(act, until, pause_s):
    times = []
    while not until(len(times)):
        begin = time.monotonic()
        act()
        times.append((time.monotonic() - begin) * 1000)
        time.sleep(pause_s)
    return describe(times)


def in_threads(count, work):
    threads = [threading.Thread(target=work) for _ in range(count)]
    for thread in threads:
        thread.start()
    return lambda: any(thread.is_alive() for thread in threads)


def memory_mb(site):
    """The memory of the component that serves the page."""
    for process in pathlib.Path("/proc").iterdir():
        try:
            if process.name.isdigit() and os.readlink(process / "cwd").startswith(str(site.folder)) \
                    and b"web-view" in (process / "cmdline").read_bytes():
                status = (process / "status").read_text()
                return int(status.split("VmRSS:")[1].split()[0]) // 1024
        except OSError:
            continue
    return 0


def attack(site, guesses):
    stranger = Stranger(site)
    ask = stranger.ask
    wait_for("the page", lambda: ask("GET", "/")[0] == 200)
    secret = site.invite("alice", "operator").split("=")[1]
    status, response = stranger.log_in(secret)
    cookie = next(line for line in response.split("\r\n") if line.startswith("set-cookie: "))
    cookie = f"Cookie: {cookie[12:].split(';')[0]}\r\n"
    check("an invitation logs in", status == 200 and ask("GET", "/api/system", cookie)[0] == 200)
    check("a replayed invitation is refused", stranger.log_in(secret)[0] == 403)
    check("nothing is served without TLS", ask("POST", "/api/stop", cookie, stream=stranger.connect())[0] == 308)
    for headers in ("Origin: https://evil.example\r\n", "Sec-Fetch-Site: cross-site\r\n",
                    f"Origin: https://{HOST}:9\r\n"):
        check(f"another page is refused: {headers.strip()}", ask("POST", "/api/stop", cookie + headers)[0] == 403)
    for host in ("evil.example", "gate.armor", f"{stranger.host}@evil.example"):
        check(f"another host is refused: {host}", ask("POST", "/api/stop", cookie, host=host)[0] == 421)
    for path in ("/../keys/robot.key", "/%2e%2e/etc/passwd", "//etc/passwd"):
        check(f"no file is served: {path}", ask("GET", path)[0] == 404)
    check("none of them has stopped the robot", '"ordered":null' in ask("GET", "/api/stop", cookie)[1])

    def stop():
        assert ask("POST", "/api/stop", cookie)[0] == 200, "STOP is refused"

    def time_kept_connection(until):
        """Over a connection that is open before, as the page has one."""
        stream, status = stranger.open("/api/stop/live", cookie)
        assert status == 101, f"no connection for STOP: {status}"

        def stop_there():
            send_text(stream, STOP)
            assert b"stopped" in stream.recv(4096), "STOP has no answer"

        times = time_stop(stop_there, until, 0.01)
        stream.close()
        return times

    print("STOP, over its kept connection:", time_kept_connection(lambda n: n >= 300))
    print("STOP, over new connections:", time_stop(stop, lambda n: n >= 100, 0.01))
    statuses, before, begin = collections.Counter(), memory_mb(site), time.monotonic()

    def guess():
        for _ in range(guesses // 4):
            statuses[stranger.log_in(os.urandom(20).hex())[0]] += 1

    is_guessing = in_threads(4, guess)
    print("STOP, over new connections, while strangers guess:",
          time_stop(stop, lambda _: not is_guessing(), 0.02))
    print(f"guesses: {dict(statuses)} in {time.monotonic() - begin:.0f} s; "
          f"memory {before} MB before, {memory_mb(site)} MB after")
    check("no guess is accepted, and most are not looked at", statuses[200] == 0 and statuses[429] > guesses / 2)
    end = time.monotonic() + 10
    handshakes = collections.Counter()

    def shake_hands():
        while time.monotonic() < end:
            try:
                stranger.connect_tls().close()
                handshakes["done"] += 1
            except OSError:
                handshakes["refused"] += 1

    is_flooding = in_threads(6, shake_hands)
    print("STOP, over its kept connection, during a flood of handshakes:",
          time_kept_connection(lambda _: not is_flooding()))
    print(f"handshakes in 10 s: {dict(handshakes)}")
    silent = [stranger.connect() for _ in range(100)]
    print("STOP, over new connections, with 100 that say nothing:", time_stop(stop, lambda n: n >= 100, 0.01))
    for one in silent:
        one.close()

    live, _ = stranger.open("/api/live", cookie)
    site.run_keys("revoke", "alice")
    begin = time.monotonic()
    try:
        while live.recv(65536):
            pass
    except OSError:
        pass
    check(f"a revocation ends an open WebSocket ({time.monotonic() - begin:.2f} s after the command has ended)", True)
    check("the session has ended", ask("GET", "/api/system", cookie)[0] == 401)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--registry", default="127.0.0.1:17423")
    parser.add_argument("--port", type=int, default=18444)
    parser.add_argument("--guesses", type=int, default=10_000)
    arguments = parser.parse_args()
    armor = os.path.abspath(os.environ.get("ARMOR", ROOT / "target/release/armor"))
    with tempfile.TemporaryDirectory() as folder:
        site = Site(armor, pathlib.Path(folder), arguments.registry, arguments.port)
        try:
            attack(site, arguments.guesses)
        finally:
            site.end()


if __name__ == "__main__":
    try:
        main()
    except AssertionError as error:
        sys.exit(f"failed: {error}")
