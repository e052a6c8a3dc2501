"""A system with keys of its own, whose component `web-view` serves the page to other hosts."""

import base64
import hashlib
import json
import os
import pathlib
import ssl
import subprocess
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Only a hang takes this long.
DEADLINE_S = 60
HOST = "127.0.0.1"


class Site:
    """Keys, a running system whose component serves the page, and requests to it."""

    def __init__(self, armor, folder, registry, port):
        self.armor, self.folder, self.port = armor, folder, port
        self.url = f"https://{HOST}:{port}/"
        self.keys = folder / "keys"
        if not self.keys.exists():
            self.run_keys("init")
            self.run_keys("add", "robot", "--role", "host", "--at", HOST)
        self.context = ssl.create_default_context()
        self.run_keys("certificate", "--out", str(folder / "authority.crt"))
        self.context.load_verify_locations(cadata=(folder / "authority.crt").read_bytes())
        log = open(folder / "phone.log", "w")
        command = [armor, "run", str(ROOT / "missions/web.xml"), "--headless", "--registry", registry,
                   "--out", str(folder / "robot"), "--set", f"web.listen=0.0.0.0:{port}"]
        self.process = subprocess.Popen(command, stdout=log, stderr=log, cwd=folder,
                                        env={**os.environ, "ARMOR_KEYS": str(self.keys)})

    def run_keys(self, *arguments):
        command = [self.armor, "keys", *arguments, "--keys", str(self.keys), "--format", "json"]
        out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return [json.loads(line) for line in out.splitlines()]

    def invite(self, name, role):
        at = f"{HOST}:{self.port}"
        return self.run_keys("invite", name, "--role", role, "--at", at)[0]["link"]

    def spki(self):
        """The hash of the robot's public key, by which Chromium trusts it."""
        pem = ssl.get_server_certificate((HOST, self.port))
        public = subprocess.run(["openssl", "x509", "-pubkey", "-noout"], input=pem, text=True,
                                check=True, capture_output=True).stdout
        der = base64.b64decode("".join(public.splitlines()[1:-1]))
        return base64.b64encode(hashlib.sha256(der).digest()).decode()

    def ask(self, path, cookie="", **options):
        request = urllib.request.Request(self.url + path, headers={"Cookie": cookie}, **options)
        with urllib.request.urlopen(request, timeout=10, context=self.context) as response:
            return response.headers, json.load(response)

    def log_in(self, link):
        body = json.dumps({"invite": link.split("=")[1]}).encode()
        headers, _ = self.ask("api/login", data=body)
        return headers["set-cookie"].split(";")[0]

    def end(self):
        self.process.terminate()
        self.process.wait(DEADLINE_S)
