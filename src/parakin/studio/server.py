"""The studio's server: its page, files and runs over HTTP, on this computer only."""

from __future__ import annotations

import asyncio
import json
import secrets
import signal
import socket
import tempfile
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote as quote_url

import uvicorn
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route

from ..description import list_shipped_machines
from ..errors import InputError
from .forms import Form, write_line
from .request_guard import LOOPBACK, Guard
from .runs import Run, RunQueue
from .sessions import Session, Sessions

_TEXT_TYPES = {".js": "text/javascript", ".css": "text/css", ".html": "text/html"}
_OWN_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data:; frame-src 'self'"
)
_FRAMED = "frame-ancestors 'self'"
# A file that a command wrote may be looked at, but is not the studio: it gets an origin of its own.
_FILE_POLICY = f"sandbox allow-scripts; {_FRAMED}"
_ATTACHED = {".html", ".svg", ".png", ".pdf", ".txt"}  # kinds that a browser shows
_LINE, _LONGEST_LINE = 100, 1000  # letters that a page shows beside each other
_LARGEST_OBJECT = 100 * 2**10  # bytes


class _TooLargeError(InputError):
    """Data that there is no room for."""


class Studio:
    """What a studio serves: forms of commands, sessions, runs.

    start : what the page shows first: ``machine``, a name, and ``part``, a file's name or ""
    """

    def __init__(
        self, forms: Mapping[str, Form], machines: Sequence[str], start: Mapping[str, str], sessions: Sessions
    ):
        self._forms, self._machines, self._start, self._sessions = forms, machines, start, sessions
        self._queue = RunQueue()

    def make_application(self) -> Starlette:
        """Make the application, without its guard."""
        in_session = "/sessions/{session}"
        routes = [
            Route("/", _serve_own("studio.html")),
            *(Route(f"/{name}", _serve_own(name)) for name in ("studio.js", "runs.js", "results.js", "studio.css")),
            Route("/commands", self._answer(self._describe)),
            Route("/machines/{name}", self._answer(self._send_machine_file)),
            Route("/sessions", self._answer(self._open_session), methods=["POST"]),
            Route(f"{in_session}/files", self._answer(self._list_files)),
            Route(f"{in_session}/files/{{name:path}}", self._answer(self._send_file)),
            Route(f"{in_session}/files/{{name:path}}", self._answer(self._take_file), methods=["PUT"]),
            Route(f"{in_session}/packed.zip", self._answer(self._send_packed)),
            Route(f"{in_session}/packed/{{name:path}}.zip", self._answer(self._send_packed)),
            Route(f"{in_session}/page/{{name:path}}", self._answer(self._send_page)),
            Route(f"{in_session}/runs", self._answer(self._list_runs)),
            Route(f"{in_session}/runs", self._answer(self._begin_run), methods=["POST"]),
            Route(f"{in_session}/runs/{{run:int}}", self._answer(self._tell_run)),
            Route(f"{in_session}/runs/{{run:int}}", self._answer(self._cancel_run), methods=["DELETE"]),
        ]
        return Starlette(routes=routes, lifespan=self._live)

    @asynccontextmanager
    async def _live(self, application: Starlette) -> AsyncIterator[None]:
        yield
        await self._queue.cancel_all()

    def _answer(self, action: Callable[[Request], Awaitable[Response]]) -> Callable[[Request], Awaitable[Response]]:
        """Answer what is wrong with a request in one line."""

        async def answer(request: Request) -> Response:
            try:
                return await action(request)
            except _TooLargeError as error:  # what is still to come is not read: the connection ends
                return JSONResponse({"error": str(error)}, status_code=413, headers={"connection": "close"})
            except InputError as error:
                return JSONResponse({"error": str(error)}, status_code=400)
            except LookupError:
                return JSONResponse({"error": "no such thing"}, status_code=404)
            except ClientDisconnect:  # amid an upload: nobody reads the answer
                return Response(status_code=400)

        return answer

    def _find_session(self, request: Request) -> Session:
        session = self._sessions.find_session(request.path_params["session"])
        if session is None:
            raise LookupError
        return session

    def _find_run(self, request: Request) -> Run:
        return self._find_session(request).runs[request.path_params["run"]]

    async def _describe(self, request: Request) -> Response:
        forms = [asdict(form) for form in self._forms.values()]
        return JSONResponse({"commands": forms, "machines": list(self._machines), "start": dict(self._start)})

    async def _send_machine_file(self, request: Request) -> Response:
        """Send the file of a shipped machine."""
        path = list_shipped_machines()[request.path_params["name"]]
        return FileResponse(path, media_type="text/plain", headers={"content-security-policy": _FILE_POLICY})

    async def _open_session(self, request: Request) -> Response:
        return JSONResponse({"session": self._sessions.open_session()})

    async def _list_files(self, request: Request) -> Response:
        listed = self._find_session(request).list_files()
        return JSONResponse({"files": [file._asdict() for file in listed]})

    async def _send_file(self, request: Request) -> Response:
        path = self._find_session(request).find_file(request.path_params["name"])
        if not path.is_file():
            raise LookupError
        shown = path.suffix.lower() in _ATTACHED
        return FileResponse(
            path,
            filename=path.name,
            content_disposition_type="inline" if shown else "attachment",
            headers={"content-security-policy": _FILE_POLICY},
        )

    async def _send_packed(self, request: Request) -> Response:
        """Send a folder's files, or all, as one file."""
        folder = request.path_params.get("name", "")
        content = await asyncio.to_thread(self._find_session(request).pack_files, folder)
        name = f"{folder.replace('/', '_') or 'studio'}.zip"
        headers = {"content-disposition": f"attachment; filename*=UTF-8''{quote_url(name)}"}
        return Response(content, media_type="application/zip", headers=headers)

    async def _send_page(self, request: Request) -> Response:
        """Send a page that ``parakin page`` wrote, of the studio's own origin, so that both can talk."""
        path = self._find_session(request).find_file(request.path_params["name"])
        if path.suffix != ".html" or not path.is_file():
            raise LookupError
        return FileResponse(path, headers={"content-security-policy": _FRAMED}, media_type="text/html")

    async def _take_file(self, request: Request) -> Response:
        session, name = self._find_session(request), request.path_params["name"]
        session.find_place(name)  # before the data is read
        content = await _read_body(request, session.measure_room(), name)
        session.write_file(name, content)
        return JSONResponse({"name": name, "size": len(content)})

    async def _list_runs(self, request: Request) -> Response:
        runs = self._find_session(request).runs
        return JSONResponse({"runs": [{"run": number, "line": run.line} for number, run in runs.items()]})

    async def _begin_run(self, request: Request) -> Response:
        session, content = self._find_session(request), await _read_json(request)
        form = self._forms.get(str(content.get("command")))
        if form is None:
            raise InputError("command: one of " + ", ".join(self._forms) + " expected")
        values = content.get("values")
        if not isinstance(values, dict):
            raise InputError("values: an object by the parameters' names expected")
        columns = content.get("columns", _LINE)
        if not isinstance(columns, int) or not 1 <= columns <= _LONGEST_LINE:
            raise InputError(f"columns: 1 to {_LONGEST_LINE} expected, letters of a line")
        run = self._queue.begin(write_line(form, values), session.folder, columns)
        return JSONResponse({"run": session.add_run(run), "line": run.line})

    async def _tell_run(self, request: Request) -> Response:
        run = self._find_run(request)
        return JSONResponse({
            "line": run.line, "state": run.state, "code": run.code, "seconds": run.seconds,
            "output": run.output.decode(errors="replace"), "errors": run.errors.decode(errors="replace"),
        })  # fmt: skip

    async def _cancel_run(self, request: Request) -> Response:
        await self._queue.cancel(self._find_run(request))
        return await self._tell_run(request)


