"""The user's nodes: started and ended with a trial, with their output in a file."""

from __future__ import annotations

import os
import pathlib
import select
import subprocess
import sys
import tempfile
from typing import IO, Mapping

_TAIL = 2000  # bytes of their output that a message has


class Nodes:
    """A launch command under way, in a process group of its own. It ends with `close`, and also when this process is killed
    (keeper.py). `log`: the file that gets its output; empty: none is kept."""

    def __init__(self, command: str, log: str, environment: Mapping[str, str]) -> None:
        self.command, self.log = command, log
        if log:
            pathlib.Path(log).parent.mkdir(parents=True, exist_ok=True)
        self._output: IO[bytes] = open(log, "wb+") if log else tempfile.TemporaryFile()
        keeper = pathlib.Path(__file__).with_name("keeper.py")
        self._keeper = subprocess.Popen([sys.executable, "-IS", str(keeper), command], env=dict(environment),
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._output)
        self._ended: int | None = None

    def ended(self) -> int | None:
        """The command's exit code once it has ended, as subprocess has it; what it left running goes on."""
        out = self._keeper.stdout
        assert out
        if self._ended is None and select.select([out], [], [], 0)[0]:
            self._ended = int(out.readline() or -9)  # the keeper itself was killed
        return self._ended

    def tail(self) -> str:
        """The end of their output so far."""
        size = os.fstat(self._output.fileno()).st_size
        return os.pread(self._output.fileno(), _TAIL, max(0, size - _TAIL)).decode("utf-8", "replace").strip()

    def close(self) -> None:
        """Ends them: SIGINT, after two seconds SIGKILL."""
        assert self._keeper.stdin and self._keeper.stdout
        self._keeper.stdin.close()
        self._keeper.wait()
        self._keeper.stdout.close()
        self._output.close()
