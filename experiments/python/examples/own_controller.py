"""A controller of ten lines: one docking with a picture; with a gate's file, the gate's verdict on
the controller.

    python own_controller.py [gate.yaml]
"""

import sys

import turbidock


class MyController(turbidock.Controller):
    pose_filter = True  # gives seen.rate
    gain = turbidock.Key(60.0, 0, 1000, "newtons a metre")
    damping = turbidock.Key(30.0, 0, 1000, "newtons for a metre a second")

    def demand(self, seen, wanted):
        x, y, z, heading = seen.position - wanted.position
        vx, vy, vz, turning = seen.rate
        surge = min(self.gain * x + self.damping * vx, 2.0)  # slow enough to stop
        return [surge, self.gain * y + self.damping * vy, self.gain * z + self.damping * vz,
                0.4 * heading + 0.2 * turning]


if __name__ == "__main__":
    result = turbidock.run("sea_night_active", seed=77, controller=MyController, progress=True)
    print(f"\n{result}")
    result.plot().savefig("my_controller.png")
    if len(sys.argv) > 1:
        print(turbidock.gate(sys.argv[1], controller=MyController, progress=True)["verdict"])
