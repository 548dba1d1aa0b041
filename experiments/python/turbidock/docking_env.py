"""Docking as a Gymnasium environment: turbidock/Docking-v0.

The vehicle begins in control: `reset` lets the trial run until the marker has been found. From then
on an action is the force by axis (surge, sway, heave; for yaw the moment), held for
`frames_per_action` camera frames: 1 is the share `MOST` of all that the vehicle has. The docking
procedure goes on as in every trial: it says where the marker shall be (first in front of the dock,
then closer and closer) and when the trial is over.

The observation has 12 numbers: by axis the error (where the marker is less where it shall be) in
units of 0.1 m and 0.2 rad, its rate in units of 0.2 m/s and 0.5 rad/s, and what came of the last
action. Signs are such that an action of plus the error steers towards the dock; this docks:

    action = np.clip(observation[:4] + observation[4:8], -1, 1)

Weaker in surge, it does not overcome what the pole meets in the dock; much stronger in yaw, it
swings, for images are older than the vehicle's motion and actions are held.

The reward of a step is the sum of four parts, which `info` has by these names:

    reward_progress  10 times what a potential gained: by the true pose, less the errors by axis in
                     units of 0.5 m, 0.2 m, 0.2 m and 0.5 rad (each 5 at most), less 4 times the x [m]
                     that is wanted, which gets smaller as the procedure goes on
    reward_effort    -0.01 times the mean square of the action
    reward_time      -0.01
    reward_end       10 for `docked`, 0 where the time is up, which truncates, -10 for any other end

At every step `info` also has `stage` (of the procedure) and `in_control`: false while the vehicle has
lost the marker, and drifts or searches, whatever the action. The last step adds outcome, reason,
time_s, digest and is_success. That of `reset` has the trial's seed and `settings`: those drawn or
given for it. The simulator has no window: with render_mode="human" gymnasium.make shows the images
in one of its own, which takes pygame.
"""

from __future__ import annotations

import math
from typing import Any, Mapping, Sequence

import gymnasium
import numpy as np
from gymnasium import spaces

from . import _core
from .plug_in import Controller, Key
from .scenario import Scenario, as_yaml, assignments_of, scenario_of
from .trial import Trial

OBSERVATIONS = ("estimate", "truth", "images")
# What an action of one gives, as a share of all that the vehicle has. Surge: what stops within its
# way; yaw: a vehicle turns much faster than it can see.
MOST = np.array([0.2, 1.0, 1.0, 0.2])
_SCALE = np.array([0.1, 0.1, 0.1, 0.2])  # m, m, m, rad
_RATE_SCALE = np.array([0.2, 0.2, 0.2, 0.5])  # per second
_LIMIT = 10.0  # of a number of the observation
_WAY = (0.5, 0.2, 0.2, 0.5)  # m, m, m, rad: about those at the beginning


def features(position: np.ndarray, rate: np.ndarray, wanted: np.ndarray,
             given: np.ndarray) -> np.ndarray:
    """The observation of a controller: error, rate, and of the action what the thrusters could give."""
    error = position - wanted
    error[3] = (float(error[3]) + math.pi) % (2 * math.pi) - math.pi
    numbers = np.concatenate((error / _SCALE, rate / _RATE_SCALE, given))
    # np.clip takes several times as long
    limited: np.ndarray = np.minimum(np.maximum(numbers, -_LIMIT), _LIMIT).astype(np.float32)
    return limited


