"""A real Slurm of a few nodes on this machine, as plain processes of the user who asks for it."""

import contextlib
import getpass
import os
import shutil
import socket
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil

from tests.waiting import HANGS_S, pause, until

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel", "sinfo")
SBIN = "/usr/sbin"
CONFIGURATION = """\
ClusterName=here
SlurmctldHost=localhost(127.0.0.1)
SlurmctldPort={controller}
SlurmUser={user}
SlurmdUser={user}
StateSaveLocation={root}/state
SlurmdSpoolDir={root}/spool-%n
SlurmctldPidFile={root}/slurmctld.pid
SlurmdPidFile={root}/slurmd-%n.pid
SlurmctldLogFile={root}/slurmctld.log
SlurmdLogFile={root}/slurmd-%n.log
AuthInfo=socket={root}/munge.socket
ProctrackType=proctrack/pgid
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
SlurmdParameters=config_overrides
MailProg=/bin/true
KillWait=5
SchedulerParameters=batch_sched_delay=0,sched_min_interval=10000,sched_interval=1,bf_interval=1
NodeName=n[1-{nodes}] NodeHostname=localhost NodeAddr=127.0.0.1 Port=[{first}-{last}] CPUs={cores}\
 RealMemory=4000
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


MUNGE = ("key-file", "socket", "pid-file", "log-file", "seed-file")


@dataclass(frozen=True)
class Slurm:
    """A running Slurm, and the environment in which its commands and their callers find it."""

    environment: dict[str, str]

    def says(self, *command: str) -> str:
        """What one of its commands prints."""
        return subprocess.check_output(
            command, env=self.environment, text=True, timeout=HANGS_S
        )

    def jobs(self) -> dict[str, str]:
        """Ids of the jobs that have not ended, with their state."""
        lines = self.says("squeue", "--noheader", "--format=%i %T").splitlines()
        return dict(line.split() for line in lines)

    def idle(self) -> int:
        """Number of the nodes that wait for a job."""
        with contextlib.suppress(subprocess.CalledProcessError):
            return (
                self.says("sinfo", "--noheader", "--Node", "--format=%t")
                .split()
                .count("idle")
            )
        return 0


def missing() -> list[str]:
    """What a Slurm here lacks: programs, and a first process that takes leave of orphans."""
    path = os.pathsep.join([os.environ.get("PATH", ""), SBIN])
    lacking = [program for program in PROGRAMS if not shutil.which(program, path=path)]
    if not _orphans_vanish():
        lacking.append(
            "a process 1 that waits for orphans (`--init` of podman and docker)"
        )
    return lacking


def _orphans_vanish() -> bool:
    """Whether a process without a parent leaves no zombie, which slurmd takes for a running job.

    It waits a minute for the end of such a job, and then takes the node out of service.
    """
    said = subprocess.check_output(
        ["sh", "-c", "sleep 0.1 >/dev/null & echo $!"], text=True
    )
    orphan = int(said)
    until(lambda: _has_ended(orphan))
    # a first process that takes leave of it does so at once
    for _ in range(2000):
        if not psutil.pid_exists(orphan):
            return True
        pause()
    return False


def _has_ended(pid: int) -> bool:
    """Whether the process of a number has ended, with a zombie or without."""
    try:
        return bool(psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return True


@contextlib.contextmanager
def running(root: Path, *, nodes: int, cores: int) -> Iterator[Slurm]:
    """Start munge, the controller and the nodes in a directory; end them with all their jobs."""
    for folder in ("state", *(f"spool-n{node}" for node in range(1, nodes + 1))):
        (root / folder).mkdir(parents=True)
    (root / "munge.key").write_bytes(os.urandom(128))
    (root / "munge.key").chmod(0o600)
    first, controller, user = _free_ports(nodes), _free_ports(1), getpass.getuser()
    ports = {"controller": controller, "first": first, "last": first + nodes - 1}
    text = CONFIGURATION.format(root=root, user=user, nodes=nodes, cores=cores, **ports)
    (root / "slurm.conf").write_text(text)
    # nothing here uses cgroups: this plugin starts where none are mounted, the one for v2 does not
    (root / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n")
    slurm = Slurm({**os.environ, "SLURM_CONF": str(root / "slurm.conf")})
    options = (f"--{name}={root}/munge.{name.removesuffix('-file')}" for name in MUNGE)
    daemons = (
        (f"{SBIN}/munged", "--foreground", "--force", *options),
        (f"{SBIN}/slurmctld", "-D", "-c"),
        *((f"{SBIN}/slurmd", "-D", "-N", f"n{node}") for node in range(1, nodes + 1)),
    )
    started: list[subprocess.Popen[bytes]] = []

    def goes_on() -> None:
        for daemon in started:
            if daemon.poll() is not None:
                said = (root / "daemons.log").read_text()
                raise RuntimeError(f"a daemon has ended: {daemon.args!s}\n{said}")

    with contextlib.ExitStack() as stack:
        log = stack.enter_context((root / "daemons.log").open("ab"))
        for command in daemons:
            # a test run that is killed leaves no daemon
            words = ["setpriv", "--pdeathsig", "KILL", "--", *command]
            daemon = subprocess.Popen(
                words, env=slurm.environment, stdout=log, stderr=log
            )
            stack.callback(_end, daemon)
            started.append(daemon)
            until((root / "munge.socket").exists, goes_on)
        until(lambda: slurm.idle() == nodes, goes_on)
        try:
            yield slurm
        finally:
            slurm.says("scancel", "--user", user)
            until(lambda: not slurm.jobs())


def _free_ports(count: int) -> int:
    """The first of so many neighbouring ports that nobody listens on."""
    while True:
        with (
            contextlib.ExitStack() as stack,
            contextlib.suppress(OSError, OverflowError),
        ):
            first = 0
            for place in range(count):
                port = stack.enter_context(socket.socket())
                port.bind(("127.0.0.1", first + place if place else 0))
                first = first or port.getsockname()[1]
            return first


def _end(daemon: "subprocess.Popen[bytes]") -> None:
    daemon.terminate()
    try:
        daemon.wait(10)
    except subprocess.TimeoutExpired:
        daemon.kill()
        daemon.wait()
