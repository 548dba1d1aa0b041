"""Many docking environments stepped at once, over worker processes.

    if __name__ == "__main__":         # each worker imports a script anew
        envs = gymnasium.make_vec("turbidock/Docking-v0", num_envs=8, workers=2)
        observations, infos = envs.reset(seed=1)             # environment i: seed 1 + i
        observations, rewards, terminated, truncated, infos = envs.step(actions)

A worker steps its share of the environments for one message. Actions, observations, rewards and
flags lie in memory that all share: to send them would cost as much as a step. Only what is rare is
sent: infos, resets, errors.
"""

from __future__ import annotations

import contextlib
import copy
import multiprocessing
import os
import pickle
import select
import signal
import time
import traceback
from typing import Any, Callable, Sequence

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import (batch_space, create_shared_memory, read_from_shared_memory,
                                    write_to_shared_memory)

from .docking_env import DockingEnv


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
        shared = (create_shared_memory(self.single_observation_space, num_envs, context),
                  *(context.RawArray(kind, count) for kind, count in (
                      ("f", 4 * num_envs), ("d", num_envs), ("b", num_envs), ("b", num_envs))))
        self._observations = read_from_shared_memory(self.single_observation_space, shared[0],
                                                     num_envs)
        self._actions, *self._ends = _arrays(shared)
        shares = np.array_split(np.arange(num_envs),
                                min(workers or len(os.sched_getaffinity(0)), num_envs))
        try:
            for share in shares:
                self._workers.append(_Worker(context, range(share[0], share[-1] + 1), mode, shared,
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
        self._tell("reset", lambda share: [[seeds[i] if mask[i] else False for i in share], options])
        infos = self._infos(self._wait())
        return self._seen(), infos

    def step(self, actions: Any) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Observations, rewards, terminated, truncated, infos, after one step of each."""
        self.step_async(actions)
        return self.step_wait()

    def step_async(self, actions: Any) -> None:
        """Begins a step, which step_wait ends: something else may be done between them."""
        given = np.asarray(actions, np.float32)
        if given.shape != self.action_space.shape:
            raise ValueError(f"actions: shape {given.shape}, must be {self.action_space.shape}")
        self._require_idle()
        self._actions[:] = given
        self._tell()

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Waits for what step_async began."""
        if not self._waits:
            raise RuntimeError("step_wait() before step_async()")
        infos = self._infos(self._wait())
        rewards, terminated, truncated = (array.copy() for array in self._ends)
        return self._seen(), rewards, terminated, truncated, infos

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Of each environment the attribute, or what its method gives."""
        self._tell("call", lambda share: [name, args, kwargs])
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

    def _require_idle(self) -> None:
        if not self._workers:
            raise RuntimeError("this environment is closed")
        if self._waits:
            raise RuntimeError("a step is under way: call step_wait()")

    def _tell(self, what: str = "", args_of: Callable[[range], list[Any]] | None = None) -> None:
        """Has every worker do that; a step without any."""
        self._require_idle()
        self._waits = True
        for worker in self._workers:
            message = pickle.dumps((what, args_of(worker.share))) if args_of else b""
            with contextlib.suppress(OSError):  # it has ended, as _wait() will say
                worker.pipe.send_bytes(message)

    def _wait(self) -> list[Any]:
        """What each worker says when it is done."""
        limit_s = self._time_limit_s
        end = None if limit_s is None else time.monotonic() + limit_s
        try:
            said = []
            for worker in self._workers:
                left_s = None if end is None else max(0.0, end - time.monotonic())
                if not worker.ready.poll(None if left_s is None else 1000 * left_s):
                    raise TimeoutError(f"{worker} took longer than {limit_s:g} s")
                said.append(worker.take())
        except BaseException:
            self._end()
            raise
        self._waits = False
        return said

    def _end(self) -> None:
        for worker in self._workers:
            worker.pipe.close()  # at which it ends, unless it hangs
        for worker in self._workers:
            for stop in (lambda: None, worker.process.terminate, worker.process.kill):
                if worker.process.is_alive():
                    stop()
                    worker.process.join(1.0)
        self._workers, self._waits = [], False

    def _seen(self) -> Any:
        return copy.deepcopy(self._observations) if self._copy else self._observations

    def _infos(self, said: Sequence[Any]) -> dict[str, Any]:
        infos: dict[str, Any] = {}
        for i, info in (row for rows in said for row in rows or ()):
            infos = self._add_info(infos, info, i)
        return infos


def _arrays(shared: Sequence[Any]) -> tuple[np.ndarray, ...]:
    """Of the shared memory but the observations: actions, rewards, terminated, truncated."""
    _, actions, rewards, *flags = shared
    return (np.frombuffer(actions, np.float32).reshape(-1, 4), np.frombuffer(rewards),
            *(np.frombuffer(flag, np.bool_) for flag in flags))


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
    """A worker as its owner sees it."""

    def __init__(self, context: Any, share: range, *what: Any) -> None:
        self.share = share
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_work, daemon=True,
                                       args=(str(self), theirs, share, *what))
        self.process.start()
        theirs.close()
        # a connection's own poll takes longer than a step
        self.ready = select.poll()
        self.ready.register(self.pipe, select.POLLIN)

    def take(self) -> Any:
        """What it has sent."""
        try:
            message = self.pipe.recv_bytes()
        except (EOFError, OSError):
            self.process.join(1.0)
            raise RuntimeError(f"{self} has ended, exit code {self.process.exitcode}") from None
        said = pickle.loads(message) if message else None
        if isinstance(said, _Failure):
            raise said.error from RuntimeError(said.traceback)
        return said

    def __str__(self) -> str:
        return f"the worker of environments {self.share.start} to {self.share.stop - 1}"


def _work(name: str, pipe: Any, *what: Any) -> None:
    """A worker's process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # its owner's to handle
    steps: _Steps | None = None
    try:
        steps = _Steps(*what)
        said = None
        while True:
            pipe.send_bytes(b"" if said is None else pickle.dumps(said))
            message = pipe.recv_bytes()
            order, args = pickle.loads(message) if message else ("step", ())
            said = getattr(steps, order)(*args)
    except (EOFError, ConnectionError):  # its owner has ended
        pass
    except Exception as error:
        at = f"environment {steps.at}, " if steps else ""
        with contextlib.suppress(OSError):
            pipe.send_bytes(pickle.dumps(_Failure(error, at + name.removeprefix("the "))))


class _Steps:
    """A worker's environments."""

    def __init__(self, share: range, mode: AutoresetMode, shared: Any,
                 env: Callable[..., gymnasium.Env], options: dict[str, Any]) -> None:
        self._mode, self._observations = mode, shared[0]
        self._actions, self._rewards, self._terminated, self._truncated = _arrays(shared)
        self._envs = {i: env(**options) for i in share}
        self._over = dict.fromkeys(share, False)
        self.at = share.start  # the environment at work

    def reset(self, seeds: Sequence[Any], options: dict[str, Any]) -> list[tuple[int, Any]]:
        """Infos by environment; a seed that is False: not that one."""
        return [(self.at, self._reset(env, seed=seed, options=options))
                for (self.at, env), seed in zip(self._envs.items(), seeds) if seed is not False]

    def step(self) -> list[tuple[int, Any]] | None:
        """Infos by environment where there are any."""
        infos = []
        for self.at, env in self._envs.items():
            i = self.at
            if self._over[i] and self._mode == AutoresetMode.NEXT_STEP:
                self._rewards[i], self._terminated[i], self._truncated[i] = 0.0, False, False
                infos.append((i, self._reset(env)))
                continue
            observation, self._rewards[i], terminated, truncated, info = env.step(
                self._actions[i].copy())
            self._terminated[i], self._truncated[i] = terminated, truncated
            over = bool(terminated or truncated)
            if over and self._mode == AutoresetMode.SAME_STEP:
                infos.append((i, {"final_obs": observation, "final_info": info}))
                info = self._reset(env)
            else:
                self._show(env, observation)
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

    def _reset(self, env: gymnasium.Env, **how: Any) -> Any:
        observation, info = env.reset(**how)
        self._show(env, observation)
        self._over[self.at] = False
        return info

    def _show(self, env: gymnasium.Env, observation: Any) -> None:
        write_to_shared_memory(env.observation_space, self.at, observation, self._observations)