class DockingEnv(gymnasium.Env):
    """See the module.

    scenario, settings: as of turbidock.Scenario; each reset draws another seed.
    random: keys of the scenario that are drawn for each trial, as in a plan, from the trial's seed:
        {"water.milk_ml_m3": {"uniform": [0, 20]}}.
    observe: "estimate" (what a controller sees: error, rate and given share by axis, 12 numbers),
        "truth" (the same of the true pose), "images" (2, height, width, 3), or several of them,
        which make a dict. Images are those of the cameras, whatever the scenario's pose_source:
        with true_pose there is no estimator, and a trial takes no more time than they do.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}

    def __init__(self, scenario: str = "sea_night_active", *,
                 settings: Mapping[str, Any] | None = None,
                 random: Mapping[str, Mapping[str, Any]] | None = None,
                 observe: str | Sequence[str] = "estimate", frames_per_action: int = 3,
                 render_mode: str | None = None) -> None:
        self._observe = (observe,) if isinstance(observe, str) else tuple(observe)
        for what in self._observe:
            if what not in OBSERVATIONS:
                raise ValueError(f"observe: {what!r} must be one of {', '.join(OBSERVATIONS)}")
        if not self._observe:
            raise ValueError(f"observe: nothing; choose of {', '.join(OBSERVATIONS)}")
        if frames_per_action < 1:
            raise ValueError("frames_per_action must be at least 1")
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode: {render_mode!r} must be None or 'rgb_array'")
        self.render_mode = render_mode
        self._frames_per_action = frames_per_action
        if "trial.seed" in (random or {}) or any(map(_core.gives_seed, assignments_of(settings))):
            raise ValueError("seed: reset(seed=...) gives the episodes theirs")
        self._scenario = Scenario(scenario, settings=settings)
        self._random = {key: as_yaml(value) for key, value in (random or {}).items()}
        self._draw(0, {})  # mistakes are best told here
        self.metadata = {**self.metadata, "render_fps":
                         self._scenario["trial.clock.frames_per_second"] / frames_per_action}
        self._draws = "images" in self._observe or render_mode is not None
        self._trial: Trial | None = None
        self._last_true: tuple[float, np.ndarray] | None = None
        self._potential = 0.0
        self._most = np.zeros(4)  # what an action of one gives

        shapes: dict[str, spaces.Space[Any]] = {
            what: spaces.Box(-_LIMIT, _LIMIT, (12,), np.float32) for what in ("estimate", "truth")}
        shapes["images"] = spaces.Box(
            0, 255, (2, self._scenario["cameras.rig.height_px"], self._scenario["cameras.rig.width_px"], 3),
            np.uint8)
        chosen = {what: shapes[what] for what in self._observe}
        self.observation_space = (spaces.Dict(chosen) if len(chosen) > 1
                                  else chosen[self._observe[0]])
        self.action_space = spaces.Box(-1, 1, (4,), np.float32)

    def __repr__(self) -> str:
        return f"<DockingEnv {self._scenario.description!r}, observe {', '.join(self._observe)}>"

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None
              ) -> tuple[Any, dict[str, Any]]:
        """A new trial. Options: "seed" is that of the trial, which else is drawn from ours; "settings",
        keys of the scenario for this trial alone."""
        super().reset(seed=seed)
        options = options or {}
        if unknown := ", ".join(sorted(options.keys() - {"seed", "settings"})):
            raise ValueError(f"options: {unknown}: unknown; there are seed and settings")
        for _ in range(20):
            number = options.get("seed")
            number = int(self.np_random.integers(2**31) if number is None else number)
            scenario, settings = self._draw(number, options.get("settings") or {})
            self._trial = Trial(scenario, images=self._draws, steered=True)
            while not self._trial.ended and not self._trial.in_control:
                self._trial.step(np.zeros(4))
            if not self._trial.ended:
                break
            if "seed" in options:
                raise RuntimeError(f"seed {number}: the trial ended before the marker was found")
        else:
            raise RuntimeError("20 trials ended before the marker was found: too hard a scenario")
        self._last_true = None
        self._most = MOST * self._trial.authority
        self._potential = self._potential_now()
        return self._observation(), {**self._info(), "seed": number, "settings": settings}

    def _draw(self, seed: int, given: Mapping[str, Any]) -> tuple[Scenario, dict[str, Any]]:
        made = scenario_of(self._scenario, seed=seed,
                           settings=_core.draw(self._random, seed) + assignments_of(given))
        return made, {key: made[key] for key in {**self._random, **given}}

    def _info(self) -> dict[str, Any]:
        assert self._trial is not None
        return {"in_control": self._trial.in_control, "stage": self._trial.frame.stage}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        trial = self._trial
        if trial is None:
            raise RuntimeError("step() before reset()")
        if trial.ended:
            raise RuntimeError("this trial has ended: call reset()")
        given = np.asarray(action, np.float64)
        if given.shape != (4,):
            raise ValueError(f"action: shape {given.shape}, must be (4,): surge, sway, heave, yaw")
        shares = given.tolist()
        if not all(abs(share) <= 1 + 1e-6 for share in shares):
            raise ValueError(f"action: {shares}, each must be in [-1, 1]")
        demand = np.array([min(max(share, -1.0), 1.0) for share in shares]) * self._most
        for _ in range(self._frames_per_action):
            trial.step(demand)
            if trial.ended:
                break
        potential = self._potential_now()
        parts = {"reward_progress": 10 * (potential - self._potential),  # sums up to where it ends
                 "reward_effort": -0.01 * sum(share * share for share in shares) / 4,
                 "reward_time": -0.01, "reward_end": 0.0}
        self._potential = potential
        info = self._info()
        terminated = truncated = False
        if trial.ended:
            result = trial.result()
            info |= {"outcome": result.outcome, "reason": result.reason, "time_s": result.time_s,
                     "digest": result.digest, "is_success": result.outcome == "success"}
            truncated = result.outcome == "timeout"
            terminated = not truncated
            parts["reward_end"] = 10.0 if info["is_success"] else 0.0 if truncated else -10.0
        return self._observation(), sum(parts.values()), terminated, truncated, info | parts

    def render(self) -> np.ndarray | None:
        """Both cameras side by side."""
        if self.render_mode is None or self._trial is None:
            return None
        return np.concatenate(self._trial.images, axis=1)

    def close(self) -> None:
        self._trial = None

    def _potential_now(self) -> float:
        """Higher the nearer to docked, by the truth: the error, and how far the dock still is."""
        assert self._trial is not None
        frame = self._trial.frame
        wanted = frame.desired.tolist()
        error = sum(min(abs(true - want) / way, 5.0)
                    for true, want, way in zip(self._true_axes(frame), wanted, _WAY))
        return float(-error - 4 * wanted[0])

    @staticmethod
    def _true_axes(frame: Any) -> list[float]:
        w, x, y, z = frame.true_quaternion_wxyz.tolist()
        heading = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        return [*frame.true_position.tolist(), heading]

    def _observation(self) -> Any:
        assert self._trial is not None
        see = {"estimate": self._estimate, "truth": self._truth, "images": self._images}
        parts = {what: see[what](self._trial) for what in self._observe}
        return parts if len(parts) > 1 else parts[self._observe[0]]

    def _estimate(self, trial: Trial) -> np.ndarray:
        seen = trial.seen
        rate = np.zeros(4) if seen.rate is None else seen.rate
        given = trial.given / self._most
        return features(seen.position, rate, trial.wanted.position, given)

    def _truth(self, trial: Trial) -> np.ndarray:
        frame = trial.frame
        position = np.array(self._true_axes(frame))
        rate = np.zeros(4)
        if self._last_true is not None and frame.time_s > self._last_true[0]:
            rate = (position - self._last_true[1]) / (frame.time_s - self._last_true[0])
        self._last_true = (frame.time_s, position)
        given = trial.given / self._most
        return features(position, rate, frame.desired, given)

    def _images(self, trial: Trial) -> np.ndarray:
        return np.stack(trial.images)


class PolicyController(Controller):
    """A learnt policy as a controller, for run, batch and gate: it sees the observation
    "estimate" and acts every `frames_per_action` frames, as in the environment. Make a class of it
    whose `act` is the policy:

        class Learnt(PolicyController):
            def act(self, observation):
                return model.predict(observation, deterministic=True)[0]
    """

    pose_filter = True
    frames_per_action = Key(3, 1, 100, "frames for which an action is held")

    def start(self) -> None:
        self._demand = np.zeros(4)
        self._most = MOST * self.authority
        self._frames = 0  # since there first was control

    def act(self, observation: np.ndarray) -> np.ndarray:
        """An action for what `features` makes of a frame."""
        raise NotImplementedError(f"{type(self).__name__} has no act()")

    def demand(self, seen: Any, wanted: Any) -> np.ndarray:
        self._seen, self._wanted = seen, wanted
        return self._demand

    def observe(self, seen: Any) -> None:
        self._seen = seen

    def given(self, frame: int, given: np.ndarray) -> None:
        # As in an environment, an action begins with the frame after the one that it follows from.
        if not hasattr(self, "_wanted"):
            return
        if self._frames % self.frames_per_action == 0:
            rate = np.zeros(4) if self._seen.rate is None else self._seen.rate
            observation = features(self._seen.position, rate, self._wanted.position,
                                   given / self._most)
            action = np.asarray(self.act(observation), np.float32).astype(float)  # as a Box has it
            self._demand = np.clip(action, -1, 1) * self._most
        self._frames += 1
