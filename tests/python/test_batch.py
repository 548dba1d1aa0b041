"""Batches and gates from Python, with laws written in it."""

import sqlite3

import pytest

import turbidock
from conftest import QUICK, CopiedController, FixedEstimator, OddController


def plan(**more):
    return {"description": "a few", "scenario": "pool_active", "seeds": 3,
            "set": {**QUICK, "trial.duration_s": 6}, **more}


def test_a_batch_is_a_frame_and_goes_on(tmp_path):
    out = str(tmp_path / "b.db")
    trials = turbidock.batch(plan(), out, workers=2)
    assert list(trials["trial"]) == [0, 1, 2]
    assert all(trials[name].dtype == float for name in trials if name.endswith("_s") and "." not in name)
    again = turbidock.batch(plan(), out, workers=2)
    assert list(again["digest"]) == list(trials["digest"])
    assert list(turbidock.read_results(out)["digest"]) == list(trials["digest"])
    for row in trials.itertuples():
        alone = turbidock.run("pool_active", seed=int(row.seed),
                              settings={**QUICK, "trial.duration_s": 6})
        assert alone.digest == row.digest


def test_what_no_trial_reads_warns_where_the_batch_is_run(tmp_path):
    given = {**QUICK, "trial.duration_s": 0.2, "control.use": "lqg", "control.pid.yaw.kp_per_s2": 2}
    with pytest.warns(UserWarning, match="control.pid.yaw.kp_per_s2 changes no trial: control.use = lqg") as said:
        turbidock.batch(plan(set=given), tmp_path / "b.db", workers=1)
    assert said[0].filename == __file__


def test_a_stored_series_has_the_rows_of_the_log(tmp_path):
    out = str(tmp_path / "b.db")
    trials = turbidock.batch(plan(series_every_frames=10), out, workers=2)
    alone = turbidock.run("pool_active", seed=int(trials["seed"][1]),
                          settings={**QUICK, "trial.duration_s": 6}).trajectory
    stored = turbidock.read_series(out, 1)
    assert len(stored) > 1
    assert stored.equals(alone[::10].reset_index(drop=True))


def test_labels_stay_as_they_are(tmp_path):
    labels = ["None", "NA", "01", "1e1", "nan"]
    cases = {label: {"cameras.delay_frames": 1 + i} for i, label in enumerate(labels)}
    trials = turbidock.batch(plan(seeds=1, cases=cases, set={**QUICK, "trial.duration_s": 0.5}), str(tmp_path / "b.db"), workers=2)
    assert list(trials["case"]) == labels
    assert trials.groupby("case").size().sum() == 5
    assert trials["time_s"].dtype.kind in "fi" and trials["insertion_time_s"].isna().all()


def test_a_batch_with_a_law_in_python(tmp_path):
    trials = turbidock.batch(plan(), str(tmp_path / "b.db"), workers=2, controller=CopiedController)
    for row in trials.itertuples():
        alone = turbidock.run("pool_active", seed=int(row.seed), controller=CopiedController,
                              settings={**QUICK, "trial.duration_s": 6})
        assert alone.digest == row.digest


def test_a_batch_goes_on_when_a_law_raises_or_hangs(tmp_path):
    trials = turbidock.batch(
        plan(seeds=1, trial_time_limit_s=5,
             grid={"control.odd_controller.does": ["nothing", "raise", "hang", "nothing again"]}),
        str(tmp_path / "b.db"), workers=2, controller=OddController)
    assert list(trials["outcome"])[1:3] == ["crashed", "hung"]
    assert trials["outcome"][0] not in ("crashed", "hung")


def test_a_batch_goes_on_when_an_estimator_raises_or_hangs(tmp_path):
    out = str(tmp_path / "b.db")
    trials = turbidock.batch(
        plan(seeds=1, trial_time_limit_s=10, set={"trial.duration_s": 0.3},
             grid={"estimator.fixed_estimator.does": ["nothing", "raise", "nan", "hang", "nothing again"]}),
        out, workers=2, estimator=FixedEstimator)
    assert list(trials["outcome"]) == ["timeout", "crashed", "crashed", "hung", "timeout"]
    with sqlite3.connect(out) as file:
        stored = "\n".join(file.iterdump())
    assert "fixed_estimator" in stored and "no such ball" in stored and "not [nan, 0, 0]" in stored


