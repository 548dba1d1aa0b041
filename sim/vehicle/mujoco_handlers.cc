#include "sim/vehicle/mujoco_handlers.h"

#include <mujoco/mujoco.h>

#include <cstdio>
#include <cstdlib>
#include <stdexcept>

namespace turbidock::vehicle {

void InstallMujocoHandlers() {
  mju_user_warning = [](const char*) {};
  // It must not return. 4 is the program's code for a simulator fault.
  mju_user_error = [](const char* message) {
    std::fprintf(stderr, "turbidock: MuJoCo: %s\n", message);
    std::_Exit(4);
  };
}

// The exception passes through MuJoCo's C, which Debian builds with the tables that it needs.
ThrowingMujocoErrors::ThrowingMujocoErrors() {
  mju_user_error = [](const char* message) { throw std::runtime_error(message); };
}

ThrowingMujocoErrors::~ThrowingMujocoErrors() { InstallMujocoHandlers(); }

}  // namespace turbidock::vehicle
