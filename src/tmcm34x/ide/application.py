"""The IDE's web application: one page, its files, three web sockets; for one person on this machine.

Who may come in: a browser that brings the token of the first address, as a cookie from then on, and whose pages
have this very origin.  A request for another host name is refused, so that another name pointed at this machine
finds nothing.
"""

from __future__ import annotations

import contextlib
import hmac
import mimetypes
from importlib.resources import files
from typing import TYPE_CHECKING, Final

import uvicorn
from starlette.applications import Starlette
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute

from tmcm34x.ide.connections import HttpConnection, SocketConnection
from tmcm34x.ide.debug_socket import DebugSocket
from tmcm34x.ide.language import Language
from tmcm34x.ide.page import Page
from tmcm34x.ide.wire import MESSAGE_LIMIT

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable

    from starlette.requests import HTTPConnection, Request
    from starlette.websockets import WebSocket

    from tmcm34x.ide.hub import Hub

LOOPBACK: Final = ("127.0.0.1", "localhost", "[::1]")

_HEADERS: Final = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self'; form-action 'none'; frame-ancestors 'none'; base-uri 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
}

_NOTE: Final = """<!doctype html><html lang="en"><meta charset="utf-8"><title>tmcm34x</title>
<style>body{{font:16px/1.5 system-ui,sans-serif;max-width:34em;margin:18vh auto;padding:0 1em;color:#17222c}}
code{{background:#e9edf1;padding:2px 5px;border-radius:4px}}
@media(prefers-color-scheme:dark){{body{{background:#0c1015;color:#dce5ec}}code{{background:#212b35}}}}</style>
<h1>{title}</h1><p>{text}</p></html>"""


class _Server(uvicorn.Server):
    """A server that leaves signals alone: whoever runs it has more to bring to an end than this."""

    @contextlib.contextmanager
    def capture_signals(self) -> Generator[None]:
        """Take no signal."""
        yield


class Application:
    """The routes.

    hosts: names under which this server may be addressed, with port; none lets any name pass
    token: what the first address carries
    """

    def __init__(self, hub: Hub, token: str, hosts: Iterable[str]) -> None:
        self._hub = hub
        self._token = token
        self._hosts = frozenset(hosts)
        self._cookie = "tmcm34x"
        self._static = files("tmcm34x.ide") / "static"
        self.starlette = Starlette(
            routes=[
                Route("/", self._index),
                Route("/alive", self._alive),
                Route("/static/{name}", self._asset),
                WebSocketRoute("/wire", self._wire),
                WebSocketRoute("/lsp", self._lsp),
                WebSocketRoute("/dap", self._dap),
            ]
        )

    def name_cookie(self, port: int) -> None:
        """Cookies are shared by all ports of a host, so each server needs a name of its own."""
        self._cookie = f"tmcm34x-{port}"

    def server(self) -> uvicorn.Server:
        """A server for the routes; on one machine compressing costs more than it saves."""
        return _Server(
            uvicorn.Config(
                self.starlette,
                http=HttpConnection,
                ws=SocketConnection,
                ws_max_size=MESSAGE_LIMIT,
                ws_per_message_deflate=False,
                log_config=None,
                log_level="error",
                access_log=False,
                timeout_graceful_shutdown=1,
                lifespan="off",
            )
        )

    # Who may come in

    def _known_host(self, connection: HTTPConnection) -> bool:
        return not self._hosts or connection.headers.get("host", "") in self._hosts

    def _token_fits(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self._token.encode())

    def _invited(self, connection: HTTPConnection) -> bool:
        return self._known_host(connection) and self._token_fits(connection.cookies.get(self._cookie, ""))

    def _own_page(self, socket: WebSocket) -> bool:
        origin = socket.headers.get("origin", "")
        return self._invited(socket) and origin == f"http://{socket.headers.get('host', '')}"

    # Pages

    async def _index(self, request: Request) -> Response:
        token = request.query_params.get("token")
        if token is not None and self._known_host(request) and self._token_fits(token):
            response = RedirectResponse("/", 303, _HEADERS)
            response.set_cookie(self._cookie, token, httponly=True, samesite="strict")
            return response
        if not self._invited(request):
            return _note(
                403,
                "Not this way",
                "Open the address that <code>tmcm34x ide</code> printed, with its token; "
                "each start of the server has a new one.",
            )
        page = self._static / "index.html"
        if not page.is_file():
            return _note(
                503,
                "The page was not built",
                "This copy of tmcm34x was installed without its page. Run <code>make web</code> in the source "
                "folder, or install the package anew with a network at hand.",
            )
        return HTMLResponse(page.read_bytes(), headers=_HEADERS)

    async def _alive(self, request: Request) -> Response:
        return Response(status_code=204 if self._invited(request) else 403)

    async def _asset(self, request: Request) -> Response:
        name = request.path_params["name"]
        if not self._known_host(request) or name.startswith("."):
            return Response(status_code=403)
        asset = self._static / name
        if not asset.is_file():
            return Response(status_code=404)
        return Response(asset.read_bytes(), media_type=mimetypes.guess_type(name)[0], headers=_HEADERS)

    # Web sockets

    async def _wire(self, socket: WebSocket) -> None:
        if not self._own_page(socket):
            await socket.close()
            return
        await socket.accept()
        await Page(self._hub, socket).serve()

    async def _lsp(self, socket: WebSocket) -> None:
        if not self._own_page(socket):
            await socket.close()
            return
        await socket.accept()
        await Language(self._hub.workspace, self._hub.target.model.number, socket).serve()

    async def _dap(self, socket: WebSocket) -> None:
        if not self._own_page(socket):
            await socket.close()
            return
        await socket.accept()
        await DebugSocket(self._hub.debugger, socket).serve()


def _note(status: int, title: str, text: str) -> Response:
    return HTMLResponse(_NOTE.format(title=title, text=text), status, _HEADERS)
