"""Your ROS 2 nodes in the loop: what steers your vehicle, judged by `run`, `batch` and `gate`. The trial waits for the nodes:
results do not depend on how fast the machine is. `pip install '.[ros]'` brings ROS 2 Jazzy; nodes may come from any
installation of it.

    turbidock-ros run sea_night_active --answer wrench --launch "python3 examples/ros/controller_node.py"
    turbidock-ros run pool_active --estimator --launch "ros2 launch mine all.launch.py"
    turbidock-ros gate assets/gates/controllers.yaml --answer wrench --launch "..." --out judged
    turbidock-ros batch turbidity_sweep --out sweep.db --workers 4 --estimator --launch "..."
    turbidock-ros view pool_active --answer wrench --launch "..."      # the live page
    turbidock-ros topics                                               # the table of topics (topics.py)

It takes what `turbidock` takes, and `turbidock-ros --help`. `turbidock-ros mcap FOLDER` makes MCAP of a trial. In Python:

    turbidock.ros.use(launch="python3 my_controller.py")               # the fields of exchange.Stack
    turbidock.run("sea_night_active", seed=77, controller=turbidock.ros.WrenchController)

One frame is one exchange. A camera frame's messages all have the stamp of its exposure and come when the scenario's camera
delay has passed; a frame that the scenario drops does not come. Then the trial waits for an answer with that stamp: of the
estimator for every frame, of the controller where there is `marker/desired`, which is while the procedure lets it steer; in
other frames until each node that hears it has answered its own service get_parameters, which it does when it spins. The
order between topics is DDS's: answer once you have all that you need with one stamp. An answer to an earlier frame is passed
over. A Twist without a stamp counts for the frame that is waited for, whatever frame it was made of: only one that is sent once
a frame gives the same trial again.

Names can be remapped: `--ros-args -r wrench:=thruster_manager/input`. There is no `/tf`, and the trial's truth is in no topic of
a trial that is judged.
`--answer twist` keeps the velocity by the vehicle's known drag and `ros_twist.gain_per_s`. `marker/pose` is the estimate as it
came; with `--set ros_wrench.pose_filter.enabled=true` it is the filtered one, and `marker/axes` has its rates.

Silence: no answer in `--answer-within` seconds (`--first-answer-within` with the nodes' start), or a launch command that ended,
is the outcome `no_answer`, which counts neither as success nor as failure: a batch's next call runs it again, `run` and `gate`
end with exit code 4. Until the first answer it says once a second what it waits for, and which types and QoS do not match.
Wrong: an answer that is not finite, of no unit quaternion, another frame_id, stamp 0 or of the future; two nodes that publish
it; a domain in use. An error names it; in a batch the trial is `crashed`.

Processes: with `--launch` each worker has a ROS_DOMAIN_ID that nobody uses; all stays on the loopback address, without shared
memory (fastdds.xml, unless FASTRTPS_DEFAULT_PROFILES_FILE names another). Nodes start and end with each trial, as a process
group, also where the simulator is killed. Their output is in OUT/nodes.log, of a gate in OUT/nodes, of a batch in OUT.nodes;
their ROS_LOG_DIR goes with them, unless it is given. ROS itself makes two files lttng-ust-wait-* in /dev/shm, once a machine.
With `--reset-service` they stay, and their `reset` (std_srvs/Trigger) is called. Nodes that run already have one trial at a
time, in the environment's domain.

While a trial is under way there are the services /turbidock/pause (SetBool) and /turbidock/step (Trigger). `turbidock-ros
by-hand SCENARIO` also has /turbidock/reset (Trigger), which begins the trial again, and `ros2 param set /turbidock
water.milk_ml_m3 20.0`; it goes at most as fast as real time, unless with `--fast`.

Results of a batch are kept by `--nodes-version TEXT`: what your nodes are, only you can tell. Without it no later call goes on
with its file.
"""

from .exchange import use
from .plug_ins import ImageEstimator, ThrustsController, TwistController, VoltsController, WrenchController

__all__ = ["ImageEstimator", "ThrustsController", "TwistController", "VoltsController", "WrenchController", "use"]
