"""Trains a policy to dock from the true pose with PPO (stable-baselines3), and has it judged.

    python train_docking.py --minutes 30 --out learnt            # learnt/curve.csv
    python train_docking.py --judge learnt --gate gate.yaml      # the same gate as every controller's
    python train_docking.py --judge learnt --seeds 20 --cameras  # through the cameras
"""

import argparse
import csv
import os
import resource
import time

import gymnasium
import numpy as np

import turbidock
from turbidock.docking_env import PolicyController

SCENARIO = "sea_night_active"
QUICK = {"estimator.pose_source": "true_pose", "trial.duration_s": 60}
GAMMA = 0.995


class _Weights:
    """The policy's network as plain arrays, which worker processes read in no time."""

    def __init__(self, folder):
        data = np.load(os.path.join(folder, "policy.npz"))
        self.layers = [(data[f"w{i}"], data[f"b{i}"]) for i in range(len(data.files) // 2)]

    def __call__(self, observation):
        x = observation
        for w, b in self.layers[:-1]:
            x = np.tanh(w @ x + b)
        w, b = self.layers[-1]
        return np.clip(w @ x + b, -1, 1)


def learnt(folder):
    """A controller of what was learnt into a folder."""

    class Learnt(PolicyController):
        weights = _Weights(folder)

        def act(self, observation):
            return self.weights(observation)

    return Learnt


def save_weights(model, folder):
    policy = model.policy
    linear = [m for m in policy.mlp_extractor.policy_net if hasattr(m, "weight")]
    arrays = {}
    for i, layer in enumerate([*linear, policy.action_net]):
        arrays[f"w{i}"] = layer.weight.detach().numpy()
        arrays[f"b{i}"] = layer.bias.detach().numpy()
    np.savez(os.path.join(folder, "policy.npz"), **arrays)


def train(arguments):
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import SubprocVecEnv, VecMonitor, VecNormalize

    torch.set_num_threads(1)  # networks as small as these are slower with more
    os.makedirs(arguments.out, exist_ok=True)
    begin = time.monotonic()

    class Curve(BaseCallback):
        """A row each quarter of a minute of what the last 100 episodes came to; ends when the time is up."""

        def _on_training_start(self):
            self.ends, self.next = [], 0.0
            self.file = open(os.path.join(arguments.out, "curve.csv"), "w", newline="")
            self.rows = csv.writer(self.file)
            self.rows.writerow(["minutes", "steps", "episodes", "success_rate", "reward_mean"])

        def _on_step(self):
            for info in self.locals["infos"]:
                if "episode" in info:
                    self.ends.append((info.get("is_success", False), info["episode"]["r"]))
            minutes = (time.monotonic() - begin) / 60
            if minutes >= self.next and self.ends:
                last = np.array(self.ends[-100:], float)
                self.rows.writerow([f"{minutes:.1f}", self.num_timesteps, len(self.ends),
                                    f"{last[:, 0].mean():.2f}", f"{last[:, 1].mean():.1f}"])
                self.file.flush()
                self.next = minutes + 0.25
            return minutes < arguments.minutes

    def make(rank):
        def env():
            made = gymnasium.make("turbidock/Docking-v0", scenario=SCENARIO, settings=QUICK)
            made.reset(seed=1000 * arguments.seed + rank)
            return made

        return env

    envs = VecMonitor(SubprocVecEnv([make(i) for i in range(arguments.environments)],
                                    start_method="spawn"))
    # rewards in units of their own spread: else the values' gradient drowns the policy's
    envs = VecNormalize(envs, norm_obs=False, gamma=GAMMA)
    model = PPO("MlpPolicy", envs, n_steps=2048 // arguments.environments, batch_size=256,
                gamma=GAMMA, learning_rate=5e-4, target_kl=0.03,
                policy_kwargs={"log_std_init": -1.0, "net_arch": [64, 64]},
                seed=arguments.seed, device="cpu")
    model.learn(10**9, callback=Curve())
    minutes = (time.monotonic() - begin) / 60
    model.save(os.path.join(arguments.out, "model.zip"))
    save_weights(model, arguments.out)
    envs.close()
    spent = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    print(f"{minutes:.1f} minutes, {sum(s.ru_utime + s.ru_stime for s in spent) / 60:.1f} of a "
          f"processor; {model.num_timesteps} steps")


def judge(arguments):
    controller = learnt(arguments.judge)
    if arguments.gate:
        report = turbidock.gate(arguments.gate, controller=controller, workers=arguments.workers,
                                progress=True)
        print()
        print("verdict:", report["verdict"])
        return
    plan = {"description": "the learnt policy", "scenario": SCENARIO,
            "seeds": arguments.seeds, "master_seed": 4242,
            "set": {} if arguments.cameras else QUICK}
    seen = "cameras" if arguments.cameras else "true_pose"
    for name, controller in (("learnt", controller), ("own", None)):  # own: the scenario's
        file = os.path.join(arguments.judge, f"{seen}_{name}.db")
        trials = turbidock.batch(plan, file, controller=controller, workers=arguments.workers,
                                 progress=True)
        times = trials["time_s"][trials["outcome"] == "success"]
        print(f"\n{name} controller: {trials['outcome'].value_counts().to_dict()}, docked after "
              f"{times.median():.1f} s (median), {times.max():.1f} s (longest)")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", default="learnt")
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--workers", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--environments", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--judge", metavar="FOLDER")
    parser.add_argument("--gate")
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--cameras", action="store_true")
    given = parser.parse_args()
    judge(given) if given.judge else train(given)
