"""Start-up times and memory.

Must reach: `tmcm34x --version` under 150 ms; `serve` ready under 400 ms and under 45 MB resident; under 300 KiB
for each further module in one process.
"""

import re
import statistics
import subprocess
import sys
import time
from pathlib import Path

TRIES = 9
COMMAND = str(Path(sys.executable).with_name("tmcm34x"))


def version_s() -> float:
    """How long the command takes to tell its version."""
    start = time.perf_counter()
    subprocess.run([COMMAND, "--version"], check=True, capture_output=True)
    return time.perf_counter() - start


def ready() -> tuple[float, float]:
    """How long until a served module can be used [s], and what it then takes of memory [MB]."""
    start = time.perf_counter()
    process = subprocess.Popen([COMMAND, "serve", "--pty", "--tcp", "0"], stdout=subprocess.PIPE, text=True)
    lines = [process.stdout.readline(), process.stdout.readline()]
    elapsed = time.perf_counter() - start
    assert [line.split()[0] for line in lines] == ["ready", "ready"]
    status = Path(f"/proc/{process.pid}/status").read_text()
    process.terminate()
    process.wait()
    return elapsed, int(re.search(r"VmRSS:\s*(\d+) kB", status).group(1)) * 1024 / 1e6


MODULES = """
import re
from pathlib import Path
from tmcm34x.bench import simple_rig
def resident():
    return int(re.search(r"VmRSS:\\s*(\\d+) kB", Path("/proc/self/status").read_text()).group(1))
rigs = [simple_rig()]
before = resident()
rigs += [simple_rig() for _ in range(100)]
print((resident() - before) / 100)
"""


def main() -> int:
    """Print the table; status 1 when a row misses its mark."""
    version_ms = statistics.median(version_s() for _ in range(TRIES)) * 1e3
    ready_s, resident_mb = zip(*(ready() for _ in range(TRIES)), strict=True)
    module_kib = float(subprocess.check_output([sys.executable, "-c", MODULES]))
    rows = (
        ("tmcm34x --version", version_ms, 150, "ms"),
        ("serve until ready", statistics.median(ready_s) * 1e3, 400, "ms"),
        ("serve, resident", max(resident_mb), 45, "MB"),
        ("each further module", module_kib, 300, "KiB"),
    )
    for name, value, limit, unit in rows:
        print(f"{name:22} {value:8.1f} {unit:4} must be under {limit:4} {'' if value < limit else 'MISSED'}")
    return 0 if all(value < limit for _, value, limit, _ in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
