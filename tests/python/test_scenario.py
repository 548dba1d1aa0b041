"""Scenarios and results as Python's own objects."""

import copy
import pathlib
import pickle
import re

import pytest

import turbidock
from conftest import QUICK, CopiedPid


def test_a_value_has_its_keys_type():
    s = turbidock.Scenario("pool_active")
    s.trial.duration_s = 60
    for key, kind in (("trial.duration_s", float), ("trial.seed", int), ("trial.region_of_interest", bool),
                      ("description", str), ("estimator.pose_source", str), ("estimator.true_pose.noise", tuple)):
        assert type(s[key]) is kind, key
    with pytest.raises(TypeError):
        s.estimator.true_pose.noise[0] = 1  # else it would change nothing


def test_a_text_is_not_read_as_yaml():
    s = turbidock.Scenario("pool_active")
    for text in ("a # b", "a: b", "yes", "1.0", "", " x ", "'quoted'", "über 3 °", "- x", "\"q\" \\ \n"):
        s.description = text
        assert s.description == text
        assert turbidock.Scenario("pool_active", settings={"description": text}).description == text
    s.trial.duration_s = "30"  # a number as text
    s["start.position_m"] = "[-2, 0, 0]"
    assert s.trial.duration_s == 30 and s.start.position_m == (-2, 0, 0)


def test_a_preset_that_undoes_what_was_given_warns():
    s = turbidock.Scenario("approach_5m")
    s.navigation.position_walk_m = 0.35
    with pytest.warns(UserWarning, match="also sets what was given before: .*navigation.position_walk_m"):
        s.navigation.preset = "usbl"
    with pytest.warns(UserWarning, match="navigation.preset = usbl also sets"):
        turbidock.Scenario("approach_5m", settings={"navigation.preset": "usbl"})


def test_what_is_switched_off_warns_where_it_is_set():
    with pytest.warns(UserWarning, match="water.milk_ml_m3 changes no trial: estimator.pose_source = true_pose") as said:
        s = turbidock.Scenario("pool_active", settings={"water.milk_ml_m3": 3, "estimator.pose_source": "true_pose"})
    assert said[0].filename == __file__
    with pytest.warns(UserWarning, match="control.pid.yaw.kp_per_s2 changes no trial: control.use = lqg") as said:
        s.control.pid.yaw.kp_per_s2 = 2
    assert len(said) == 1 and said[0].filename == __file__


def test_groups_are_read_as_mappings_are():
    water = turbidock.Scenario("pool_active").water
    assert "milk_ml_m3" in water and "milk" not in water
    assert list(water) == water.keys() == list(dict(water))


def test_a_seed_is_given_once():
    for settings in ({"trial.seed": 4}, {"trial": {"seed": 4}}, ["trial={seed: 4}"]):
        with pytest.raises(turbidock.ConfigError, match="give one of them"):
            turbidock.Scenario("pool_active", seed=3, settings=settings)


def test_lists_of_groups_index_and_iterate():
    s = turbidock.Scenario("pool_active")
    assert [ball.name for ball in s.marker.balls] == [s[f"marker.balls[{i}].name"] for i in range(3)]
    s.marker.balls[1].radius_m = 0.025
    assert s["marker.balls[1]"].radius_m == s["marker.balls.1.radius_m"] == 0.025
    with pytest.raises(turbidock.ConfigError, match=r"marker.balls: has no element 7, it has 3"):
        _ = s["marker.balls[7]"]


def test_a_list_of_groups_does_not_grow_unseen():
    s = turbidock.Scenario("sea_night_active")
    with pytest.raises(AttributeError):
        s.sea.waves.append({"height_m": 0.5})
    s.sea.waves = [{"height_m": 0.5}]
    s.sea.waves[0].height_m = 0.4
    assert [wave.height_m for wave in s.sea.waves] == [0.4]


def test_a_seed_is_given_once():
    with pytest.raises(turbidock.ConfigError, match="seed: is given by itself and in settings"):
        turbidock.Scenario("pool_active", seed=4, settings={"trial.seed": 3})


