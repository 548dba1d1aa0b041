"""What Python costs: stepped trials beside turbidock.run.

    python speed.py [rounds]      # rows of assets/measured/speed_python.csv

Of several rounds in turn it takes the median of the ratios of processor time, which another job on
the machine disturbs least.
"""

import statistics
import sys
import time

import turbidock

SCENARIO = "sea_night_active"
TRUE_POSE = {"estimator.pose_source": "true_pose", "trial.duration_s": 30, "procedure.give_up_s": 100}
CAMERAS = {"trial.duration_s": 1.5}


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


def main():
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 25
    pairs = [("true pose, stepped", step, run, TRUE_POSE, TRUE_POSE),
             ("true pose, stepped, every frame looked at", step_and_look, run, TRUE_POSE,
              TRUE_POSE),
             ("cameras, stepped", step, run, CAMERAS, CAMERAS),
             ("cameras, stepped, images handed out, beside a run that makes them in parts", step_with_images, run,
              CAMERAS, CAMERAS),
             ("cameras, stepped, images handed out", step_with_images, run, CAMERAS,
              {**CAMERAS, "trial.region_of_interest": False})]
    print("what,ratio")
    for name, ours, theirs, our_settings, their_settings in pairs:
        ours(our_settings), theirs(their_settings)  # warm
        ratios = [processor_s(ours, our_settings) / processor_s(theirs, their_settings)
                  for _ in range(rounds)]
        print(f'"{name}: time, of run\'s",{statistics.median(ratios):.2f}', flush=True)


if __name__ == "__main__":
    main()
