"""Runs a command, in bash where there is one, and ends all that it started when its standard input closes: when the simulator
says so, and also when that was killed. Without packages, so that it starts at once: python keeper.py COMMAND. Their output is
its standard error; its standard output says the command's exit code. Each node of ROS makes a log file: those go, too."""

from __future__ import annotations

import ctypes
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time

_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36
GRACE_S = 2.0  # from SIGINT to SIGKILL


def _prctl(option: int, value: int) -> None:
    ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


def _descendants() -> list[int]:
    """Of this process; those whose parents died are its children."""
    parents: dict[int, int] = {}
    for name in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{name}/stat", encoding="utf-8", errors="replace") as file:
                fields = file.read().rpartition(")")[2].split()
        except OSError:  # it ended meanwhile
            continue
        if fields[0] != "Z":
            parents[int(name)] = int(fields[1])
    found, more = [], [os.getpid()]
    while more:
        more = [child for child, parent in parents.items() if parent in more]
        found += more
    return found


def _send(number: int) -> None:
    for process in _descendants():
        try:
            os.kill(process, number)
        except ProcessLookupError:
            pass


def _reap() -> None:
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        pass


def main() -> None:
    os.setsid()  # Ctrl-C is the simulator's to handle
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: None)  # not SIG_IGN, which the nodes would inherit
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)
    with tempfile.TemporaryDirectory(prefix="turbidock-ros-", ignore_cleanup_errors=True) as logs:
        _keep(sys.argv[1], {"ROS_LOG_DIR": logs, **os.environ})


def _keep(command: str, environment: dict[str, str]) -> None:
    started = subprocess.Popen(command, shell=True, executable=shutil.which("bash"), stdin=subprocess.DEVNULL,
                               stdout=sys.stderr, env=environment, start_new_session=True,
                               preexec_fn=lambda: _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL))
    told = False
    while not select.select([sys.stdin], [], [], 0.05)[0]:
        if not told and started.poll() is not None:
            told = True
            try:
                print(started.returncode, flush=True)
            except OSError:
                break
    _send(signal.SIGINT)
    end = time.monotonic() + GRACE_S
    while _descendants() and time.monotonic() < end:
        time.sleep(0.02)
        started.poll()
        _reap()
    while _descendants():
        _send(signal.SIGKILL)
        time.sleep(0.01)
        _reap()


if __name__ == "__main__":
    main()