def test_keys_are_listed_and_shown():
    s = turbidock.Scenario("pool_active", settings={"water.milk_ml_m3": 7})
    assert {"water", "trial", "copy"} <= set(dir(s))
    assert dict(s.water)["milk_ml_m3"] == 7.0
    assert "milk_ml_m3=7.0" in repr(s.water) and "radius_m=" in repr(s.marker.balls)
    table = turbidock.keys()
    for key in table["key"][~table["key"].str.contains("[]", regex=False)]:
        s[key]  # all of them
    result = turbidock.run(s, settings={**QUICK, "trial.duration_s": 0.1})
    assert set(result.record) <= set(dir(result))
    assert type(result).outcome.__doc__ == "outcome: how the trial ended"


@pytest.mark.parametrize("of", [copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s)),
                                turbidock.Scenario.copy])
def test_a_copy_is_the_same_and_its_own(of):
    s = turbidock.Scenario("pool_active", seed=3, controller=CopiedPid,
                           settings={**QUICK, "trial.duration_s": 3, "control.copied_pid.kd_per_s": 1.5})
    other = of(s)
    assert other.to_yaml() == s.to_yaml()
    other.control.copied_pid.kd_per_s = 2
    assert s.control.copied_pid.kd_per_s == 1.5
    assert turbidock.run(of(s)).digest == turbidock.run(s).digest != turbidock.run(other).digest


def test_paths_are_paths(tmp_path):
    file = tmp_path / "own.yaml"
    file.write_text(turbidock.Scenario("pool_active", settings={**QUICK, "trial.duration_s": 0.1}).to_yaml())
    result = turbidock.run(file, seed=4)
    result.save(tmp_path / "out")
    assert (tmp_path / "out/result.json").exists()
    plan = tmp_path / "plan.yaml"
    plan.write_text(f"{{schema_version: 1, description: one, scenario: {file}, seeds: 1}}")
    turbidock.batch(plan, pathlib.Path(tmp_path / "b.db"), workers=1)
    assert len(turbidock.read_results(tmp_path / "b.db")) == 1
    assert turbidock.read_series(tmp_path / "b.db", 0).empty


def test_errors_speak_of_no_options():
    for act in (lambda: turbidock.Scenario("pool_active", settings={"water.milk": 3}),
                lambda: turbidock.Scenario("pool_active")["water.milk"],
                lambda: setattr(turbidock.Scenario("pool_active").water, "milk_ml_m3", -3),
                lambda: turbidock.run("pool_active", settings={"water.milk_ml_m3": "much"})):
        with pytest.raises(turbidock.ConfigError, match="^water.milk") as error:
            act()
        assert "--" not in str(error.value)
    with pytest.raises(AttributeError, match="^water.milk_ml_m4: unknown key; did you mean milk_ml_m3"):
        _ = turbidock.Scenario("pool_active").water.milk_ml_m4
    with pytest.raises(AttributeError, match="outcom"):
        _ = turbidock.run("pool_active", settings={**QUICK, "trial.duration_s": 0.1}).outcom


def test_a_trial_ends_with_its_block():
    with turbidock.Trial("pool_active", settings={"trial.duration_s": 1}, images=True) as trial:
        trial.step()
        left, kept = trial.images[0], trial.images[0].copy()
        assert re.fullmatch(r"<Frame 0 at 0.00 s: approach, F .*>", repr(trial.frame))
        assert repr(trial) == "<Trial, under way, steered: False>"
    assert trial.ended and (left == kept).all()
    with pytest.raises(ValueError, match="this trial is closed"):
        trial.step()
    with pytest.raises(ValueError, match="this trial is closed"):
        trial.result()


def test_the_version_is_that_of_the_program():
    assert turbidock.version().startswith(turbidock.__version__ + " ")
    assert re.fullmatch(r"\d+\.\d+\.\d+", turbidock.__version__)