def test_silence_is_neither_success_nor_failure_and_runs_again(tmp_path, monkeypatch):
    def batch():
        return turbidock.batch(plan(seeds=1, grid={"control.odd_controller.does": ["nothing", "silent", "nothing again"]}),
                               str(tmp_path / "b.db"), workers=1, controller=OddController)

    trials = batch()
    assert list(trials["outcome"])[1] == list(trials["failure"])[1] == "no_answer"
    assert trials["reason"][1] == "no answer from the other program"
    assert trials["outcome"][0] == trials["outcome"][2] != "no_answer"  # in the same process
    with pytest.raises(turbidock.NoAnswer, match="^no answer from the other program$"):
        turbidock.run("pool_active", controller=OddController, settings={**QUICK, "control.odd_controller.does": "silent"})
    before = turbidock.read_results(tmp_path / "b.db", timing=True)["wall_time_s"]
    monkeypatch.setenv("MENDED", "1")
    assert list(batch()["outcome"]) == [trials["outcome"][0]] * 3
    after = turbidock.read_results(tmp_path / "b.db", timing=True)["wall_time_s"]
    assert list(before == after) == [True, False, True]


def test_a_batch_after_drawing(tmp_path):
    trial = turbidock.Trial("pool_active", settings={"trial.duration_s": 0.2}, images=True)
    for _ in trial:
        pass
    trials = turbidock.batch(plan(seeds=2, set={"trial.duration_s": 0.2}, trial_time_limit_s=60),
                             str(tmp_path / "b.db"), workers=2)
    assert list(trials["outcome"]) == ["timeout", "timeout"]


def test_a_gate_judges_a_law_in_python(tmp_path):
    gate = tmp_path / "gate.yaml"
    gate.write_text("""schema_version: 1
description: the pool
scenario: pool_active
set: {estimator.pose_source: true_pose}
seeds: 12
gate: {baseline: gate.baseline.yaml, margins: {success_rate: 0.5}}
""")
    turbidock.gate(str(gate), workers=2, update=True)
    assert turbidock.gate(str(gate), workers=2)["verdict"] == "pass"
    # it lets the vehicle drift
    assert turbidock.gate(str(gate), workers=2, controller=OddController)["verdict"] == "fail"
    with pytest.raises(turbidock.SimulatorFault, match="crashed"):
        turbidock.gate(str(gate), workers=2, controller=OddController, settings={"control.odd_controller.does": "raise"})
    with pytest.raises(turbidock.SimulatorFault, match="no_answer: no answer from the other program"):
        turbidock.gate(str(gate), workers=2, controller=OddController, settings={"control.odd_controller.does": "silent"})
    with pytest.raises(turbidock.SimulatorFault, match="hung"):
        turbidock.gate(str(gate), workers=2, controller=OddController, settings={"control.odd_controller.does": "hang"},
                       time_limit_s=3)


def test_a_gate_judges_an_estimator_in_python(tmp_path):
    gate = tmp_path / "gate.yaml"
    gate.write_text("""schema_version: 1
description: the pool
scenario: pool_active
set: {estimator.pose_source: true_pose}
seeds: 12
gate: {baseline: gate.baseline.yaml, margins: {success_rate: 0.5}}
""")
    turbidock.gate(str(gate), workers=2, update=True)
    seen = {"estimator.pose_source": "cameras", "trial.duration_s": 0.3}
    assert turbidock.gate(str(gate), workers=2, estimator=FixedEstimator,
                          settings=seen)["verdict"] == "fail"  # nothing docks in 0.3 s
    with pytest.raises(turbidock.SimulatorFault, match="crashed"):
        turbidock.gate(str(gate), workers=2, estimator=FixedEstimator,
                       settings={**seen, "estimator.fixed_estimator.does": "nan"})


def test_bad_plans_are_named(tmp_path):
    with pytest.raises(turbidock.ConfigError, match="did you mean seeds"):
        turbidock.batch(plan(seedz=3), str(tmp_path / "b.db"))
    with pytest.raises(ValueError, match="workers must be at least 1"):
        turbidock.batch(plan(), str(tmp_path / "b.db"), workers=-1)
