"""Somebody who steps a trial by its services, changes it and begins it again: hand.py FILE, where record.py writes."""

import pathlib
import sys
import time

import rclpy
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger


def call(kind, name, request):
    if name not in clients:
        clients[name] = node.create_client(kind, "/turbidock/" + name)
        clients[name].wait_for_service()
        time.sleep(0.3)  # until the service knows of the client, too
    future = clients[name].call_async(request)
    rclpy.spin_until_future_complete(node, future)
    return future.result()


def lines():
    file = pathlib.Path(sys.argv[1])
    return file.read_text().count("\n") if file.exists() else 0


rclpy.init()
node = Node("hand")
clients = {}
if pathlib.Path(sys.argv[1] + ".reset").exists():  # the nodes begin again with the trial
    print("reset", flush=True)
    call(SetBool, "pause", SetBool.Request(data=False))
    sys.exit()
before = lines()
time.sleep(1)
if before == lines() == 0:
    print("paused", flush=True)
for _ in range(40):  # past the frames without control
    call(Trigger, "step", Trigger.Request())
    time.sleep(0.05)
if 0 < lines() < 40:
    print("stepped", flush=True)
values = [("water.milk_ml_m3", ParameterValue(type=3, double_value=20.0)), ("cameras.rig.width_px", ParameterValue(type=2, integer_value=9))]
call(SetParameters, "set_parameters", SetParameters.Request(parameters=[Parameter(name=n, value=v) for n, v in values]))
call(Trigger, "step", Trigger.Request())
pathlib.Path(sys.argv[1] + ".reset").touch()
call(Trigger, "reset", Trigger.Request())  # ends this process
