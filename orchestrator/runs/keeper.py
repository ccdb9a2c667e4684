"""Runs a program that is not ours, and ends all of it: ``keeper.py ORDER PROGRAM [ARGUMENT ...]``.

`orchestrator.runs.confined` starts it, as the first process of a namespace of its own where the
system has them. It imports nothing of the package: the memory of a program includes that of the
process which starts it, until it is another program.
"""

import contextlib
import ctypes
import json
import os
import resource
import signal
import stat
import sys
import time
from collections.abc import Iterator
from typing import Any, NoReturn

LOOK_S = 0.25
"""Between two looks at what the program takes."""
WALK_S = 1.0
"""Least time between two looks at its files, which may be many."""
FAREWELL_S = 10.0
"""Most that is spent on ending processes that start others."""
FILES = 100_000
"""Most files of a program: a look at them must end."""
THREADS = 16
"""Most threads for each process that a program may have."""
ENTRY = 4096
"""A file takes this much of a disk even if it is empty, bytes."""
_SET_DEATH_SIGNAL, _SET_DUMPABLE, _SET_SUBREAPER = 1, 4, 36
"""Options of prctl on Linux."""
_READ_ONLY = 1
"""Flag of mount."""
_LIBC = ctypes.CDLL(None, use_errno=True)


def main(order: dict[str, Any], command: list[str]) -> None:
    """Run a command as ordered; write how it ended, and what it took, to the file ``report``."""
    os.set_inheritable(order["report"], False)
    signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGCHLD, signal.SIGTERM))
    if os.getpid() > 1:  # the first of a namespace takes all others with it
        _LIBC.prctl(_SET_DEATH_SIGNAL, signal.SIGTERM)
        _LIBC.prctl(_SET_SUBREAPER, 1)
    # the program may neither read nor change what this process holds
    _LIBC.prctl(_SET_DUMPABLE, 0)
    for path in order["hide"]:
        _hide(path)
    started = time.monotonic()
    program = os.fork()
    if program == 0:
        _become(command, order["disk"])
    code, broken = _watched(program, order)
    seconds = time.monotonic() - started
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    _end_family()
    broken = broken or _broken(order, walk=True)
    report = {
        "returncode": code,
        "broken": broken,
        "seconds": seconds,
        "cpu_s": used.ru_utime + used.ru_stime,
        "peak_mib": used.ru_maxrss / 1024,
    }
    os.write(order["report"], json.dumps(report).encode())


def _hide(path: str) -> None:
    """Put an empty directory over one that the program must not see."""
    if _LIBC.mount(b"none", os.fsencode(path), b"tmpfs", _READ_ONLY, b"size=4k"):
        raise OSError(ctypes.get_errno(), "cannot be hidden", path)


def _become(command: list[str], largest: int) -> NoReturn:
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    # Python ignores them, and a program would inherit that
    for number in (signal.SIGPIPE, signal.SIGXFSZ):
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    _LIBC.prctl(_SET_DEATH_SIGNAL, signal.SIGKILL)
    try:
        os.execvp(command[0], command)
    except OSError as error:
        print(f"{command[0]}: {error.strerror}", file=sys.stderr, flush=True)
        os._exit(127)


def _watched(program: int, order: dict[str, Any]) -> tuple[int | None, str]:
    """Wait for a program; its exit code, and the limit that it broke or nothing."""
    looked = walked = time.monotonic()
    while True:
        told = signal.sigtimedwait((signal.SIGCHLD, signal.SIGTERM), LOOK_S)
        code, now = _reaped(program), time.monotonic()
        if code is not None or (told and told.si_signo == signal.SIGTERM):
            return code, ""
        if now - looked > LOOK_S:
            walk = now - walked > WALK_S
            if broken := _broken(order, walk=walk):
                return None, broken
            looked, walked = now, now if walk else walked


def _reaped(program: int) -> int | None:
    """Collect what has ended; the exit code of the program if it has."""
    code = None
    with contextlib.suppress(ChildProcessError):
        while (ended := os.waitpid(-1, os.WNOHANG))[0]:
            if ended[0] == program:
                code = os.waitstatus_to_exitcode(ended[1])
    return code


