"""Attacks on the page of `turbidock view`. After each, while its connections are still open, another page and its tab
have to open within a second. Prints a table; ends with 1 where something got in or was kept out.

    PROGRAM=build/bin/turbidock python3 tests/serve/attack_test.py
"""

import os
import signal
import socket
import subprocess
import sys
import time
from urllib.parse import urlsplit

PROGRAM = os.environ.get("PROGRAM", "build/bin/turbidock")
MOST_S = float(os.environ.get("MOST_S", "1"))
UPGRADE = (
    "Connection: Upgrade",
    "Upgrade: websocket",
    "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
)


class Site:
    """The server under attack, as who knows its address sees it."""

    def __init__(self, url):
        parts = urlsplit(url)
        self.root, self.host, self.port = parts.path, parts.netloc, parts.port

    def send(self, text):
        connection = socket.create_connection(("127.0.0.1", self.port), timeout=10)
        try:
            connection.sendall(text.encode())
        except OSError:
            pass  # refused before all of it was said
        return connection

    def request(self, path, *headers, host=None, method="GET"):
        lines = (f"{method} {path} HTTP/1.1", f"Host: {host or self.host}", *headers)
        return self.send("\r\n".join(lines) + "\r\n\r\n")

    def status(self, *request, **options):
        """The answer's status; "closed" for none."""
        with self.request(*request, **options) as connection:
            return status_of(connection)

    def tab(self):
        """An open WebSocket, or what was answered instead."""
        connection = self.request(self.root + "live", *UPGRADE)
        status = status_of(connection)
        return connection if status == "101" else status

    def open_s(self):
        """How long a page and its tab take to open; None where they do not."""
        begin = time.monotonic()
        if self.status(self.root) != "200" or isinstance(self.tab(), str):
            return None
        return time.monotonic() - begin


def status_of(connection):
    try:
        words = connection.recv(4096).decode(errors="replace").split()
    except OSError:
        words = []
    return words[1] if len(words) > 1 else "closed"


def attacks(site):
    """Yields (what, what was answered, whether that is right). Connections stay open to the end."""
    evil, root = "http://evil.example", site.root
    for what, expected, request, options in (
        ("wrong secret", "404", ("/" + "0" * 32 + "/",), {}),
        ("no secret", "404", ("/",), {}),
        ("a file", "404", (root + "../../etc/passwd",), {}),
        ("wrong origin", "403", (root, "Origin: " + evil), {}),
        ("a tab of a wrong origin", "403", (root + "live", "Origin: " + evil, *UPGRADE), {}),
        ("wrong host", "403", (root,), {"host": "evil.example"}),
        ("a post", "405", (root,), {"method": "POST"}),
        ("a body of 1 GB", "413", (root, "Content-Length: 1000000000"), {"method": "POST"}),
        ("a header of 20 kB", "431", (root, "X: " + "x" * 20_000), {}),
    ):
        status = site.status(*request, **options)
        yield what, status, status == expected

    half = [site.send(f"GET {root} HTTP/1.1\r\nHost: 127") for _ in range(200)]
    yield "200 half requests", "nothing", True
    silent = [site.send("") for _ in range(200)]
    yield "200 silent connections", "nothing", True
    pages = [site.request(root) for _ in range(100)]
    yield "100 pages that nobody reads", "nothing", True
    tabs = [site.tab() for _ in range(63)]
    refused = [tab for tab in tabs if isinstance(tab, str)]
    yield "63 tabs of one client", f"{63 - len(refused)} opened", True
    begin = time.monotonic()
    late = site.send("GET ")
    status = status_of(late)
    passed_s = time.monotonic() - begin
    yield "half a request, waited for", f"{status} after {passed_s:.1f} s", passed_s < 3
    del half, silent, pages, tabs


def main():
    program = subprocess.Popen(
        [PROGRAM, "view", "pool_active", "--set", "trial.duration_s=600", "--port", "0", "--quiet"],
        stdout=subprocess.PIPE,
        text=True,
    )
    failed = 0
    try:
        site = Site(program.stdout.readline().strip())
        print("| attack | answer | page and tab open after it, s | |\n|---|---|---|---|")
        for what, answer, is_right in attacks(site):
            opened_s = site.open_s()
            is_open = opened_s is not None and opened_s < MOST_S
            failed += not (is_right and is_open)
            said = "no" if opened_s is None else f"{opened_s:.2f}"
            print(f"| {what} | {answer} | {said} | {'' if is_right and is_open else 'FAILED'} |", flush=True)
    finally:
        program.send_signal(signal.SIGINT)
        program.wait()
    return int(failed > 0)


sys.exit(main())
