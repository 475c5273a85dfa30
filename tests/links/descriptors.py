"""What comes from a file descriptor that does not block."""

import asyncio
import os


async def reads(fd, size):
    """The next `size` bytes from `fd`, or those that came within a minute."""
    data = b""
    for _ in range(60_000):
        try:
            data += os.read(fd, size - len(data))
        except BlockingIOError:
            await asyncio.sleep(0.001)
        if len(data) == size:
            break
    return data
