"""Bench files in the editor, and the examples: what pages ask for that touches no module."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.ide import examples, wire
from tmcm34x.ide.building import problem

if TYPE_CHECKING:
    from tmcm34x.ide.hub import Hub
    from tmcm34x.ide.window import Window


async def _check_bench(hub: Hub, page: Window, call: wire.CheckBench) -> wire.BenchCheck:
    from tmcm34x.bench.check import check, is_bench

    if not is_bench(call.path, call.text):
        return wire.BenchCheck(False, [])
    found = await asyncio.to_thread(check, call.text, call.path)
    return wire.BenchCheck(True, [problem(item) for item in found])


async def _complete_bench(hub: Hub, page: Window, call: wire.CompleteBench) -> list[wire.Suggestion]:
    from tmcm34x.bench.completion import complete

    found = await asyncio.to_thread(complete, call.text, call.line, call.column)
    return [wire.Suggestion(*suggestion) for suggestion in found]


async def _list_examples(hub: Hub, page: Window, call: wire.ListExamples) -> wire.Examples:
    return await asyncio.to_thread(examples.listed)


async def _read_example(hub: Hub, page: Window, call: wire.ReadExample) -> str:
    return await asyncio.to_thread(examples.text, call.path)


METHODS: Final[Mapping[type[wire.Call], Callable[..., Awaitable[object]]]] = {
    wire.CheckBench: _check_bench, wire.CompleteBench: _complete_bench, wire.ListExamples: _list_examples,
    wire.ReadExample: _read_example,
}  # fmt: skip
