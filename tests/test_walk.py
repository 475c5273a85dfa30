"""docs/architecture.md follows one command through the layers; so does this test."""

import asyncio
import importlib
import re
import sys
from pathlib import Path

from tmcm34x import clock
from tmcm34x.bench import simple_rig
from tmcm34x.links.tcp import TcpLink
from tmcm34x.server import Server
from tmcm34x.tmcl.datagram import SIZE, pack_request, unpack_reply
from tmcm34x.tmcl.mnemonic import parse_instruction

TEXT = (Path(__file__).parent.parent / "docs" / "architecture.md").read_text()
WALK = TEXT[TEXT.index("## One command on its way") : TEXT.index("## Reading order")]


def steps():
    """The functions that each step of the walk names, in their order."""
    found = re.split(r"(?m)^\d\. ", WALK)[1:]
    return [
        [name for name in re.findall(r"`([a-z0-9_]+(?:\.\w+)+)`", step) if function(name)] for step in found
    ]


def function(name):
    """The function of that dotted name below `tmcm34x`; None for a package or module."""
    parts = name.split(".")
    for end in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(("tmcm34x", *parts[:end])))
        except ModuleNotFoundError:
            continue
        for part in parts[end:]:
            found = getattr(found, part)
        return found if callable(found) else None
    raise AssertionError(f"there is no {name}")


def compiled(name):
    """Whether the function is in a compiled module, in which Python sees no calls."""
    return not hasattr(function(name), "__code__")


def calls_of(work):
    """The functions of the product that `work` calls, in their order."""
    called = []

    def profile(frame, event, _):
        module = frame.f_globals.get("__name__", "")
        if event == "call" and module.startswith("tmcm34x."):
            called.append(f"{module.removeprefix('tmcm34x.')}.{frame.f_code.co_qualname}")

    sys.setprofile(profile)
    try:
        work()
    finally:
        sys.setprofile(None)
    return called


def walk():
    """Send the command over TCP; then let its move happen in virtual time."""

    async def send(rig):
        server = Server(rig, speed=0, monotonic=lambda: 0.0)
        address = await server.open(TcpLink("127.0.0.1", 0))
        reader, writer = await asyncio.open_connection(*address.rsplit(":", 1))
        writer.write(pack_request(1, parse_instruction("MVP ABS, 1, 90000")))
        reply = unpack_reply(await reader.readexactly(SIZE))
        assert (reply.status, reply.value) == (100, 90000)
        writer.close()
        await server.close()

    rig = simple_rig()
    asyncio.run(send(rig))
    clock.run_until(rig, rig.now + 10 * clock.HZ)
    assert rig.modules[0].axes[1].at_target


def test_the_walk_names_functions_in_every_step():
    assert [len(step) > 0 for step in steps()] == [True] * 9


def test_the_command_takes_the_way_that_the_walk_describes():
    called = calls_of(walk)
    names = [name for step in steps() for name in step if not compiled(name)]
    missing = [name for name in names if name not in called]
    assert not missing
    at = 0
    for name in names:
        assert name in called[at:], f"{name} is not called after the function before it in the walk"
        at = called.index(name, at)


def test_the_pictures_of_the_layers_are_those_that_are_checked():
    import tomllib

    configuration = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text())
    contracts = [row for row in configuration["tool"]["importlinter"]["contracts"] if row["type"] == "layers"]
    pictures = re.findall(r"```\n(.*?)```", TEXT[: TEXT.index("## State")], re.S)
    for contract, picture in zip(contracts, pictures, strict=True):
        drawn = [re.split(r" {2,}", line)[0] for line in picture.strip().splitlines()]
        assert drawn == [layer for layer in contract["layers"] if layer != "__main__"]
