"""What `turbidock.dataset` makes, read back by others: pycocotools, matplotlib's PNG, and functions that follow BOP's
published definitions (its toolkit is not on the Python index)."""

import itertools
import json

import matplotlib.image
import numpy as np
import pytest
import turbidock
from pycocotools.coco import COCO

SIZE = (240, 320)
# Near, from the side and tilted: some of the markers leave the image, some of the balls are behind the box.
PLAN = {"schema_version": 1, "description": "near the marker", "scenario": "pool_active", "seeds": 12, "master_seed": 3,
        "set": {"cameras.rig.width_px": SIZE[1], "cameras.rig.height_px": SIZE[0], "start.distance_min_m": 0.3,
                "start.distance_max_m": 0.6, "start.lateral_m": 0.35, "start.heading_rad": 0.7, "start.roll_rad": 0.3,
                "start.pitch_rad": 0.2}}


def pixels(path):
    """As stored: 8 or 16 bits."""
    read = matplotlib.image.imread(path)
    return np.round(read * (65535 if path.parent.name == "depth" else 255)).astype(int)


def read_ply(path):
    """Vertices, normals and triangles of an ASCII .ply."""
    head, _, body = path.read_text().partition("end_header\n")
    names = [line.split()[-1] for line in head.splitlines() if line.startswith("property") and "list" not in line]
    counts = {line.split()[1]: int(line.split()[2]) for line in head.splitlines() if line.startswith("element")}
    rows = body.splitlines()
    assert len(rows) == sum(counts.values()) and names == ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"]
    vertices = np.array([row.split() for row in rows[:counts["vertex"]]], float)
    faces = np.array([row.split() for row in rows[counts["vertex"]:]], int)
    assert (faces[:, 0] == 3).all() and faces[:, 1:].max() == len(vertices) - 1
    return vertices[:, :3], vertices[:, 3:6], faces[:, 1:]


def silhouette(triangles, K, canvas):
    """Pixels of a canvas of three times the image's size that any of the projected triangles covers."""
    grid = np.moveaxis(np.mgrid[-SIZE[0]:2 * SIZE[0], -SIZE[1]:2 * SIZE[1]][::-1], 0, -1).astype(float)
    for corners in triangles:
        uv = (corners @ K.T)[:, :2] / corners[:, 2:]
        low, high = np.floor(uv.min(0)).astype(int), np.ceil(uv.max(0)).astype(int) + 1
        part = np.s_[max(low[1] + SIZE[0], 0):max(high[1] + SIZE[0], 0), max(low[0] + SIZE[1], 0):max(high[0] + SIZE[1], 0)]
        sides = [(b - a)[0] * (grid[part] - a)[..., 1] - (b - a)[1] * (grid[part] - a)[..., 0]
                 for a, b in zip(uv, np.roll(uv, -1, axis=0))]
        canvas[part] |= np.all(np.greater_equal(sides, 0), axis=0) | np.all(np.less_equal(sides, 0), axis=0)
    return canvas


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dataset")
    seen = []
    images = turbidock.dataset(PLAN, folder, pairs_per_shard=8, depth=True, workers=2,
                               progress=lambda share, words: seen.append(share))
    shards = sorted((folder / "train_pbr").iterdir())
    assert [shard.name for shard in shards] == ["000000", "000001"] and seen == sorted(seen)
    assert images == sum(len(list(shard.glob("rgb/*.png"))) for shard in shards)
    with pytest.raises(turbidock.ConfigError, match="depth differs"):
        turbidock.dataset(PLAN, folder, pairs_per_shard=8)
    return folder, shards


def test_the_model_is_as_bop_defines_it(made):
    folder, _ = made
    info = json.loads((folder / "models/models_info.json").read_text())["1"]
    vertices, normals, faces = read_ply(folder / "models/obj_000001.ply")
    assert info["diameter"] == pytest.approx(max(np.linalg.norm(vertices - v, axis=1).max() for v in vertices), abs=1e-3)
    assert info["diameter"] == pytest.approx(173.2, abs=0.05)  # the diagonal of its box of 100 mm
    for axis, name in enumerate("xyz"):
        assert info[f"min_{name}"] == pytest.approx(vertices[:, axis].min(), abs=1e-3)
        assert info[f"size_{name}"] == pytest.approx(np.ptp(vertices[:, axis]), abs=1e-3)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-3)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    outwards = (np.cross(b - a, c - a) * normals[faces[:, 0]]).sum(1)
    assert (outwards > -1e-3).all() and (outwards > 1).mean() > 0.9  # but for those at the balls' poles