async def _read_body(request: Request, most: int, what: str) -> bytes:
    """Read the body of a request, bytes; one of more than the most is refused as soon as its size is known."""

    def check(size: int) -> None:
        if size > most:
            raise _TooLargeError(f"{what}: larger than {_format_size(most)}, the most that there is room for")

    check(int(request.headers.get("content-length", "0")))
    body = bytearray()
    async for block in request.stream():
        body += block
        check(len(body))
    return bytes(body)


def _format_size(size: int) -> str:
    return f"{size >> 20} MiB" if size >= 2**20 else f"{size >> 10} KiB"


async def _read_json(request: Request) -> dict[str, Any]:
    """Read a small JSON object."""
    body = await _read_body(request, _LARGEST_OBJECT, "a JSON object")
    try:
        value = json.loads(body)
    except (ValueError, RecursionError):
        raise InputError("a JSON object expected") from None
    if not isinstance(value, dict):
        raise InputError("a JSON object expected")
    return value


def _serve_own(name: str) -> Callable[[Request], Awaitable[Response]]:
    """Serve a file of the studio itself."""
    content = files(__package__).joinpath(name).read_bytes()
    headers = {"content-security-policy": f"{_OWN_POLICY}; {_FRAMED}"}

    async def send(request: Request) -> Response:
        return Response(content, media_type=_TEXT_TYPES[Path(name).suffix], headers=headers)

    return send


def serve(
    forms: Mapping[str, Form],
    machines: Sequence[str],
    start: Mapping[str, str],
    given: Sequence[Path],
    port: int,
    announce: Callable[[str, Path], None],
) -> None:
    """Serve a studio on this computer until it is interrupted or ended, or its terminal is closed.

    given : files that every page begins with copies of
    port : 0 for a free one
    announce : called with the address once it listens, and with a file, for this user only, that leads there: what is
        given to a browser as an argument others can see
    """
    with tempfile.TemporaryDirectory(prefix="parakin_studio_") as folder, socket.socket() as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((LOOPBACK, port))
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or "no port"
            raise InputError(f"{port}: {reason}, expected a free port, 0 to 65535", "--port") from None
        listener.listen()
        own_port = listener.getsockname()[1]
        token = secrets.token_urlsafe(24)
        studio = Studio(forms, machines, start, Sessions(Path(folder), given))
        guarded = Guard(studio.make_application(), token, own_port)
        config = uvicorn.Config(guarded, log_level="error", access_log=False, ws="none", server_header=False)
        server, address = uvicorn.Server(config), f"http://{LOOPBACK}:{own_port}/{token}/"
        _end_on_signals(server)
        announce(address, _write_way(Path(folder), address))
        with suppress(KeyboardInterrupt):
            asyncio.run(server.serve(sockets=[listener]))


def _end_on_signals(server: uvicorn.Server) -> None:
    """End a server that is asked to end, or whose terminal is closed, so that its runs and files do not stay."""

    def end(number: int, frame: object) -> None:
        server.should_exit = True

    if threading.current_thread() is threading.main_thread():
        for name in ("SIGHUP", "SIGTERM"):  # not every system has both
            if hasattr(signal, name):
                signal.signal(getattr(signal, name), end)


def _write_way(folder: Path, address: str) -> Path:
    """Write a page that leads to an address."""
    path = folder / "parakin_studio.html"
    path.touch(mode=0o600)
    path.write_text(f'<meta http-equiv="refresh" content="0; url={address}"><a href="{address}">parakin studio</a>')
    return path
