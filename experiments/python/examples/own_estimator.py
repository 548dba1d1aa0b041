"""An estimator of one's own: the marker from three patches of colour. One docking with it, with a
picture; with a gate's file, the gate's verdict on it.

    python own_estimator.py [gate.yaml]

It is simpler than turbidock's own and needs clear water: try settings={"water.milk_ml_m3": 20}.
"""

import sys

import numpy as np

import turbidock

CHANNEL = {"red": 0, "green": 1, "blue": 2}


class Patches(turbidock.Estimator):
    least = turbidock.Key(12.0, 0, 255, "by how much a ball's colour exceeds the others")

    def patch(self, image, channel):
        """Centre (u, v) [px] and area [px] of what has most of the colour; None without any."""
        blocks = image.reshape(image.shape[0] // 4, 4, image.shape[1] // 4, 4, 3).mean((1, 3))
        others = np.delete(blocks, channel, axis=2).max(2)
        excess = np.maximum(blocks[:, :, channel] - others - self.least, 0)
        v, u = np.unravel_index(excess.argmax(), excess.shape)
        near = np.s_[max(v - 12, 0):v + 13, max(u - 12, 0):u + 13]
        weights, (vs, us) = excess[near], np.mgrid[near]
        total = weights.sum()
        if total == 0:
            return None
        centre = np.array([(us * weights).sum(), (vs * weights).sum()]) / total
        return 4 * centre + 1.5, 16 * np.count_nonzero(weights)

    def update(self, left, right):
        rig, seen, fit = self.rig, [], []
        for ball in self.balls:
            patches = [self.patch(image, CHANNEL[ball["name"]]) for image in (left, right)]
            if None in patches or patches[0][0][0] <= patches[1][0][0]:
                return [1, 0, 0], [1, 0, 0, 0], 0.0  # not seen
            ((ul, v), area), ((ur, _), _) = patches
            x = rig.fx * rig.baseline_m / (ul - ur)
            seen.append([x, (rig.cx - (ul + ur) / 2) * x / rig.fx,
                         (rig.cy - v) * x / rig.fy])
            fit.append(area / (np.pi * (rig.fx * ball["radius_m"] / x) ** 2))
        # the rotation that takes the balls of the marker nearest to those that are seen
        model, seen = np.array([ball["position_m"] for ball in self.balls]), np.array(seen)
        u, _, vt = np.linalg.svd((model - model.mean(0)).T @ (seen - seen.mean(0)))
        R = vt.T @ np.diag([1, 1, np.linalg.det(vt.T @ u.T)]) @ u.T
        w = np.sqrt(max(1 + np.trace(R), 1e-9)) / 2
        axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4 * w)
        q = np.append(w, axis)
        return (seen.mean(0) - R @ model.mean(0), q / np.linalg.norm(q),
                min(1.0, float(np.median(np.minimum(fit, 1 / np.array(fit))))))


if __name__ == "__main__":
    result = turbidock.run("pool_active", seed=3, estimator=Patches, progress=True)
    print(f"\n{result}")
    result.plot().savefig("my_estimator.png")
    if len(sys.argv) > 1:
        print(turbidock.gate(sys.argv[1], estimator=Patches, progress=True)["verdict"])
