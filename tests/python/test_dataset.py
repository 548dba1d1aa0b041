"""What `turbidock dataset` makes, read back by others: pycocotools, OpenCV-free PNG by matplotlib."""

import json
import os
import subprocess

import matplotlib.image
import numpy as np
from pycocotools.coco import COCO


def test_bop_and_coco_say_the_same(tmp_path):
    program = os.environ.get("PROGRAM", "build/bin/turbidock")
    subprocess.run([program, "dataset", "detector_images", "--seeds", "3", "--pairs-per-shard", "4",
                    "--set", "rig.width_px=320", "--set", "rig.height_px=240", "--out",
                    str(tmp_path), "--quiet"], check=True)
    shards = sorted((tmp_path / "train_pbr").iterdir())
    assert [shard.name for shard in shards] == ["000000", "000001"]
    checked = 0
    for shard in shards:
        gt, camera, info = (json.loads((shard / name).read_text()) for name in (
            "scene_gt.json", "scene_camera.json", "scene_gt_info.json"))
        coco = COCO(str(shard / "coco_keypoints.json"))
        names = coco.loadCats(1)[0]["keypoints"]
        balls = {ball["name"]: ball["center"] for ball in json.loads(
            (tmp_path / "models/models_info.json").read_text())["1"]["balls"]}
        assert set(gt) == {str(image) for image in coco.getImgIds()}
        for image in coco.loadImgs(coco.getImgIds()):
            key = str(image["id"])
            pixels = matplotlib.image.imread(shard / image["file_name"])
            assert pixels.shape == (240, 320, 3)
            visible = matplotlib.image.imread(shard / f"mask_visib/{image['id']:06}_000000.png")
            whole = matplotlib.image.imread(shard / f"mask/{image['id']:06}_000000.png")
            assert visible.ndim == 2
            assert np.count_nonzero(visible) == info[key][0]["px_count_visib"]
            annotations = coco.loadAnns(coco.getAnnIds(image["id"]))
            assert len(annotations) == (1 if visible.any() else 0)
            if not annotations:
                continue
            # what is seen is part of the whole, but for pixels that the outline cuts
            assert np.count_nonzero((visible > 0) & ~(whole > 0)) <= 0.02 * visible.size ** 0.5 + 12
            annotation = annotations[0]
            u, v, width, height = annotation["bbox"]
            ys, xs = np.nonzero(visible)
            assert (u, v, width, height) == (xs.min(), ys.min(), np.ptp(xs) + 1, np.ptp(ys) + 1)
            # the pose of BOP, projected here, is the keypoints of COCO
            K = np.array(camera[key]["cam_K"]).reshape(3, 3)
            R = np.array(gt[key][0]["cam_R_m2c"]).reshape(3, 3)
            t = np.array(gt[key][0]["cam_t_m2c"])
            for name, (x, y, seen) in zip(names, np.reshape(annotation["keypoints"], (3, 3))):
                if not seen:
                    continue
                p = K @ (R @ balls[name] + t)
                np.testing.assert_allclose(p[:2] / p[2] + 0.5, [x, y], atol=1e-6)
                checked += 1
            np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-9)
    assert checked > 10
