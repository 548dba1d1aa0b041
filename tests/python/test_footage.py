"""The script that made assets/footage makes it: the truth bit for bit, the films as many images."""

import pathlib
import runpy
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]


def test_makes_what_is_shipped(tmp_path):
    runpy.run_path(str(ROOT / "experiments/python/examples/make_footage.py"))["make"](tmp_path)
    truth = (tmp_path / "truth.csv").read_text()
    assert truth == (ROOT / "assets/footage/truth.csv").read_text()
    for side in "left", "right":
        images = subprocess.run(
            ["ffprobe", "-v", "error", "-count_frames", "-select_streams", "v", "-show_entries",
             "stream=nb_read_frames", "-of", "csv=p=0", str(tmp_path / f"{side}.mp4")],
            capture_output=True, text=True, check=True).stdout
        assert int(images.strip().strip(",")) == len(truth.splitlines()) - 1
