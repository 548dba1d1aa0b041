"""What type checkers know of the package: README's ways pass, mistakes do not."""

import json
import subprocess
import sys

import pytest

RIGHT = '''# pyright: reportUnnecessaryComparison=true
import pathlib

import gymnasium
import numpy as np

import turbidock


class MyController(turbidock.Controller):
    pose_filter = True
    gain = turbidock.Key(60.0, 0, 1000, "newtons a metre")

    def demand(self, seen: turbidock.Observation, wanted: turbidock.Reference) -> list[float]:
        x, y, z, heading = seen.position - wanted.position
        return [min(self.gain * x, 2), self.gain * y, self.gain * z, 0.4 * heading]


r = turbidock.run("sea_night_active", seed=77, progress=True)
print(r.outcome, r.time_s + 1, r.digest.upper(), r.trajectory["time_s"].max())
if r.insertion_time_s is not None:
    print(r.insertion_time_s + 1)
turbidock.run(pathlib.Path("a.yaml"), controller=MyController, settings={"my_controller.gain": 50})
print(turbidock.gate("gate.yaml", controller=MyController)["verdict"])
s = turbidock.Scenario("sea_night_active", seed=77, settings={"water.milk_ml_m3": 20})
s.water.milk_ml_m3 = 25
s.sea.state = "moderate"
s.marker.balls[0].radius_m *= 2
s["my_controller.gain"] = 3
with turbidock.Trial("a", seed=3, images=True, steered="volts") as trial:
    trial.step([0, 0, 0, 1])
    left, right = trial.images
    print(left.shape, trial.frame.true_position[0] + 1, trial.seen.position)
for frame in trial:
    print(frame.stage.upper())
print(trial.rig.fx + 1, trial.project([[0, 0, 0.07]]).shape, trial.overlay().shape, trial.frame.image_time_s + 1)
print(trial.frame.estimated_position - trial.frame.true_position_at_image)
trial.save_video(pathlib.Path("film.mp4"))
print(turbidock.dataset("detector_images", pathlib.Path("images"), depth=True, seeds=3) + 1)
from turbidock import logs
print(logs.to_mcap(pathlib.Path("out/run"), images=True).upper())
bag = logs.read_bag(["a.bag"], {"motion": {"imu": "/imu"}})
bag.save("log")
print(bag.motion["time_s"].mean(), bag.pairs[0][1] + 1, logs.estimate_bag("log")[0]["fitness"])
trials = turbidock.batch({"seeds": 6}, "sweep.db", workers=2, seeds=6)
print(trials.groupby("water.milk_ml_m3")["outcome"].value_counts())
'''
WRONG = '''
r.outcom
r.outcome == "dcked"
r.time_s.upper()
r.insertion_time_s + 1
s.water.milk = 3
s.water.milk_ml_m3 = "much"
s.sea.state = "wild"
s.marker.balls.radius_m
turbidock.Trial("a", sead=3)
trial.frame.true_pose
turbidock.batch("turbidity_sweep", "sweep.db", workerz=2)
'''


def mypy(file):
    """Lines with an error, what it said."""
    found = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--strict-equality", "--cache-dir", str(file.parents[1] / "mypy"), file.name],
        cwd=file.parent, capture_output=True, text=True)
    assert not found.stderr, found.stderr
    return [int(line.split(":")[1]) for line in found.stdout.splitlines() if ": error:" in line], found.stdout


def pyright(file):
    found = subprocess.run([sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable, file.name],
                           cwd=file.parent, capture_output=True, text=True)
    said = json.loads(found.stdout)["generalDiagnostics"]
    return [each["range"]["start"]["line"] + 1 for each in said if each["severity"] == "error"], found.stdout


@pytest.mark.parametrize("check", [mypy, pyright])
def test_the_documented_ways_pass_and_mistakes_do_not(check, tmp_path):
    first, wrong = RIGHT.count("\n") + 1, WRONG.strip().splitlines()
    file = tmp_path / "check.py"
    file.write_text(RIGHT)
    lines, said = check(file)
    assert lines == [], said
    file.write_text(RIGHT + "\n".join(wrong) + "\n")
    lines, said = check(file)
    assert sorted(set(lines)) == list(range(first, first + len(wrong))), said
