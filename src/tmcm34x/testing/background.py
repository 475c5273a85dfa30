"""An event loop on a thread of its own: links work on it while the test's thread is in host code."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from threading import Thread
from typing import Any, TypeVar

Result = TypeVar("Result")


class Background:
    """A running event loop."""

    def __init__(self) -> None:
        self.loop = asyncio.new_event_loop()
        self.errors: list[BaseException] = []
        """What was raised in the loop outside a call that would report it."""
        self.loop.set_exception_handler(self._keep)
        self._thread = Thread(target=self.loop.run_forever, name="tmcm34x", daemon=True)
        self._thread.start()

    def _keep(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        self.errors.append(context.get("exception") or RuntimeError(context["message"]))

    def call(self, function: Callable[[], Result]) -> Result:
        """What `function` returns, called on the loop."""
        future: Future[Result] = Future()

        def work() -> None:
            try:
                future.set_result(function())
            except BaseException as error:
                future.set_exception(error)

        self.loop.call_soon_threadsafe(work)
        return future.result()

    def await_(self, coroutine: Coroutine[Any, Any, Result]) -> Result:
        """What `coroutine` returns, run on the loop."""
        return asyncio.run_coroutine_threadsafe(coroutine, self.loop).result()

    def close(self) -> None:
        """Stop the loop and its thread.  Raises what was raised in the loop."""
        self.await_(asyncio.sleep(0))
        self.loop.call_soon_threadsafe(self.loop.stop)
        self._thread.join()
        self.loop.close()
        if self.errors:
            raise self.errors[0]
