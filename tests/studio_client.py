"""A studio that runs beside a test, and requests to it as a browser or an attacker would send them."""

import http.client
import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from urllib.parse import quote, urlsplit


class StudioClient:
    """Requests to a studio by its address."""

    def __init__(self, address):
        self.address = address
        self.port = urlsplit(address).port
        self.prefix = urlsplit(address).path

    def request(self, path, method="GET", body=None, headers=None, whole=False):
        """Send a request; the status and the body. ``whole``: the path is sent as it is, without the token."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            connection.request(method, path if whole else self.prefix + path, body, headers or {})
            response = connection.getresponse()
            return response.status, response.read()
        finally:
            connection.close()

    def ask(self, path, method="GET", content=None):
        """Send JSON; the status and the JSON that comes back."""
        status, body = self.request(path, method, None if content is None else json.dumps(content))
        return status, json.loads(body)

    def open_session(self):
        return self.ask("sessions", "POST")[1]["session"]

    def put_file(self, session, name, content):
        status, body = self.request(f"sessions/{session}/files/{quote(name, safe='')}", "PUT", content)
        return status, json.loads(body)

    def begin_run(self, session, command, values):
        return self.ask(f"sessions/{session}/runs", "POST", {"command": command, "values": values})

    def wait_for_run(self, session, run, seconds=60.0):
        end = time.monotonic() + seconds
        while True:
            told = self.ask(f"sessions/{session}/runs/{run}")[1]
            if told["state"] not in ("waiting", "running"):
                return told
            assert time.monotonic() < end, told
            time.sleep(0.05)

    def run(self, session, command, values):
        status, begun = self.begin_run(session, command, values)
        assert status == 200, begun
        return self.wait_for_run(session, begun["run"])


@contextmanager
def run_studio(folder, *words, end=signal.SIGINT):
    """Run ``parakin studio`` in a folder; ends it by a signal, and it must end well."""
    process = subprocess.Popen(
        [sys.executable, "-m", "parakin", "studio", "--no-browser", *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "TMPDIR": str(folder), "PYTHONPATH": os.pathsep + os.environ.get("PYTHONPATH", "")},
    )  # fmt: skip; the empty entry is the folder in which Python runs
    try:
        line = process.stdout.readline()
        address = re.search(r"http://127\.0\.0\.1:\d+/[\w-]{32}/", line)
        assert address, line + process.stderr.read()
        yield StudioClient(address[0])
        process.send_signal(end)
        _, errors = process.communicate(timeout=20)
        assert (process.returncode, errors) == (-9 if end == signal.SIGKILL else 0, "")
    finally:
        process.kill()
        process.wait()
