"""What a trial and the user's nodes say to each other: the one table of topics.
`turbidock-ros topics` prints it.

Frames are those of REP 103 and 105: x forward, y left, z up; of a camera that ends in `_optical`: x right, y down, z ahead.
Units are SI. Every message of a frame has the stamp of that frame's one exposure; trials begin at START_S, so that no stamp
is zero."""

from __future__ import annotations

from dataclasses import dataclass

START_S = 10  # ROS time at the trial's beginning
BASE, HEAD, MARKER, WORLD = "base_link", "camera_head", "marker", "map"
LEFT, RIGHT = "left_camera_optical", "right_camera_optical"


@dataclass(frozen=True)
class Topic:
    """A topic: its name, which can be remapped, and all that is to be known of it."""

    name: str
    type: str  # package/Name
    frame: str  # header.frame_id
    doc: str
    answer: bool = False  # from the user's nodes


CLOCK = Topic("/clock", "rosgraph_msgs/Clock", "", "now: the exposure plus the scenario's camera delay")
IMAGES = (
    Topic("left/image_raw", "sensor_msgs/Image", LEFT, "rgb8, as the estimator gets it, without distortion"),
    Topic("right/image_raw", "sensor_msgs/Image", RIGHT, "the same"),
    Topic("left/camera_info", "sensor_msgs/CameraInfo", LEFT, "K, and P of the rectified pair; pixels"),
    Topic("right/camera_info", "sensor_msgs/CameraInfo", RIGHT, "P[3] is -fx times the baseline"))
POSE = Topic("marker/pose", "geometry_msgs/PoseWithCovarianceStamped", HEAD,
             "estimate of the marker: x, y, z and heading; covariance 0 where none is claimed; m, rad")
SEEN = Topic("marker/axes", "sensor_msgs/JointState", HEAD,
             "the same exactly: position of x, y, z, heading, velocity with a pose filter; m, rad, m/s, rad/s")
QUALITY = Topic("marker/quality", "sensor_msgs/JointState", "",
                "position[0] is F (`fitness`). As the poses it comes of a frame whose estimate is acted on (`detected`)")
IMU = Topic("imu", "sensor_msgs/Imu", BASE, "roll, pitch and their rates, as measured; heading and acceleration are unknown")
NAVIGATION = Topic("navigation", "nav_msgs/Odometry", MARKER,
                   "of camera_head: z, heading and, with a fix, x and y; variance 1e6 without. Where the scenario has it")
WANTED = Topic("marker/desired_axes", "trajectory_msgs/JointTrajectory", HEAD,
               "the next one exactly, with velocities and accelerations; m, rad, m/s, rad/s, m/s^2, rad/s^2")
DESIRED = Topic("marker/desired", "geometry_msgs/PoseStamped", HEAD,
                "where the procedure wants the marker. Sent last, and while the controller is in charge: answer it")
APPLIED = Topic("applied", "sensor_msgs/JointState", BASE,
                "effort: what the vehicle could give of the frame's demand: surge, sway, heave, yaw; N, N m")

ESTIMATE = Topic("estimate", "geometry_msgs/PoseWithCovarianceStamped", f"{HEAD} or {LEFT}",
                 "of the marker; covariance[0] = -1: not seen", True)
WRENCH = Topic("wrench", "geometry_msgs/WrenchStamped", BASE, "force and torque.z; N, N m: --answer wrench", True)
VELOCITY = Topic("cmd_vel", "geometry_msgs/TwistStamped", BASE,
                 "linear x, y, z and angular z; m/s, rad/s, through the water: --answer twist", True)
UNSTAMPED = Topic("cmd_vel_unstamped", "geometry_msgs/Twist", "",
                  "the same without a stamp: counted for the frame that is waited for", True)
THRUSTS = Topic("thrusts", "sensor_msgs/JointState", BASE,
                "effort of each thruster, by its name in the vehicle's model; N, as far as it has it: --answer thrusts", True)
VOLTS = Topic("volts", "sensor_msgs/JointState", BASE,
              "the same; V, 0 to 5, neutral 2.5, as they are: --answer volts", True)

TRUTH = (
    Topic("truth/marker", "geometry_msgs/PoseStamped", HEAD, "where the marker is now: by-hand --truth only, to look at"),
    Topic("truth/vehicle", "geometry_msgs/PoseStamped", WORLD, "where base_link is now: the same"))
CONTROLLER = (APPLIED, POSE, SEEN, QUALITY, IMU, NAVIGATION, WANTED, DESIRED)
ANSWERS = {"wrench": (WRENCH,), "twist": (VELOCITY, UNSTAMPED), "thrusts": (THRUSTS,), "volts": (VOLTS,)}
AXES = ("surge", "sway", "heave", "yaw")
PLACE = ("x", "y", "z", "heading")

ALL = (CLOCK, *IMAGES, *CONTROLLER, ESTIMATE, WRENCH, VELOCITY, UNSTAMPED, THRUSTS, VOLTS, *TRUTH)


def as_markdown() -> str:
    """The table of all topics. Reliable, volatile, the last ten: QoS of all."""
    rows = ["| Topic | Type | frame_id | |", "|---|---|---|---|"]
    for answers, title in ((False, "**To your nodes**"), (True, "**From your nodes**")):
        rows.append(f"| {title} | | | |")
        rows += [f"| `{t.name}` | {t.type} | {t.frame} | {t.doc} |" for t in ALL if t.answer is answers]
    return "\n".join(rows) + "\n"
