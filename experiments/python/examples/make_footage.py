"""Films of both cameras of a trial, as a vehicle would record them, with the truth at each image.

    python make_footage.py FOLDER        # left.mp4, right.mp4, truth.csv; assets/footage was made so
    turbidock estimate --left FOLDER/left.mp4 --right FOLDER/right.mp4
"""

import csv
import subprocess
import sys
from pathlib import Path

import turbidock


def encoder(file: Path, width: int, height: int, fps: float) -> "subprocess.Popen[bytes]":
    return subprocess.Popen(
        ["ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
         "-r", str(fps), "-i", "-", "-preset", "slow", "-crf", "28", "-pix_fmt", "yuv420p", str(file)],
        stdin=subprocess.PIPE)


def make(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    scenario = turbidock.Scenario("sea_night_active", seed=1, settings={"trial.duration_s": 2})
    with (turbidock.Trial(scenario, images=True) as trial, open(folder / "truth.csv", "w", newline="") as file):
        rig = trial.rig
        films = [encoder(folder / f"{side}.mp4", rig.width, rig.height, scenario.trial.clock.frames_per_second)
                 for side in ("left", "right")]
        truth = csv.writer(file)
        truth.writerow(["image_time_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"])
        for frame in trial:
            for film, image in zip(films, trial.images):
                film.stdin.write(image.tobytes())
            pose = [*frame.true_position_at_image, *frame.true_quaternion_at_image_wxyz]
            truth.writerow([f"{frame.image_time_s:.4f}", *(f"{number:.6f}" for number in pose)])
        for film in films:
            film.communicate()


if __name__ == "__main__":
    make(Path(sys.argv[1] if len(sys.argv) > 1 else "footage"))
