"""What Python costs: stepped trials beside turbidock.run, the vector environment beside a batch.

    python speed.py [rounds]      # rows of assets/measured/speed_python.csv

Of several rounds in turn it takes the median of the ratios of processor time, which another job on
the machine disturbs least; of the vector environment also that of wall time.
"""

import os
import resource
import statistics
import sys
import tempfile
import time

import gymnasium
import numpy as np

import turbidock
from turbidock.docking_env import PolicyController

SCENARIO = "sea_night_active"
TRUE_POSE = {"pose_source": "true_pose", "duration_s": 30, "procedure.give_up_s": 100}
CAMERAS = {"duration_s": 1.5}
WORKERS = 2


def run(settings):
    turbidock.run(SCENARIO, seed=5, settings=settings)


def step(settings):
    trial = turbidock.Trial(SCENARIO, seed=5, settings=settings)
    while not trial.ended:
        trial.step()
    trial.result()


def step_and_look(settings):
    trial = turbidock.Trial(SCENARIO, seed=5, settings=settings)
    for frame in trial:
        _ = frame.true_position, frame.estimated_position
    trial.result()


def step_with_images(settings):
    trial = turbidock.Trial(SCENARIO, seed=5, settings=settings, images=True)
    for _ in trial:
        _ = trial.images
    trial.result()


def processor_s(do, settings):
    begin = time.process_time()
    do(settings)
    return time.process_time() - begin


def policy(observation):
    return np.clip(observation[..., :4] + observation[..., 4:8], -1, 1).astype(np.float32)


class Policy(PolicyController):
    def act(self, observation):
        return policy(observation)


def of_processes(processes):
    """Processor time of ours and of these."""
    ticks = 0
    for process in processes:
        with open(f"/proc/{process.pid}/stat", encoding="ascii") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        ticks += int(fields[11]) + int(fields[12])
    return time.process_time() + ticks / os.sysconf("SC_CLK_TCK")


def children_s():
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + spent.ru_utime + spent.ru_stime


def vector_beside_batch(settings, num_envs, seeds, rounds):
    """Ratios of simulated time an hour, wall and processor, the same policy in both."""
    envs = gymnasium.make_vec("turbidock/Docking-v0", num_envs=num_envs, workers=WORKERS,
                              scenario=SCENARIO, settings=settings)
    wall, processor = [], []
    for index in range(rounds):
        plan = {"schema_version": 1, "description": "speed", "scenario": SCENARIO, "seeds": seeds,
                "master_seed": index, "set": settings}
        with tempfile.TemporaryDirectory() as folder:
            begin, spent = time.monotonic(), children_s()
            trials = turbidock.batch(plan, os.path.join(folder, "b.db"), workers=WORKERS,
                                     controller=Policy)
            batch_s, batch_cpu_s = time.monotonic() - begin, children_s() - spent
        simulated_s = trials["time_s"].sum()

        begin, spent = time.monotonic(), of_processes(envs.processes)
        observations, _ = envs.reset(seed=1000 * index)
        vector_s, ended = 0.0, np.zeros(num_envs, bool)
        under_way_s = np.zeros(num_envs)  # without the time before there was control
        while vector_s + under_way_s.sum() < simulated_s:
            under_way_s[~ended] += 0.1
            observations, _, terminated, truncated, info = envs.step(policy(observations))
            ended = terminated | truncated
            if ended.any():
                vector_s += float(np.sum(info["time_s"][ended]))
                under_way_s[ended] = 0.0
        vector_s += under_way_s.sum()
        wall.append((vector_s / (time.monotonic() - begin)) / (simulated_s / batch_s))
        processor.append((vector_s / (of_processes(envs.processes) - spent))
                         / (simulated_s / batch_cpu_s))
    envs.close()
    return statistics.median(wall), statistics.median(processor)


def main():
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 25
    pairs = [("true pose, stepped", step, run, TRUE_POSE, TRUE_POSE),
             ("true pose, stepped, every frame looked at", step_and_look, run, TRUE_POSE,
              TRUE_POSE),
             ("cameras, stepped", step, run, CAMERAS, CAMERAS),
             ("cameras, stepped, images handed out", step_with_images, run, CAMERAS,
              {**CAMERAS, "region_of_interest": False})]
    print("what,ratio")
    for name, ours, theirs, our_settings, their_settings in pairs:
        ours(our_settings), theirs(their_settings)  # warm
        ratios = [processor_s(ours, our_settings) / processor_s(theirs, their_settings)
                  for _ in range(rounds)]
        print(f'"{name}: time, of run\'s",{statistics.median(ratios):.2f}', flush=True)
    small = {"rig.width_px": 320, "rig.height_px": 240}
    for name, settings, seeds, counts in (
            ("true pose", {"pose_source": "true_pose"}, 40, (2, 8, 32)),
            ("cameras", small, 6, (2, 8))):
        for num_envs in counts:
            wall, processor = vector_beside_batch(settings, num_envs, seeds, max(1, rounds // 5))
            print(f'"{name}: trials an hour of {num_envs} environments in two workers, of batch\'s '
                  f'with two workers",{wall:.2f}')
            print(f'"{name}: the same, an hour of processor time",{processor:.2f}', flush=True)


if __name__ == "__main__":
    main()
