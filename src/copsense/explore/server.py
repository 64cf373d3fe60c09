"""Server: viser's, behind a door: this machine alone, a token, its own origin, and no tunnel.

Viser itself listens to the whole network, accepts any page's connection, and opens a public tunnel
for every client. What is closed here leans on its insides, so that its version is capped and the
tests knock at every door.
"""

from __future__ import annotations

import contextlib
import dataclasses
import io
import ipaddress
import os
import secrets
import socket
import warnings
from collections.abc import Callable, Iterator
from http import HTTPStatus
from typing import Any
from unittest.mock import patch
from weakref import WeakSet

from copsense.errors import InvalidInputError, OutputError
from copsense.extras import require

LOOPBACK = "127.0.0.1"
_SERVE = "websockets.asyncio.server.serve"  # looked up by viser when it starts
_PORT_OVERRIDE = "_VISER_PORT_OVERRIDE"  # of the environment; it would change the port in silence


class GuardedServer:
    """A viser server that only the address with its token opens.

    Attributes:
        viser: the server.
        host: where it listens.
        port: and at which port.
        token: the secret part of `url`.
    """

    viser: Any
    host: str
    port: int
    token: str

    def __init__(self, port: int = 0, host: str = LOOPBACK) -> None:
        """Start it.

        Args:
            port: 0 for any that is free.
            host: an address of this machine; the loopback keeps others out.

        Raises:
            OutputError: the port is taken, or the host is not this machine's.
            InvalidInputError: no port.
            MissingExtraError: viser is not installed.
        """
        require("viser", "an explorer in the browser")
        if not 0 <= port <= 65535:
            raise InvalidInputError(f"the port {port} does not exist. Give 0 (any) to 65535.")
        self.host, self.port = host, _free_port(host, port)
        self.token = secrets.token_urlsafe(16)
        self._connections: WeakSet[Any] = WeakSet()
        import viser
        import websockets.asyncio.server as websockets_server

        serve = websockets_server.serve

        def guarded(handler: Any, *arguments: Any, process_request: Any, **options: Any) -> Any:
            options["process_request"] = self._guard(process_request)
            return serve(handler, *arguments, **options)

        override = os.environ.pop(_PORT_OVERRIDE, None)
        try:
            with patch(_SERVE, guarded), _quiet():
                self.viser = viser.ViserServer(host=host, port=self.port, verbose=False)
        finally:
            if override is not None:
                os.environ[_PORT_OVERRIDE] = override
        self._close_tunnel()
        # A tab may close while its camera is moved: nothing is lost.
        warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)
        if self.viser.get_port() != self.port:  # taken between the probe and now
            self.stop()
            raise OutputError(f"port {self.port} was taken meanwhile. Give another --port.")

    @property
    def url(self) -> str:
        """The address to open, token included."""
        host = LOOPBACK if _everywhere(self.host) else self.host
        shown = f"[{host}]" if ":" in host else host
        return f"http://{shown}:{self.port}/{self.token}/"

    def stop(self) -> None:
        """Stop it; stop what writes to it before."""
        self._drop_stalled()
        with _quiet():
            self.viser.stop()

    def _drop_stalled(self) -> None:
        """Cut off the tabs that take nothing: viser would wait six seconds for them."""

        def drop(connection: Any) -> None:
            if connection.transport.get_write_buffer_size():
                connection.transport.abort()

        for connection in list(self._connections):
            with contextlib.suppress(RuntimeError):  # its loop is over
                connection.loop.call_soon_threadsafe(drop, connection)

    def _close_tunnel(self) -> None:
        from viser import _messages

        for kind in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
            self.viser._websock_server.unregister_handler(kind)

    def _guard(self, serve_file: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
        """The door: a request without token, or of another page or name, gets 403."""

        def process_request(connection: Any, request: Any) -> Any:
            reason = self._objection(request)
            if reason:
                return connection.respond(HTTPStatus.FORBIDDEN, f"{reason}\n")
            self._connections.add(connection)
            path = request.path.removeprefix(f"/{self.token}") or "/"
            return serve_file(connection, dataclasses.replace(request, path=path))

        return process_request

    def _objection(self, request: Any) -> str:
        hosts = [value.lower() for value in request.headers.get_all("Host")]
        if not _everywhere(self.host) and any(host not in self._names for host in hosts):
            return "This is not the name of this server."
        origins = request.headers.get_all("Origin")
        own = {f"http://{host}" for host in hosts}
        if any(origin.lower() not in own for origin in origins) or len(hosts) != 1:
            return "Another page may not connect."
        start, _, _ = request.path.removeprefix("/").partition("/")
        given = start.partition("?")[0].encode()
        if not secrets.compare_digest(given, self.token.encode()):
            return "The address lacks its token: use the whole one that copsense printed."
        return ""

    @property
    def _names(self) -> set[str]:
        names = {self.host.lower()}
        if _is_loopback(self.host):
            names |= {LOOPBACK, "localhost"}
        return {f"{f'[{name}]' if ':' in name else name}:{self.port}" for name in names}


def _free_port(host: str, port: int) -> int:
    """The port, or a free one for 0: asked before viser, which takes another one in silence.

    Raises:
        OutputError: it is taken, or the host is not ours.
    """
    try:
        kind, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(kind, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
            return int(probe.getsockname()[1])
    except OSError as error:
        raise OutputError(
            f"nothing can listen at {host}:{port}: {error.strerror or error}. Give another --port, "
            "or leave it out for any that is free; --host is an address of this machine."
        ) from None


def _everywhere(host: str) -> bool:
    return host in ("", "0.0.0.0", "::")


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep viser's banner out of standard output, which may be JSON, and out of notebooks.

    There rich, which viser prints with, does not write to standard output.
    """
    with contextlib.redirect_stdout(io.StringIO()), patch("rich.print", lambda *_, **__: None):
        yield
