"""Estimated poses that join the rest of a log."""

import json
import pathlib
import re
import subprocess
import sys

import numpy as np

import turbidock
from turbidock import _core, _rotation
from turbidock.logs import _log
from turbidock.frames import rotation
from turbidock.logs.motion import read_motion, write_motion

CORE = pathlib.Path(__file__).resolve().parents[2] / "experiments/python/turbidock"
START_NS = 1_700_000_000_123_456_789


def test_estimates_join_commands_and_depth_for_identify(tmp_path):
    """A vehicle that moves about a marker at 3 m; what its cameras would find there."""
    scenario = turbidock.Scenario("pool_active")
    head = json.loads(_core.trial_model(scenario._cpp))["scene"]["X_BH"]
    rng = np.random.default_rng(2)
    time_s = np.arange(40) / 10
    body = _rotation.turned(np.stack([0.05 * np.sin(time_s), 0.1 * np.cos(time_s), 0.3 * np.sin(2 * time_s)], axis=1))
    place = np.stack([-2 + 0.1 * time_s, 0.2 * np.sin(time_s), -3 + 0.1 * np.cos(time_s)], axis=1)
    records = []
    for i in range(40):
        R_WH, p_WH = rotation(body[i]) @ rotation(head[3:]), place[i] + rotation(body[i]) @ head[:3]
        turn = _rotation.conjugate(_rotation.product(body[i], np.array(head[3:])))
        records.append({"detected": i != 7, "time_ns": START_NS + 10**8 * i, "quaternion_wxyz": turn.tolist(),
                        "position_m": (R_WH.T @ ([0, 0, -3] - p_WH)).tolist()})
    commands = {f"{name}_v": 2.5 + rng.random(40) for name in _core.thrusters(scenario._cpp)}
    write_motion({"time_s": time_s, "depth_m": -place[:, 2]} | commands, tmp_path / "motion.csv")
    (tmp_path / "log.json").write_text(json.dumps({"start_ns": START_NS}))
    _log.add_estimates(tmp_path, records, scenario)
    log = _log.Log(read_motion(tmp_path / "motion.csv"), scenario)
    there = np.arange(40) != 7
    assert np.allclose(log.sensor("position").time_s, time_s[there], atol=1e-6)
    assert np.allclose(log.sensor("position").values, place[there], atol=1e-6)
    assert np.allclose(log.sensor("attitude").values, body[there])
    assert np.allclose(log.sensor("depth").values[:, 0], -place[:, 2])
    assert len(log.command_times) == 40


def test_the_core_does_not_import_the_logs():
    code = "import sys, turbidock; turbidock.keys(); print([name for name in sys.modules if name.startswith('turbidock.logs')])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"
    assert not [file for file in CORE.glob("*.py") if re.search(r"from \.logs|turbidock\.logs|import logs", file.read_text())]


def test_what_is_ended_leaves_nothing_half_written(tmp_path):
    """A command that gets SIGTERM while it writes a file, and one whose file cannot be finished."""
    code = ("import os\nfrom turbidock import _program\nfrom turbidock.logs import bags, mcap_out\ndef main():\n"
            "    with mcap_out.McapFile('x.mcap') as out:\n        assert os.path.exists('x.mcap.part')\n        {}\n"
            "bags.main = main\n_program.bag()")
    for action, returned in (("os.kill(os.getpid(), 15)", 143), ("out._writer.finish = lambda: open('none')", 2), ("out", 0)):
        assert subprocess.run([sys.executable, "-c", code.format(action)], cwd=tmp_path, stderr=subprocess.DEVNULL).returncode == returned
        assert [file.name for file in tmp_path.iterdir()] == ["x.mcap"] * (returned == 0), action
