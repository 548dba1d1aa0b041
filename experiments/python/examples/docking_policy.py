"""A policy written by hand in the Gymnasium environment, then as a controller through the cameras.

    python docking_policy.py [episodes]
"""

import sys

import gymnasium
import numpy as np

import turbidock
from turbidock.docking_env import PolicyController


def policy(observation):
    """Error and rate by axis; see turbidock.docking_env."""
    return np.clip(observation[:4] + observation[4:8], -1, 1)


class Policy(PolicyController):
    def act(self, observation):
        return policy(observation)


if __name__ == "__main__":
    env = gymnasium.make("turbidock/Docking-v0", scenario="sea_night_active",
                         settings={"pose_source": "true_pose"})
    docked, episodes = 0, int(sys.argv[1]) if len(sys.argv) > 1 else 10
    for seed in range(episodes):
        observation, info = env.reset(options={"seed": seed})
        over = False
        while not over:
            observation, reward, terminated, truncated, info = env.step(policy(observation))
            over = terminated or truncated
        docked += info["is_success"]
        print(f"seed {seed}: {info['reason']}")
    print(f"{docked} of {episodes} docked")
    print("through the cameras:", turbidock.run("sea_night_active", seed=1, controller=Policy))
