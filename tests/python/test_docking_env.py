"""The Gymnasium environment."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import turbidock
from turbidock.docking_env import PolicyController
from conftest import QUICK


SMALL = {"cameras.rig.width_px": 160, "cameras.rig.height_px": 120}


@pytest.mark.parametrize("observe, settings", [
    ("estimate", QUICK), ("truth", {**QUICK, **SMALL}), (("estimate", "truth"), {**QUICK, **SMALL}),
    ("images", {**QUICK, **SMALL}), (("estimate", "images"), SMALL)])
def test_passes_the_checker(observe, settings):
    env = gymnasium.make("turbidock/Docking-v0", observe=observe, settings=settings)
    assert env.spec is not None  # else rendering is not checked
    check_env(env.unwrapped)


def test_a_film_of_the_true_pose_is_the_same_trial():
    def make(**options):
        return gymnasium.make("turbidock/Docking-v0", frames_per_action=6, **options,
                              settings={**QUICK, **SMALL, "trial.duration_s": 3})

    env = make(render_mode="rgb_array", observe=("estimate", "images"))
    observation, _ = env.reset(options={"seed": 4})
    seen, over = [env.render()], False
    while not over:
        observation, _, terminated, truncated, end = env.step(act(observation["estimate"]))
        np.testing.assert_array_equal(env.render(), np.concatenate(observation["images"], axis=1))
        seen.append(env.render())
        over = terminated or truncated
    assert end["digest"] == episode(make(), act, options={"seed": 4})["digest"]
    assert seen[0].shape == (120, 320, 3) and seen[0].max() > 60
    assert all((a != b).any() for a, b in zip(seen, seen[1:]))
    assert env.metadata["render_fps"] == 5  # of 30 frames


def test_info_has_the_parts_of_the_reward():
    env = gymnasium.make("turbidock/Docking-v0", scenario="pool_active",
                         settings={**QUICK, "trial.duration_s": 30})
    observation, info = env.reset(options={"seed": 2})
    assert info["in_control"] and info["stage"] == "visual_servoing" and info["settings"] == {}
    over, stages = False, set()
    while not over:
        observation, reward, terminated, truncated, info = env.step(act(observation))
        assert reward == pytest.approx(sum(info[f"reward_{part}"] for part in (
            "progress", "effort", "time", "end")))
        assert info["reward_effort"] <= 0 and info["reward_time"] == -0.01
        stages.add(info["stage"])
        over = terminated or truncated
        assert info["reward_end"] == (10 if over else 0)
    assert {"visual_servoing", "docking"} <= stages


def test_it_says_what_it_is():
    env = gymnasium.make("turbidock/Docking-v0", observe=["estimate", "truth"]).unwrapped
    assert repr(env) == "<DockingEnv 'night sea, active marker', observe estimate, truth>"


def test_settings_of_one_trial():
    env = gymnasium.make("turbidock/Docking-v0", settings={**QUICK, "trial.duration_s": 30})
    observation, info = env.reset(seed=1, options={"seed": 3, "settings": {"trial.duration_s": 2}})
    assert info["settings"] == {"trial.duration_s": 2}
    end = episode(env, act, options={"seed": 3, "settings": {"trial.duration_s": 2}})
    assert end["outcome"] == "timeout" and end["time_s"] == pytest.approx(2)
    assert episode(env, act, options={"seed": 3})["time_s"] > 2
    with pytest.raises(ValueError, match="options: sead: unknown; there are seed and settings"):
        env.reset(options={"sead": 3})
    with pytest.raises(turbidock.ConfigError, match="did you mean duration_s"):
        env.reset(options={"settings": {"trial.durations_s": 3}})


def test_domain_randomisation_draws_as_plans_do(tmp_path):
    random = {"start.heading_rad": {"uniform": [0.0, 0.2]}, "cameras.delay_frames": {"choice": [1, 2]}}
    env = gymnasium.make("turbidock/Docking-v0", random=random, settings={**QUICK, "trial.duration_s": 2})
    env.reset(seed=1)
    drawn = [env.reset(options={"seed": seed})[1]["settings"] for seed in (5, 5, 6, 7, 8)]
    assert drawn[0] == drawn[1] != drawn[2]
    assert {each["cameras.delay_frames"] for each in drawn} == {1, 2}
    plan = {"schema_version": 1, "description": "one", "scenario": "sea_night_active", "seeds": 1,
            "master_seed": 5, "set": {**QUICK, "trial.duration_s": 0.1}, "random": random}
    trials = turbidock.batch(plan, str(tmp_path / "b.db"), workers=1)
    assert {key: trials[key][0] for key in random} == drawn[0]
    with pytest.raises(turbidock.ConfigError, match=r"^start.heading_rad.unifrom: must be one of uniform"):
        gymnasium.make("turbidock/Docking-v0", random={"start.heading_rad": {"unifrom": [0, 1]}})
    with pytest.raises(turbidock.ConfigError, match="did you mean heading_rad"):
        gymnasium.make("turbidock/Docking-v0", random={"start.heading_rd": {"uniform": [0, 1]}})


def test_the_same_seed_is_the_same_episode():
    def episode():
        env = gymnasium.make("turbidock/Docking-v0", settings={**QUICK, "trial.duration_s": 8})
        observation, info = env.reset(seed=4)
        rng, seen = np.random.default_rng(1), [observation]
        while True:
            observation, reward, terminated, truncated, info = env.step(
                rng.uniform(-1, 1, 4).astype(np.float32))
            seen.append(observation)
            if terminated or truncated:
                return np.array(seen), info["digest"]

    (a, digest_a), (b, digest_b) = episode(), episode()
    assert digest_a == digest_b
    np.testing.assert_array_equal(a, b)


def test_bad_actions_and_options_are_named():
    for given in ({"settings": {"trial": {"seed": 3}}}, {"random": {"trial.seed": {"uniform": [0, 1]}}}):
        with pytest.raises(ValueError, match="seed: reset"):
            gymnasium.make("turbidock/Docking-v0", **given)
    env = gymnasium.make("turbidock/Docking-v0", settings=QUICK).unwrapped
    with pytest.raises(RuntimeError, match="before reset"):
        env.step(np.zeros(4))
    env.reset(seed=1)
    with pytest.raises(ValueError, match=r"shape \(3,\)"):
        env.step(np.zeros(3))
    with pytest.raises(ValueError, match=r"must be in \[-1, 1\]"):
        env.step([0, 0, 2, 0])
    with pytest.raises(ValueError, match=r"must be in \[-1, 1\]"):
        env.step([0, 0, np.nan, 0])
    with pytest.raises(ValueError, match="must be one of estimate, truth, images"):
        gymnasium.make("turbidock/Docking-v0", observe="picture")


def act(observation):
    """The documented damped proportional policy."""
    return np.clip(observation[:4] + observation[4:8], -1, 1)


def episode(env, policy, **reset):
    """Its end's info, with the sum of rewards."""
    observation, info = env.reset(**reset)
    total, over = 0.0, False
    while not over:
        observation, reward, terminated, truncated, end = env.step(policy(observation))
        total, over = total + reward, terminated or truncated
    return {**info, **end, "return": total, "last": observation}


