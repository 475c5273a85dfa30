from __future__ import annotations

import asyncio
import urllib.error
import urllib.request

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from ide.ide_driver import TOKEN, Ide, running
from tmcm34x.ide import wire


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *_):
        return None


def _get(ide: Ide, path: str, cookie: str = "", host: str = "") -> tuple[int, dict[str, str], str]:
    request = urllib.request.Request(ide.origin + path)
    if cookie:
        request.add_header("Cookie", f"tmcm34x-{ide.port}={cookie}")
    if host:
        request.add_header("Host", host)
    try:
        with urllib.request.build_opener(_NoRedirect, urllib.request.ProxyHandler({})).open(
            request
        ) as answer:
            return answer.status, dict(answer.headers), answer.read().decode()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, dict(error.headers), error.read().decode()


async def _fetch(ide: Ide, path: str, **more: str) -> tuple[int, dict[str, str], str]:
    return await asyncio.to_thread(_get, ide, path, **more)


def test_the_token_of_the_address_becomes_a_cookie_that_scripts_cannot_read(tmp_path):
    async def scenario():
        async with running(tmp_path) as ide:
            status, headers, _ = await _fetch(ide, f"/?token={TOKEN}")
            assert status == 303
            assert headers["location"] == "/"
            assert f"tmcm34x-{ide.port}={TOKEN}" in headers["set-cookie"]
            assert "HttpOnly" in headers["set-cookie"]
            assert "SameSite=strict" in headers["set-cookie"]

    asyncio.run(scenario())


@pytest.mark.parametrize("path", ["/", "/?token=wrong", "/?token=", "/alive"])
def test_without_the_token_nobody_comes_in(tmp_path, path):
    async def scenario():
        async with running(tmp_path) as ide:
            assert (await _fetch(ide, path))[0] == 403
            assert (await _fetch(ide, path, cookie="wrong"))[0] == 403

    asyncio.run(scenario())


def test_the_page_allows_nothing_from_elsewhere(tmp_path):
    async def scenario():
        async with running(tmp_path) as ide:
            status, headers, body = await _fetch(ide, "/", cookie=TOKEN)
            assert status == 200
            assert "/static/page.js" in body
            assert "default-src 'none'" in headers["content-security-policy"]
            assert (await _fetch(ide, "/alive", cookie=TOKEN))[0] == 204

    asyncio.run(scenario())


def test_a_foreign_name_for_this_machine_finds_nothing(tmp_path):
    async def scenario():
        async with running(tmp_path) as ide:
            for path in ("/", "/alive", "/static/page.js", f"/?token={TOKEN}"):
                status, _, _ = await _fetch(ide, path, cookie=TOKEN, host="evil.example")
                assert status == 403

    asyncio.run(scenario())


@pytest.mark.parametrize("name", ["nothing.js", "..%2fwire.py", "%2e%2e/wire.py", ".sources"])
def test_only_the_pages_own_files_are_served(tmp_path, name):
    async def scenario():
        async with running(tmp_path) as ide:
            assert (await _fetch(ide, f"/static/{name}"))[0] in {403, 404}

    asyncio.run(scenario())


@pytest.mark.parametrize("path", ["/wire", "/lsp"])
@pytest.mark.parametrize(
    ("origin", "token"),
    [("http://evil.example", TOKEN), ("null", TOKEN), (None, "wrong"), (None, "")],
)
def test_a_web_socket_needs_token_and_origin(tmp_path, path, origin, token):
    async def scenario():
        async with running(tmp_path) as ide:
            with pytest.raises(InvalidStatus) as refused:
                async with ide.socket(path, origin=origin, token=token):
                    pass
            assert refused.value.response.status_code == 403

    asyncio.run(scenario())


@pytest.mark.parametrize(
    ("message", "code"),
    [("rubbish", 1007), ("[1]", 1007), (b"\0\1", 1007), ("x" * (wire.MESSAGE_LIMIT + 1), 1009)],
)
def test_a_malformed_or_oversized_message_closes_the_web_socket_and_nothing_else(tmp_path, message, code):
    async def scenario():
        async with running(tmp_path) as ide, ide.page() as other:
            async with ide.socket() as bad:
                with pytest.raises(ConnectionClosed):
                    await bad.send(message)
                    while True:
                        await bad.recv()
                assert bad.close_code == code
            assert await other.call(wire.Ping()) is None
            await other.until(lambda: len(ide.hub.pages) == 1)

    asyncio.run(scenario())


def test_a_flood_of_calls_is_answered_or_refused_but_never_kept(tmp_path):
    async def scenario():
        async with running(tmp_path) as ide, ide.page() as page:
            ide.virtual.plugged = True
            answers = await asyncio.gather(*(page.ask(wire.Ping()) for _ in range(500)))
            assert {type(answer) for answer in answers} <= {wire.CallResult, wire.Refusal}
            assert all(answer.code == "busy" for answer in answers if isinstance(answer, wire.Refusal))
            assert await page.call(wire.Ping()) is None

    asyncio.run(scenario())
