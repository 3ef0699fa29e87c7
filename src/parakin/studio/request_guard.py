"""Who may ask the studio: pages that it served itself, on this computer, with the token of its address."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, MutableMapping
from hmac import compare_digest
from typing import Any, TypeAlias

Scope: TypeAlias = MutableMapping[str, Any]
Message: TypeAlias = MutableMapping[str, Any]
Receive: TypeAlias = Callable[[], Awaitable[Message]]
Send: TypeAlias = Callable[[Message], Awaitable[None]]
Application: TypeAlias = Callable[[Scope, Receive, Send], Awaitable[None]]

LOOPBACK = "127.0.0.1"
_NAMES = (LOOPBACK, "localhost")
# Of every answer: nothing is kept, framed or read by other sites, and no address with the token leaves the page.
_HEADERS = [
    (b"cache-control", b"no-store"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
]


class Guard:
    """An ASGI application before another: foreign hosts, foreign origins and wrong tokens get no further.

    token : the first part of every path
    port : at which the studio listens
    """

    def __init__(self, application: Application, token: str, port: int):
        self._application = application
        self._prefix = f"/{token}/".encode()
        self._hosts = {f"{name}:{port}".encode() for name in _NAMES}
        self._origins = {b"http://" + host for host in self._hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or pass it on without the token."""
        if scope["type"] == "lifespan":
            await self._application(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})  # the studio has none
        else:
            reason = self._find_reason(scope)
            await (_refuse(send, reason) if reason else self._pass_on(scope, receive, send))

    def _find_reason(self, scope: Scope) -> str | None:
        """Find why a request is refused; None if it is not."""
        headers: list[tuple[bytes, bytes]] = scope["headers"]
        given = {name: [value for key, value in headers if key == name] for name in (b"host", b"origin", b"upgrade")}
        if len(given[b"host"]) != 1 or given[b"host"][0] not in self._hosts:
            return "another host"
        if any(origin not in self._origins for origin in given[b"origin"]):
            return "another origin"
        if given[b"upgrade"]:
            return "no upgrade"
        begin = scope["path"].encode()[: len(self._prefix)]
        return None if compare_digest(begin, self._prefix) else "no token"

    async def _pass_on(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", []), *_HEADERS]
            await send(message)

        path = scope["path"][len(self._prefix) - 1 :]
        await self._application({**scope, "path": path, "raw_path": path.encode()}, receive, send_guarded)


async def _refuse(send: Send, reason: str) -> None:
    """Refuse a request in a word."""
    headers = [*_HEADERS, (b"content-type", b"text/plain; charset=utf-8"), (b"connection", b"close")]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": f"refused: {reason}\n".encode()})
