"""The one port of a page that this machine serves: who may come in, and from where.

A page on this machine is reached under this machine's own name only, so that no other page that is open in the same
browser talks to it. One that is bound to the network wants a token: with the first visit as `?token=...`, and from then
on as a cookie.
"""

import asyncio
import contextlib
import hmac
import ipaddress
import threading
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

from surgisim.problem import Problem

COOKIE = "surgisim"
SHORTEST = 16
"""Fewest characters of a token."""
MOST_HEAD = 64 * 1024
"""Longest request line and headers that are read [bytes]."""
PATIENCE = 10.0
"""How long a request's headers may take to arrive [s]."""
OWN = ("localhost", "127.0.0.1", "::1")


def local(host: str) -> bool:
    """Whether only this machine reaches what is bound there."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def checked_token(host: str, token: str | None) -> str | None:
    """The token that visitors must bring. Raises Problem where one is wanted and none, or a short one, is given."""
    if token is not None and len(token) < SHORTEST:
        raise Problem(f"--token has {len(token)} characters, and at least {SHORTEST} are wanted. Choose a longer one.")
    if token is None and not local(host):
        raise Problem(
            f"--host {host} lets others on the network in, and no token is set. Give one of at least {SHORTEST} "
            "characters by --token or in SURGISIM_TOKEN, or leave --host at localhost and reach it through ssh -L."
        )
    return token


@dataclass(frozen=True)
class Head:
    """What a request begins with."""

    method: str
    target: str
    headers: dict[str, str]
    """By lower-case name."""

    @classmethod
    def parsed(cls, raw: bytes) -> "Head | None":
        lines = raw.decode("latin-1").split("\r\n")
        words = lines[0].split(" ")
        if len(words) != 3 or not words[2].startswith("HTTP/1."):
            return None
        pairs = (line.split(":", 1) for line in lines[1:] if ":" in line)
        return cls(words[0], words[1], {name.strip().lower(): value.strip() for name, value in pairs})

    @property
    def cookie(self) -> str | None:
        try:
            found = SimpleCookie(self.headers.get("cookie", "")).get(COOKIE)
        except CookieError:
            return None
        return found.value if found else None


def refusal(head: Head | None, token: str | None) -> tuple[int, str] | None:
    """Status and sentence for a request that may not come in; None lets it in."""
    if head is None:
        return 400, "This is no HTTP request."
    host = head.headers.get("host", "")
    name = urlsplit(f"//{host}").hostname
    if token is None and name not in OWN:
        return 403, f"'{host}' is not this machine's own name. Open it as localhost."
    origin = head.headers.get("origin")
    if origin is not None and urlsplit(origin).netloc != host:
        return 403, f"A page of {origin} may not talk to this one."
    given = head.cookie or parse_qs(urlsplit(head.target).query).get("token", [""])[0]
    if token is not None and not hmac.compare_digest(given.encode(), token.encode()):
        return 401, "A token is wanted: open the address that 'surgisim' printed, with ?token=..."
    return None


class Gate:
    """A server in front of one on a port of this machine alone; it lets through what `refusal` does not stop."""

    def __init__(self, host: str, port: int, behind: int, token: str | None) -> None:
        """port: 0 takes a free one. Raises Problem where host and port cannot be bound."""
        self.behind, self.token = behind, checked_token(host, token)
        self._loop = asyncio.new_event_loop()
        try:
            self._server = self._loop.run_until_complete(
                asyncio.start_server(self._visited, host, port, limit=MOST_HEAD)
            )
        except OSError as error:
            raise Problem(f"--host {host} --port {port}: cannot be bound ({error}). Choose another port.") from error
        self.port = self._server.sockets[0].getsockname()[1]
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()

    def close(self) -> None:
        async def closed() -> None:
            self._server.close()
            for task in asyncio.all_tasks() - {asyncio.current_task()}:
                task.cancel()

        asyncio.run_coroutine_threadsafe(closed(), self._loop).result(5)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(5)

    async def _visited(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        # A visitor that breaks off is no fault.
        with contextlib.suppress(ConnectionError, asyncio.IncompleteReadError, TimeoutError, asyncio.CancelledError):
            try:
                await self._answered(reader, writer)
            finally:
                writer.close()

    async def _answered(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            raw = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), PATIENCE)
        except asyncio.LimitOverrunError:
            await _said(writer, 431, "The request's headers are too long.")
            return
        head = Head.parsed(raw)
        stopped = refusal(head, self.token)
        if stopped:
            await _said(writer, *stopped)
            return
        if self.token is not None and head.cookie is None:
            cookie = f"{COOKIE}={self.token}; HttpOnly; SameSite=Strict; Path=/"
            await _said(writer, 303, "", Location="/", **{"Set-Cookie": cookie})
            return
        there, onward = await asyncio.open_connection("127.0.0.1", self.behind)
        # One request a connection, but for a websocket, so that each is looked at.
        if "upgrade" not in head.headers:
            lines = [line for line in raw.split(b"\r\n") if not line.lower().startswith(b"connection:")]
            raw = b"\r\n".join([lines[0], b"Connection: close", *lines[1:]])
        onward.write(raw)
        ways = [asyncio.create_task(_piped(*pair)) for pair in ((reader, onward), (there, writer))]
        # Either side that is done ends both.
        await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        for way in ways:
            way.cancel()
        onward.close()


async def _piped(source: asyncio.StreamReader, sink: asyncio.StreamWriter) -> None:
    with contextlib.suppress(ConnectionError):
        while data := await source.read(1 << 16):
            sink.write(data)
            await sink.drain()


async def _said(writer: asyncio.StreamWriter, status: int, words: str, **headers: str) -> None:
    body = words.encode()
    fields = {"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body)), "Connection": "close"}
    lines = [f"HTTP/1.1 {status} -", *(f"{k}: {v}" for k, v in (fields | headers).items())]
    writer.write("\r\n".join([*lines, "", ""]).encode() + body)
    await writer.drain()
