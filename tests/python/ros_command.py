"""turbidock-ros as the tests call it."""

import os
import pathlib
import re
import subprocess
import sys
import time

import pytest

HERE = pathlib.Path(__file__).parent
NODES, EXAMPLES = HERE / "ros_nodes", HERE.parents[1] / "experiments/python/examples/ros"
P_VOLTAGE = f"exec {sys.executable} {NODES / 'p_voltage.py'}"
SHORT = ["--set", "estimator.pose_source=true_pose", "--set", "trial.duration_s=4"]
PAPER = ["paper_sea_night_active", "--seed", "3", *SHORT]
ROS = [sys.executable, "-c", "from turbidock._program import ros; ros()"]


def ros(*arguments, launch="", environment=None):
    """turbidock-ros to its end."""
    return subprocess.run([*ROS, *(["--launch", launch] if launch else []), *map(str, arguments)], capture_output=True, text=True,
                          timeout=300, env={**os.environ, **(environment or {})})


def said(done, code):
    """What it said, where it ended with this code."""
    assert done.returncode == code, done.stdout + done.stderr
    return done.stderr


def processes(word):
    """Whose command line or environment has a word."""
    found = []
    for folder in pathlib.Path("/proc").iterdir():
        try:
            if folder.name.isdigit() and word.encode() in (folder / "cmdline").read_bytes() + (folder / "environ").read_bytes():
                found.append((folder / "cmdline").read_bytes())
        except OSError:
            continue
    return found


def wait_until(holds, longest_s=10):
    end = time.monotonic() + longest_s
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.fixture
def nothing_is_left(tmp_path):
    """The mark of what a test starts; nothing of it may be there afterwards."""
    before = {folder: set(os.listdir(folder)) for folder in ("/dev/shm", "/tmp")}
    mark = f"turbidock-test-{os.getpid()}-{time.monotonic_ns()}"
    (tmp_path / "tmp").mkdir()
    yield {"TURBIDOCK_TEST": mark, "ROS_HOME": str(tmp_path / "ros"), "TMPDIR": str(tmp_path / "tmp")}
    wait_until(lambda: not processes(mark))
    assert not (tmp_path / "ros").exists()  # log files
    assert not list((tmp_path / "tmp").iterdir())
    for folder, names in before.items():
        assert not [name for name in set(os.listdir(folder)) - names if re.match("sem.fast|fast", name)]


@pytest.fixture(scope="session")
def built_in():
    """The digest of the trial PAPER with the controller in C++."""
    import turbidock
    return turbidock.run("paper_sea_night_active", seed=3, settings={"estimator.pose_source": "true_pose", "trial.duration_s": 4}).digest


def plan(tmp_path, seeds):
    """A file of a few quick trials."""
    file = tmp_path / "plan.yaml"
    file.write_text(f"""schema_version: 1
description: a few
scenario: paper_sea_night_active
seeds: {seeds}
set: {{estimator.pose_source: true_pose, trial.duration_s: 3}}
""")
    return file
