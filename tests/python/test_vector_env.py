"""The vector environment over worker processes."""

import os
import signal
import subprocess
import sys
import time

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import turbidock
from turbidock.docking_env import DockingEnv
from turbidock.vector_env import DockingVectorEnv
from conftest import QUICK

SHORT = {**QUICK, "duration_s": 3}  # of a trial; control begins earlier


class Odd(DockingEnv):
    """Fails in its third step."""

    def __init__(self, does, **options):
        super().__init__(settings=SHORT, **options)
        self._does, self.steps = does, 0

    def step(self, action):
        self.steps += 1
        if self.steps == 3 and self.np_random_seed == 2:
            if self._does == "raise":
                raise KeyError("no such thruster")
            if self._does == "exit":
                os._exit(7)
            while self._does == "hang":
                time.sleep(0.01)
        return super().step(action)

    def lock(self):
        return sys.stdout  # what cannot travel


def actions(count, steps):
    return np.random.default_rng(3).uniform(-1, 1, (steps, count, 4)).astype(np.float32)


def plain(values):
    """The same with lists for arrays of objects, which assert_equal cannot compare."""
    if isinstance(values, dict):
        return {key: plain(value) for key, value in values.items()}
    if isinstance(values, (tuple, list)):
        return [plain(value) for value in values]
    if isinstance(values, np.ndarray) and values.dtype == object:
        return plain(values.tolist())
    return values


def gone(processes):
    return all(not process.is_alive() and process.exitcode is not None for process in processes)


def vector(num_envs, **options):
    return gymnasium.make_vec("turbidock/Docking-v0", num_envs=num_envs, **options)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize("observe", ["estimate", ("estimate", "truth")])
def test_it_is_the_environments_one_after_the_other(mode, observe):
    options = {"observe": observe, "settings": SHORT}
    ours = vector(5, workers=2, autoreset_mode=mode, **options)
    theirs = gymnasium.vector.SyncVectorEnv([lambda: DockingEnv(**options)] * 5,
                                            autoreset_mode=mode)
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert ours.metadata["autoreset_mode"] == mode
    ends = 0
    one, other = ours.reset(seed=7), theirs.reset(seed=7)
    np.testing.assert_equal(one, other)
    for given in actions(5, 60):
        one, other = ours.step(given), theirs.step(given)
        np.testing.assert_equal(plain(one), plain(other))
        ends += int((one[2] | one[3]).sum())
    assert ends >= 5
    ours.close()
    theirs.close()
    assert ours.processes == []


def test_any_number_of_workers_gives_the_same():
    def rewards(workers):
        envs = vector(3, workers=workers, settings=SHORT)
        envs.reset(seed=[5, 6, 7])
        assert len(envs.processes) == min(workers, 3)
        total = np.array([envs.step(given)[1] for given in actions(3, 10)])
        processes = envs.processes
        envs.close()
        assert gone(processes)
        return total

    first = rewards(1)
    for workers in (2, 3, 8):
        np.testing.assert_array_equal(rewards(workers), first)


def test_without_autoreset_a_mask_says_which_begin_anew():
    envs = vector(2, workers=1, autoreset_mode=AutoresetMode.DISABLED, settings=SHORT)
    before, info = envs.reset(seed=1)
    after, again = envs.reset(seed=1, options={"reset_mask": np.array([False, True])})
    np.testing.assert_array_equal(after, before)
    assert list(again["_seed"]) == [False, True]
    assert again["seed"][1] == info["seed"][1]
    with pytest.raises(ValueError, match="reset_mask: must be 2 booleans"):
        envs.reset(options={"reset_mask": np.array([True])})
    with pytest.raises(RuntimeError, match="this trial has ended"):
        for given in actions(2, 60):
            envs.step(given)


def test_images_from_workers_are_the_callers():
    envs = vector(2, workers=2, observe="images", render_mode="rgb_array",
                  settings={"rig.width_px": 160, "rig.height_px": 120})
    first, _ = envs.reset(seed=1)
    kept = first.copy()
    assert first.shape == (2, 2, 120, 160, 3) and first.any()
    for given in actions(2, 3):
        second = envs.step(given)[0]
    np.testing.assert_array_equal(first, kept)
    assert (second != first).any()
    np.testing.assert_array_equal(np.stack(envs.render())[:, :, :160], second[:, 0])
    envs.close()


