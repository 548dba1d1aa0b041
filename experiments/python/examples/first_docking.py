"""One docking, with a picture of how it went.

    python first_docking.py          # docking.png
"""

import turbidock

if __name__ == "__main__":
    result = turbidock.run("sea_night_active", seed=77, progress=True)
    print(f"\n{result}")
    print("digest", result.digest)  # that of `turbidock run` of the same build
    print(result.trajectory[["time_s", "stage", "fitness", "est_x_m", "true_x_m"]].tail())
    result.plot().savefig("docking.png")
