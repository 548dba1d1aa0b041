"""Many docking environments stepped at once, over worker processes.

    if __name__ == "__main__":         # each worker imports a script anew
        envs = gymnasium.make_vec("turbidock/Docking-v0", num_envs=8, workers=2)
        observations, infos = envs.reset(seed=1)             # environment i: seed 1 + i
        observations, rewards, terminated, truncated, infos = envs.step(actions)

A worker steps its share of the environments for one signal. Actions, observations, rewards and
flags lie in memory that all share; only what is rare is sent: infos, resets, errors.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import time
import traceback
from dataclasses import dataclass
from typing import Any, Callable, Sequence

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space, create_shared_memory, read_from_shared_memory

from .docking_env import DockingEnv

_STEP, _MESSAGE, _END = range(3)  # what a worker is told to do


class DockingVectorEnv(gymnasium.vector.VectorEnv):
    """`num_envs` environments in `workers` processes, each stepping num_envs / workers of them.

    Observations, actions and rewards are those of DockingEnv in one array each, the first axis the
    environment's number: (num_envs, 12), (num_envs, 4), (num_envs,); several kinds of observations
    make a dict of such arrays. Environment i goes through the same trials as a DockingEnv alone
    with the same seed and actions, however many workers there are.

    workers: at most one an environment; as many as cores where none is given.
    autoreset_mode: of Gymnasium. With next-step, the step after an end begins the next trial and
        leaves the action of that environment out; with same-step, the ending step does, and
        infos["final_obs"] and infos["final_info"] have the end; when disabled, it is for
        reset(options={"reset_mask": mask}).
    copy: observations are the caller's. Without, the next step writes over them.
    time_limit_s: how long workers may take to start, for a step or for a reset; None: for ever.
    env: what makes one of them of `options`: a class or function that a process can import.
    options: of DockingEnv (scenario, settings, observe, frames_per_action, render_mode).

    An error in a worker is raised here as the same type, with the environment and the worker's
    traceback as its cause; a worker that ended or hangs is a RuntimeError or a TimeoutError. After
    either all workers have ended and only close() is left to call.
    """

    def __init__(self, num_envs: int = 1, *, workers: int | None = None,
                 autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP, copy: bool = True,
                 time_limit_s: float | None = 120.0,
                 env: Callable[..., gymnasium.Env] = DockingEnv, **options: Any) -> None:
        self._workers: list[_Worker] = []
        self._waits = False
        if num_envs < 1:
            raise ValueError("num_envs must be at least 1")
        if workers is not None and workers < 1:
            raise ValueError("workers must be at least 1")
        self.num_envs = num_envs
        self._copy, self._time_limit_s = copy, time_limit_s
        mode = AutoresetMode(autoreset_mode)

        one = env(**options)  # whose errors are best raised here; it draws nothing
        self.metadata = {**one.metadata, "autoreset_mode": mode}
        self.render_mode = one.render_mode
        self.single_observation_space = one.observation_space
        self.single_action_space = one.action_space
        one.close()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

        # started anew, not forked: drawing may have begun here
        context: Any = multiprocessing.get_context("spawn")
        shared = _Shared(
            num_envs, self.single_observation_space, self.single_action_space,
            create_shared_memory(self.single_observation_space, num_envs, context),
            create_shared_memory(self.single_action_space, num_envs, context),
            context.RawArray("d", num_envs), context.RawArray("b", 2 * num_envs))
        self._arrays = _Arrays(shared)
        shares = np.array_split(np.arange(num_envs), min(workers or _cores(), num_envs))
        try:
            for share in shares:
                self._workers.append(_Worker(context, range(share[0], share[-1] + 1), shared, mode,
                                             env, options))
            self._wait()
        except BaseException:
            self._end()
            raise

    @property
    def processes(self) -> list[Any]:
        """The workers' processes."""
        return [worker.process for worker in self._workers]

    def reset(self, *, seed: int | Sequence[int | None] | None = None,
              options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """New trials in all, or where options["reset_mask"] is true; other options as of
        DockingEnv. Environment i gets the seed `seed` + i, or seed[i]; None: it goes on drawing."""
        count = self.num_envs
        seeds = ([None] * count if seed is None else
                 [seed + i for i in range(count)] if isinstance(seed, (int, np.integer)) else
                 list(seed))
        if len(seeds) != count:
            raise ValueError(f"seed: {len(seeds)} of them, must be {count}, one an environment")
        options = dict(options or {})
        mask = np.asarray(options.pop("reset_mask", np.ones(count, bool)))
        if mask.shape != (count,) or mask.dtype != np.bool_ or not mask.any():
            raise ValueError(f"reset_mask: must be {count} booleans, not all of them false")
        self._tell([("reset", [seeds[i] if mask[i] else False for i in worker.share], options)
                    for worker in self._workers])
        infos = self._infos(self._wait())
        return self._observations(), infos

    def step(self, actions: Any) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Observations, rewards, terminated, truncated, infos, after one step of each."""
        self.step_async(actions)
        return self.step_wait()

    def step_async(self, actions: Any) -> None:
        """Begins a step, which step_wait ends: something else may be done between them."""
        given = np.asarray(actions, np.float32)
        if given.shape != self._arrays.actions.shape:
            raise ValueError(f"actions: shape {given.shape}, must be {self._arrays.actions.shape}")
        self._require_idle()
        self._arrays.actions[:] = given
        self._waits = True
        for worker in self._workers:
            worker.begin(_STEP)

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Waits for what step_async began."""
        if not self._waits:
            raise RuntimeError("step_wait() before step_async()")
        infos = self._infos(self._wait())
        arrays = self._arrays
        return (self._observations(), arrays.rewards.copy(), arrays.terminated.copy(),
                arrays.truncated.copy(), infos)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Of each environment the attribute, or what its method gives."""
        self._tell([("call", name, args, kwargs)] * len(self._workers))
        return tuple(value for values in self._wait() for value in values)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Of each environment the attribute."""
        return self.call(name)

    def render(self) -> tuple[Any, ...] | None:
        """Of each environment both cameras side by side."""
        return None if self.render_mode is None else self.call("render")

    def close_extras(self, **kwargs: Any) -> None:
        """Ends the workers, also those that hang."""
        self._end()

    def _tell(self, messages: Sequence[Any]) -> None:
        self._require_idle()
        self._waits = True
        for worker, message in zip(self._workers, messages):
            worker.begin(_MESSAGE, message)

    def _require_idle(self) -> None:
        if not self._workers:
            raise RuntimeError("this environment is closed")
        if self._waits:
            raise RuntimeError("a step is under way: call step_wait()")

    def _wait(self) -> list[Any]:
        """What each worker says when it is done."""
        limit = None if self._time_limit_s is None else time.monotonic() + self._time_limit_s
        try:
            said = [worker.wait(limit, self._time_limit_s) for worker in self._workers]
        except BaseException:
            self._end()
            raise
        self._waits = False
        return said

    def _end(self) -> None:
        for worker in self._workers:
            worker.end(asked=not self._waits)
        self._workers, self._waits = [], False

    def _observations(self) -> Any:
        return _copy(self._arrays.observations) if self._copy else self._arrays.observations

    def _infos(self, said: Sequence[Any]) -> dict[str, Any]:
        infos: dict[str, Any] = {}
        for rows in said:
            for i, info in rows or ():
                infos = self._add_info(infos, info, i)
        return infos


def _cores() -> int:
    return len(os.sched_getaffinity(0))


def _named(share: range) -> str:
    return f"environments {share.start} to {share.stop - 1}"


def _copy(arrays: Any) -> Any:
    if isinstance(arrays, dict):
        return {what: _copy(array) for what, array in arrays.items()}
    return arrays.copy()


def _put(arrays: Any, i: int, value: Any) -> None:
    if isinstance(arrays, dict):
        for what, array in arrays.items():
            _put(array, i, value[what])
    else:
        arrays[i] = value


@dataclass
class _Shared:
    """The memory that processes share, and what is in it."""

    num_envs: int
    observation_space: gymnasium.Space
    action_space: gymnasium.Space
    observations: Any
    actions: Any
    rewards: Any
    flags: Any


class _Arrays:
    """The same as arrays, by environment."""

    def __init__(self, shared: _Shared) -> None:
        count = shared.num_envs
        self.observations: Any = read_from_shared_memory(
            shared.observation_space, shared.observations, count)
        self.actions: Any = read_from_shared_memory(
            shared.action_space, shared.actions, count)
        self.rewards = np.frombuffer(shared.rewards)
        flags = np.frombuffer(shared.flags, np.bool_)
        self.terminated, self.truncated = flags[:count], flags[count:]


class _Failure:
    """An error on its way from a worker."""

    def __init__(self, error: Exception, where: str) -> None:
        self.traceback = f"{where}:\n{traceback.format_exc()}"
        try:
            pickle.loads(pickle.dumps(error))
            self.error: Exception = error
        except Exception:  # one that cannot travel
            self.error = RuntimeError(f"{type(error).__name__}: {error}")


class _Worker:
    """A worker as its owner sees it.

    Two semaphores carry the signals, `go` and `done`: each takes a microsecond, a pipe's message
    tens of them. What is said is behind the pipe where `says` is set.
    """

    def __init__(self, context: Any, share: range, shared: _Shared, mode: AutoresetMode,
                 env: Callable[..., gymnasium.Env], options: dict[str, Any]) -> None:
        self.share = share
        self._go, self._done = context.Semaphore(0), context.Semaphore(0)
        self._order, self._says = context.RawValue("b", _STEP), context.RawValue("b", 0)
        self._pipe, theirs = context.Pipe()
        self.process = context.Process(
            target=_work, daemon=True,
            args=(share, shared, mode, env, options, self._go, self._done, self._order, self._says,
                  theirs))
        self.process.start()
        theirs.close()

    def begin(self, order: int, message: Any = None) -> None:
        self._order.value = order
        self._go.release()
        if order == _MESSAGE:
            try:
                self._pipe.send(message)
            except OSError:  # it has ended, as wait() will say
                pass

    def wait(self, limit: float | None, limit_s: float | None) -> Any:
        """What it says once it is done; limit: by the monotonic clock, limit_s after its begin."""
        while not self._done.acquire(timeout=0.5):
            if not self.process.is_alive() and not self._done.acquire(block=False):
                raise RuntimeError(self._ended())
            if limit is not None and time.monotonic() > limit:
                raise TimeoutError(f"the worker of {_named(self.share)} took longer than {limit_s:g} s")
        if not self._says.value:
            return None
        try:
            said = self._pipe.recv()
        except (EOFError, OSError):
            raise RuntimeError(self._ended()) from None
        if isinstance(said, _Failure):
            raise said.error from RuntimeError(said.traceback)
        return said

    def end(self, asked: bool) -> None:
        """Ends its process; asked: it listens, so that it may end by itself."""
        self._pipe.close()
        if asked:
            self.begin(_END)
            self.process.join(1.0)
        if self.process.is_alive():
            self.process.terminate()
            self.process.join(2.0)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()

    def _ended(self) -> str:
        self.process.join(1.0)
        return f"the worker of {_named(self.share)} has ended, exit code {self.process.exitcode}"


def _work(share: range, shared: _Shared, mode: AutoresetMode, env: Callable[..., gymnasium.Env],
          options: dict[str, Any], go: Any, done: Any, order: Any, says: Any, pipe: Any) -> None:
    """A worker's process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # its owner's to handle
    owner = multiprocessing.parent_process()
    steps: _Steps | None = None
    failed = False
    while True:
        said: Any = None
        try:
            if steps is None:
                steps = _Steps(share, _Arrays(shared), mode, env, options)
            elif order.value == _STEP:
                said = steps.step()
            else:
                what, *args = pipe.recv()
                said = getattr(steps, what)(*args)
            message = None if said is None else pickle.dumps(said)
        except EOFError:  # its owner has ended
            return
        except Exception as error:
            at = "" if steps is None else f"environment {steps.at}, "
            failure = _Failure(error, f"{at}worker of {_named(share)}")
            failed, message = True, pickle.dumps(failure)
        says.value = message is not None
        done.release()  # first: whoever reads waits for it
        if message is not None:
            try:
                pipe.send_bytes(message)
            except OSError:  # its owner has ended
                return
        if failed:
            return
        while not go.acquire(timeout=5.0):
            if owner is None or not owner.is_alive():
                return
        if order.value == _END:
            return


class _Steps:
    """A worker's environments."""

    def __init__(self, share: range, arrays: _Arrays, mode: AutoresetMode,
                 env: Callable[..., gymnasium.Env], options: dict[str, Any]) -> None:
        self._arrays, self._mode = arrays, mode
        self.at = share.start  # the environment at work
        self._envs = {}
        for self.at in share:
            self._envs[self.at] = env(**options)
        self._over = {i: False for i in share}

    def reset(self, seeds: Sequence[Any], options: dict[str, Any]) -> list[tuple[int, Any]]:
        """Infos by environment; a seed that is False: not that one."""
        infos = []
        for (self.at, env), seed in zip(self._envs.items(), seeds):
            if seed is not False:
                infos.append((self.at, self._reset(env, seed=seed, options=options)))
        return infos

    def step(self) -> list[tuple[int, Any]] | None:
        """Infos by environment where there are any."""
        arrays, infos = self._arrays, []
        for self.at, env in self._envs.items():
            i = self.at
            if self._over[i] and self._mode == AutoresetMode.NEXT_STEP:
                infos.append((i, self._reset(env)))
                continue
            observation, arrays.rewards[i], terminated, truncated, info = env.step(
                arrays.actions[i].copy())
            arrays.terminated[i], arrays.truncated[i] = terminated, truncated
            over = bool(terminated or truncated)
            if over and self._mode == AutoresetMode.SAME_STEP:
                infos.append((i, {"final_obs": observation, "final_info": info}))
                info = self._reset(env, over=over)
            else:
                _put(arrays.observations, i, observation)
                self._over[i] = over
            if info:
                infos.append((i, info))
        return infos or None

    def call(self, name: str, args: Sequence[Any], kwargs: dict[str, Any]) -> list[Any]:
        values = []
        for self.at, env in self._envs.items():
            value = env.get_wrapper_attr(name)
            values.append(value(*args, **kwargs) if callable(value) else value)
        return values

    def _reset(self, env: gymnasium.Env, over: bool = False, **how: Any) -> Any:
        """Begins a trial; over: the flags still tell of the one before."""
        observation, info = env.reset(**how)
        arrays, i = self._arrays, self.at
        _put(arrays.observations, i, observation)
        if not over:
            arrays.rewards[i], arrays.terminated[i], arrays.truncated[i] = 0.0, False, False
        self._over[i] = False
        return info
