#include "sim/vehicle/mujoco_handlers.h"

#include <mujoco/mujoco.h>

#include <cstdio>
#include <cstdlib>

namespace turbidock::vehicle {

void InstallMujocoHandlers() {
  mju_user_warning = [](const char*) {};
  // It must not return, and must not throw through C. 4 is the program's code for a simulator
  // fault.
  mju_user_error = [](const char* message) {
    std::fprintf(stderr, "turbidock: MuJoCo: %s\n", message);
    std::_Exit(4);
  };
}

}  // namespace turbidock::vehicle