def test_an_error_in_a_worker_is_raised_here():
    envs = DockingVectorEnv(3, workers=2, env=Odd, does="raise")
    processes = envs.processes
    envs.reset(seed=1)
    with pytest.raises(KeyError, match="no such thruster") as error:
        for given in actions(3, 5):
            envs.step(given)
    assert "environment 1, worker of environments 0 to 1" in str(error.value.__cause__)
    assert "in step" in str(error.value.__cause__)
    assert gone(processes)
    with pytest.raises(RuntimeError, match="closed"):
        envs.step(actions(3, 1)[0])
    envs.close()


@pytest.mark.parametrize("does, error, words", [
    ("exit", RuntimeError, "worker of environments 0 to 1 has ended, exit code 7"),
    ("hang", TimeoutError, "worker of environments 0 to 1 took longer than 3 s")])
def test_a_worker_that_ends_or_hangs_is_noticed(does, error, words):
    envs = DockingVectorEnv(3, workers=2, env=Odd, does=does)
    envs._time_limit_s = 3  # not of the start
    processes = envs.processes
    envs.reset(seed=1)
    with pytest.raises(error, match=words):
        for given in actions(3, 5):
            envs.step(given)
    assert gone(processes)


def test_misuse_is_named():
    with pytest.raises(turbidock.ConfigError, match="no_such_key"):
        vector(2, settings={"no_such_key": 1})
    with pytest.raises(ValueError, match="workers must be at least 1"):
        vector(2, workers=0)
    envs = vector(2, workers=1, settings=SHORT)
    envs.reset(seed=1)
    with pytest.raises(ValueError, match=r"shape \(3, 4\), must be \(2, 4\)"):
        envs.step(np.zeros((3, 4)))
    with pytest.raises(ValueError, match="seed: 3 of them, must be 2"):
        envs.reset(seed=[1, 2, 3])
    with pytest.raises(RuntimeError, match=r"step_wait\(\) before"):
        envs.step_wait()
    envs.step_async(np.zeros((2, 4)))
    with pytest.raises(RuntimeError, match=r"call step_wait\(\)"):
        envs.reset()
    envs.step_wait()
    with pytest.raises(ValueError, match=r"must be in \[-1, 1\]"):
        envs.step([[0, 0, 0, 0], [0, 0, 2, 0]])


def test_what_cannot_travel_is_an_error():
    envs = DockingVectorEnv(1, env=Odd, does="nothing")
    assert envs.call("np_random_seed") == envs.get_attr("np_random_seed")
    with pytest.raises(TypeError, match="pickle"):
        envs.call("lock")


def test_an_environment_left_open_ends_with_its_owner():
    script = ("import turbidock, os, sys\n"
              "from turbidock.vector_env import DockingVectorEnv\n"
              "if __name__ == '__main__':\n"
              "    envs = DockingVectorEnv(2, workers=2, settings={'pose_source': 'true_pose'})\n"
              "    envs.reset(seed=1)\n"
              "    print(*[p.pid for p in envs.processes], flush=True)\n"
              "    sys.stdin.read()\n")
    owner = subprocess.Popen([sys.executable, "-c", script], stdin=subprocess.PIPE,
                             stdout=subprocess.PIPE, text=True)
    pids = [int(pid) for pid in owner.stdout.readline().split()]
    assert len(pids) == 2
    owner.send_signal(signal.SIGKILL)
    owner.wait()
    owner.stdin.close()
    owner.stdout.close()

    def runs(pid):
        try:
            with open(f"/proc/{pid}/stat", encoding="ascii") as file:
                return file.read().rsplit(")", 1)[1].split()[0] != "Z"
        except FileNotFoundError:
            return False

    for _ in range(300):
        if not any(runs(pid) for pid in pids):
            return
        time.sleep(0.1)
    pytest.fail("workers outlive their owner")