def _broken(order: dict[str, Any], *, walk: bool) -> str:
    family = _family()
    if len(family) > order["processes"]:
        return f"it ran more than {order['processes']} processes at once"
    if sum(map(_threads, family)) > THREADS * order["processes"]:
        return f"it ran more than {THREADS * order['processes']} threads at once"
    # what processes share is counted with each of them: only then is the slow look worth it
    if all(sum(sizes) > order["memory"] for sizes in (family.values(), _parts(family))):
        return f"it took more than {_said(order['memory'])} of memory"
    if os.fstat(sys.stdout.fileno()).st_size > order["printed"]:
        return f"it printed more than {_said(order['printed'])}"
    if walk and not _fits(order["disk"], _nameless(family)):
        return f"its files took more than {_said(order['disk'])}, or were too many or too deep"
    return ""


def _said(size: int) -> str:
    return f"{size / 2**20:.4g} MiB"


def _family() -> dict[int, int]:
    """All processes that come from this one, and the memory of each, bytes."""
    parents, memory = {}, {}
    page = resource.getpagesize()
    for name in filter(str.isdecimal, os.listdir("/proc")):
        # the name of a program, in brackets, may hold anything
        with contextlib.suppress(OSError), open(f"/proc/{name}/stat", "rb") as stream:
            fields = stream.read().rpartition(b")")[2].split()
            if fields[0] != b"Z":
                parents[int(name)], memory[int(name)] = int(fields[1]), page * int(fields[21])
    return {pid: memory[pid] for pid in parents if os.getpid() in _ancestors(pid, parents)}


def _ancestors(pid: int, parents: dict[int, int]) -> Iterator[int]:
    while pid in parents:
        pid = parents[pid]
        yield pid


def _parts(family: dict[int, int]) -> Iterator[int]:
    """The memory of processes, with a part of what each shares with others, bytes."""
    for pid, most in family.items():
        try:
            with open(f"/proc/{pid}/smaps_rollup", "rb") as stream:
                lines = [line.split() for line in stream]
            yield next(1024 * int(line[1]) for line in lines if line[0] == b"Pss:")
        except (OSError, StopIteration):
            yield most


def _threads(pid: int) -> int:
    with contextlib.suppress(OSError):
        return len(os.listdir(f"/proc/{pid}/task"))
    return 1


def _nameless(family: dict[int, int]) -> int:
    """Size of the files without a name that processes hold open, of a disk or of memory, bytes."""
    sizes = {}
    for folder in (f"/proc/{pid}/fd" for pid in family):
        with contextlib.suppress(OSError):
            for name in os.listdir(folder):
                with contextlib.suppress(OSError):
                    state = os.stat(f"{folder}/{name}")
                    if stat.S_ISREG(state.st_mode) and not state.st_nlink:
                        sizes[state.st_dev, state.st_ino] = 512 * state.st_blocks
    return sum(sizes.values())


def _fits(most: int, size: int) -> bool:
    """Whether the files of the working directory, and others of a size, are within one, bytes."""
    count, folders = 0, ["."]
    while folders:
        try:
            with os.scandir(folders.pop()) as entries:
                for entry in entries:
                    size += ENTRY + 512 * entry.stat(follow_symlinks=False).st_blocks
                    count += 1
                    if entry.is_dir(follow_symlinks=False):
                        folders.append(entry.path)
                    if size > most or count > FILES:
                        return False
        except FileNotFoundError:  # it vanished
            continue
        except OSError:  # it nests too deep, or may not be read: what is there is not known
            return False
    return size <= most


def _end_family() -> None:
    """End what the program left behind; the end of a namespace's first process does the rest."""
    end = time.monotonic() + FAREWELL_S
    while (family := _family()) and time.monotonic() < end:
        for pid in family:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        _reaped(0)
        time.sleep(0.001)


if __name__ == "__main__":
    main(json.loads(sys.argv[1]), sys.argv[2:])