@pytest.mark.parametrize("scenario", ["pool_active", "sea_night_active"])
@pytest.mark.parametrize("observe", ["estimate", "truth"])
def test_a_policy_written_by_hand_docks(scenario, observe):
    env = gymnasium.make("turbidock/Docking-v0", scenario=scenario, observe=observe,
                         settings=QUICK)
    ends = [episode(env, act, options={"seed": seed}) for seed in range(10)]
    assert sum(end["is_success"] for end in ends) >= 9
    # and one that does not steer comes to less than any that docked
    idle = episode(env, lambda _: np.zeros(4, np.float32), options={"seed": 0})
    assert not idle["is_success"]
    assert idle["return"] < min(end["return"] for end in ends if end["is_success"])


def test_a_policy_docks_through_the_cameras_and_sees_the_last_image():
    env = gymnasium.make("turbidock/Docking-v0", scenario="pool_active",
                         observe=("estimate", "images"))
    end = episode(env, lambda seen: act(seen["estimate"]), options={"seed": 2})
    assert end["outcome"] == "success"
    assert end["last"]["images"].shape == (2, 480, 640, 3)


def test_two_environments_in_one_process_do_not_meet():
    settings = {**QUICK, "trial.duration_s": 4}

    def make():
        return gymnasium.make("turbidock/Docking-v0", scenario="pool_active", settings=settings)

    alone = [episode(make(), act, seed=seed)["digest"] for seed in (1, 2)]
    both, over = [make(), make()], 0
    seen = [env.reset(seed=seed)[0] for env, seed in zip(both, (1, 2))]
    digests = [None, None]
    while over < 2:
        for i, env in enumerate(both):
            if digests[i] is None:
                seen[i], _, terminated, truncated, end = env.step(act(seen[i]))
                if terminated or truncated:
                    digests[i] = end["digest"]
                    over += 1
    assert digests == alone


class Policy(PolicyController):
    def act(self, observation):
        return act(observation)


def test_a_policy_is_the_same_as_a_law():
    settings = {**QUICK, "trial.duration_s": 20}
    env = gymnasium.make("turbidock/Docking-v0", scenario="pool_active", settings=settings)
    end = episode(env, lambda seen: act(seen).astype(np.float32), seed=2)
    law = turbidock.run("pool_active", seed=end["seed"], controller=Policy, settings=settings)
    assert law.outcome == end["outcome"]
    assert law.digest == end["digest"]


def test_gymnasiums_vector_environment_runs_it_in_processes():
    def make(mode):
        return gymnasium.make_vec(
            "turbidock/Docking-v0", num_envs=3, vectorization_mode=mode,
            wrappers=[lambda env: gymnasium.wrappers.TransformReward(env, lambda reward: 2 * reward)],
            settings={**QUICK, "trial.duration_s": 3})  # control begins earlier

    ours, theirs = make("async"), make("sync")
    before, after = ours.reset(seed=7), theirs.reset(seed=7)
    np.testing.assert_equal(before, after)
    ends, twice = 0, gymnasium.make("turbidock/Docking-v0", settings={**QUICK, "trial.duration_s": 3})
    twice.reset(seed=8)
    for given in np.random.default_rng(3).uniform(-1, 1, (40, 3, 4)).astype(np.float32):
        one, other = ours.step(given), theirs.step(given)
        for got, wanted in zip(one[:4], other[:4]):
            np.testing.assert_array_equal(got, wanted)
        if not ends:
            assert one[1][1] == 2 * twice.step(given[1])[1]
        ends += int((one[2] | one[3]).sum())
    assert ends >= 3
    ours.close()