def test_bop_and_coco_say_the_same(made):
    folder, shards = made
    vertices, _, faces = read_ply(folder / "models/obj_000001.ply")
    assert json.loads((folder / "camera.json").read_text())["baseline_mm"] == 120
    checked, cut, tilted, hidden = 0, 0, 0, 0
    for shard in shards:
        gt, camera, info = (json.loads((shard / name).read_text()) for name in (
            "scene_gt.json", "scene_camera.json", "scene_gt_info.json"))
        coco = COCO(str(shard / "coco_keypoints.json"))
        names = coco.loadCats(1)[0]["keypoints"]
        balls = {ball["name"]: ball for ball in json.loads((folder / "models/models_info.json").read_text())["1"]["balls"]}
        assert set(gt) == {str(image) for image in coco.getImgIds()}
        for image in coco.loadImgs(coco.getImgIds()):
            key = str(image["id"])
            assert pixels(shard / image["file_name"]).shape == (*SIZE, 3)
            visible = pixels(shard / f"mask_visib/{image['id']:06}_000000.png") > 0
            whole = pixels(shard / f"mask/{image['id']:06}_000000.png") > 0
            facts = info[key][0]
            assert not (visible & ~whole).any()
            assert facts["px_count_visib"] == visible.sum() <= facts["px_count_valid"] == whole.sum() <= facts["px_count_all"]
            assert facts["visib_fract"] == pytest.approx(visible.sum() / max(facts["px_count_all"], 1))
            K = np.array(camera[key]["cam_K"]).reshape(3, 3)
            R = np.array(gt[key][0]["cam_R_m2c"]).reshape(3, 3)
            t = np.array(gt[key][0]["cam_t_m2c"])
            np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-9)
            tilted += abs(R[2, 1]) > 0.05
            # the silhouette of the model at that pose, beyond the image's edge too
            seen = vertices @ R.T + t
            if seen[:, 2].min() > 20:
                drawn = silhouette(seen[faces], K, np.zeros((3 * SIZE[0], 3 * SIZE[1]), bool))
                assert facts["px_count_all"] == pytest.approx(drawn.sum(), rel=0.03)
                inside = drawn[SIZE[0]:2 * SIZE[0], SIZE[1]:2 * SIZE[1]]
                assert (inside ^ whole).sum() <= 0.03 * facts["px_count_all"]
                ys, xs = np.nonzero(drawn)
                left, top, width, height = facts["bbox_obj"]
                np.testing.assert_allclose((left + SIZE[1], top + SIZE[0], width, height),
                                           (xs.min(), ys.min(), np.ptp(xs) + 1, np.ptp(ys) + 1), atol=2)
                cut += inside.sum() < drawn.sum() > facts["px_count_valid"]
            annotations = coco.loadAnns(coco.getAnnIds(image["id"]))
            assert len(annotations) == (1 if visible.any() else 0)
            if not annotations:
                continue
            annotation = annotations[0]
            np.testing.assert_array_equal(coco.annToMask(annotation), visible)
            assert annotation["area"] == visible.sum()
            ys, xs = np.nonzero(visible)
            assert tuple(annotation["bbox"]) == (xs.min(), ys.min(), np.ptp(xs) + 1, np.ptp(ys) + 1)
            # the pose of BOP, projected here, is the keypoints of COCO; the depth there says whether one is hidden
            depth_mm = camera[key]["depth_scale"] * pixels(shard / f"depth/{image['id']:06}.png")
            for name, (x, y, v) in zip(names, np.reshape(annotation["keypoints"], (3, 3))):
                p = K @ (R @ balls[name]["center"] + t)
                u, w = p[:2] / p[2]
                inside = -0.5 <= u < SIZE[1] - 0.5 and -0.5 <= w < SIZE[0] - 0.5
                assert (v > 0) == inside
                if not inside:
                    continue
                np.testing.assert_allclose((u + 0.5, w + 0.5), (x, y), atol=1e-6)
                front = p[2] - depth_mm[round(w), round(u)]
                assert (v == 2) == (0 < front < balls[name]["radius"] + 1), (front, v)
                checked, hidden = checked + 1, hidden + (v == 1)
    assert checked > 10 and cut and tilted and hidden, (checked, cut, tilted, hidden)


def test_bad_input(tmp_path):
    with pytest.raises(ValueError, match="pairs_per_shard must be at least 1"):
        turbidock.dataset(PLAN, tmp_path, pairs_per_shard=0)
    with pytest.raises(turbidock.ConfigError, match="lens: must be 0"):
        turbidock.dataset(PLAN, tmp_path, seeds=1, settings={"cameras.lens.k1": -0.1}, workers=1)
    with pytest.raises(ValueError, match="no bundled plan"):
        turbidock.dataset("detector_image", tmp_path)
