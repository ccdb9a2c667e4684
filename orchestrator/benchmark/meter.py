"""Runs a program and writes what it took: ``python meter.py REPORT PROGRAM [ARGUMENT ...]``.

It imports nothing of the package: the memory of a program includes that of the process which
starts it, until it is another program.
"""

import json
import resource
import subprocess
import sys
import time


def main(report: str, command: list[str]) -> int:
    """Run a command; write its exit code, wall and CPU time (s) and peak memory (MiB)."""
    started = time.monotonic()
    code = subprocess.call(command)
    seconds = time.monotonic() - started
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    found = {
        "returncode": code,
        "seconds": seconds,
        "cpu_s": used.ru_utime + used.ru_stime,
        "peak_mib": used.ru_maxrss / 1024,
    }
    with open(report, "w", encoding="utf-8") as stream:
        json.dump(found, stream)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
