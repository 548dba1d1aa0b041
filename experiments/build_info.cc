#include "experiments/build_info.h"

#include <mujoco/mujoco.h>

#include <exception>
#include <opencv2/core/version.hpp>

#include "experiments/git_hash.h"
#include "sim/gl_context.h"

namespace turbidock::experiments {

std::string VersionAndCommit() { return std::string(TURBIDOCK_VERSION) + " " + kGitHash; }

std::vector<std::pair<std::string, std::string>> BuildInfo() {
  std::string mesa;
  try {
    mesa = sim::MakeOsmesaContext()->description();
  } catch (const std::exception& error) {
    mesa = error.what();
  }
  return {{"turbidock", TURBIDOCK_VERSION},
          {"git", kGitHash},
          {"compiler", std::string(TURBIDOCK_COMPILER)},
          {"build", TURBIDOCK_BUILD_TYPE},
          {"MuJoCo", mj_versionString()},
          {"Mesa", mesa},
          {"OpenCV", CV_VERSION}};
}

}  // namespace turbidock::experiments
