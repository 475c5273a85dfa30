"""The host library and its commands beside bare pyserial, a wire's capacity, and the clock.

- Round trips on a pseudo terminal: `Connection.command`, with all its checks, against pyserial's `write` and `read` of
  nine bytes; both take turns on one served module, the ratio is the median of the turns.
- A whole backup from a module that is paced to 9600 baud: how much of the wire's capacity it uses (18 bytes a telegram
  both ways, ten bits each), from its first telegram to its last.  The turnaround alone leaves 0.947; the median
  telegram shows what is lost where the computer has nothing else to do.  That nothing but telegrams takes time is a
  test in virtual time.
- `tmcm34x send` from its start to its end, against a served module.
- What `pip install tmcm34x` without extras takes: the package and all that it depends on.

Must reach: 0.85 of bare pyserial; 0.9 of the wire; 0.15 s; 15 MB.
"""

import resource
import statistics
import subprocess
import sys
import time
from importlib.metadata import distribution
from itertools import pairwise
from pathlib import Path

import serial

from tmcm34x.host import Connection, backup
from tmcm34x.tmcl.datagram import Instruction, pack_request

TURNS = 25
TURN_S = 0.12
STARTS = 9
SERVE = [sys.executable, "-m", "tmcm34x", "serve"]
TELEGRAM_S = 18 * 10 / 9600


def serve(*options: str) -> tuple[subprocess.Popen[str], str]:
    """A served module and the address of its line."""
    process = subprocess.Popen([*SERVE, *options], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, process.stdout.readline().split()[2]


def round_trips() -> float:
    """The library's round trips per second over those of bare pyserial."""
    process, address = serve("--pty")
    telegram = pack_request(1, Instruction(6, 1, 0))
    ratios, rates = [], []
    with serial.Serial(address, 9600, timeout=1.0) as port, Connection.open(address) as connection:
        write, read = port.write, port.read

        def bare() -> None:
            write(telegram)
            assert len(read(9)) == 9

        def checked() -> None:
            connection.command(6, 1, 0)

        for _ in range(TURNS):
            counts = [turn(bare), turn(checked)]
            ratios.append(counts[1] / counts[0])
            rates.append(counts[0] / TURN_S)
    process.terminate()
    process.wait()
    ratio = statistics.median(ratios)
    print(f"round trips: pyserial {statistics.median(rates):.0f}/s, library {ratio:.2f} of it")
    return ratio


def turn(work: object) -> int:
    """How often `work` is done in a turn."""
    count, end = 0, time.perf_counter() + TURN_S
    while time.perf_counter() < end:
        work()  # type: ignore[operator]
        count += 1
    return count


def wire_use() -> float:
    """The part of the wire's capacity that a whole backup uses."""
    process, address = serve("--pty", "--pace")
    times = []
    with Connection.open(address) as connection:
        connection.listeners.append(lambda sent, _: times.append(time.perf_counter()) if sent else None)
        saved = connection.run(backup.read())
    process.terminate()
    process.wait()
    median = TELEGRAM_S / statistics.median(end - begin for begin, end in pairwise(times))
    elapsed = times[-1] - times[0]
    use = (len(times) - 1) * TELEGRAM_S / elapsed
    print(
        f"backup at 9600 baud: {len(times)} telegrams in {elapsed:.1f} s, {use:.1%} of the wire in all, {median:.1%} "
        f"in the median, complete: {saved.complete}"
    )
    return use


def start_s() -> float:
    """Seconds from the start of `tmcm34x send` to its end."""
    process, address = serve("--tcp", "0")
    command = [str(Path(sys.executable).with_name("tmcm34x")), "send", "GAP 1, 0", "--port", f"tcp:{address}"]
    times = []
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    for _ in range(STARTS):
        begin = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - begin)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    process.terminate()
    process.wait()
    busy = (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) / STARTS
    print(
        f"send: {min(times) * 1000:.0f} ms at best, {statistics.median(times) * 1000:.0f} ms in the median, "
        f"{busy * 1000:.0f} ms of processor time"
    )
    return statistics.median(times)


def installed_mb() -> float:
    """Megabytes of the package and its dependencies."""
    sizes: dict[str, float] = {}
    waiting = ["tmcm34x"]
    while waiting:
        name = waiting.pop()
        if name in sizes:
            continue
        try:
            found = distribution(name)
        except ModuleNotFoundError:
            continue
        files = [Path(str(file.locate())) for file in found.files or ()]
        sizes[name] = (
            sum(path.stat().st_size for path in files if path.is_file() and path.suffix != ".pyc") / 1e6
        )
        waiting += [
            requirement.split(";")[0]
            .split("[")[0]
            .split("<")[0]
            .split(">")[0]
            .split("=")[0]
            .split("~")[0]
            .strip()
            for requirement in found.requires or ()
            if "extra ==" not in requirement
        ]
    sizes["tmcm34x"] = (
        sum(
            path.stat().st_size
            for path in (Path(__file__).parent.parent / "src").rglob("*")
            if path.suffix != ".pyc"
        )
        / 1e6
    )
    total = sum(sizes.values())
    largest = sorted(sizes.items(), key=lambda item: -item[1])[:4]
    print(f"installed: {total:.1f} MB ({', '.join(f'{name} {size:.1f}' for name, size in largest)})")
    return total


def main() -> int:
    """Print the figures; status 1 when one misses its mark."""
    rows = (
        ("of pyserial's round trips", round_trips(), "at least", 0.85),
        ("of the wire", wire_use(), "at least", 0.9),
        ("s until send has ended", start_s(), "at most", 0.15),
        ("MB installed", installed_mb(), "at most", 15),
    )
    reached = [figure >= must if bound == "at least" else figure <= must for _, figure, bound, must in rows]
    for (name, figure, bound, must), good in zip(rows, reached, strict=True):
        print(f"{figure:6.2f} {name}, must be {bound} {must}{'' if good else ': MISSED'}")
    return 0 if all(reached) else 1


if __name__ == "__main__":
    sys.exit(main())
