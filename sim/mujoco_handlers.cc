#include "sim/mujoco_handlers.h"

#include <mujoco/mujoco.h>

#include <cstdio>
#include <cstdlib>

namespace turbidock::sim {

void InstallMujocoHandlers() {
  mju_user_warning = [](const char*) {};
  // It must not return, and must not throw through C.
  mju_user_error = [](const char* message) {
    std::fprintf(stderr, "turbidock: MuJoCo: %s\n", message);
    std::abort();
  };
}

}  // namespace turbidock::sim
