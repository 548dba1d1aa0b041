#include "experiments/build_info.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>
#include <xxhash.h>

#include <exception>
#include <fstream>
#include <iterator>
#include <opencv2/core/version.hpp>
#include <string_view>

#include "experiments/git_hash.h"
#include "sim/gl_context.h"

namespace turbidock::experiments {

std::string VersionAndCommit() { return std::string(TURBIDOCK_VERSION) + " " + kGitHash; }

std::string BuildId() {
  const std::string id = VersionAndCommit();
  const std::string_view hash = kGitHash;
  if (!hash.ends_with("-dirty") && hash != "unknown") return id;
  std::ifstream file("/proc/self/exe", std::ios::binary);
  const std::string program(std::istreambuf_iterator<char>(file), {});
  return fmt::format("{} {:016x}", id, XXH64(program.data(), program.size(), 0));
}

std::vector<std::pair<std::string, std::string>> BuildInfo() {
  std::string mesa;
  try {
    mesa = sim::MakeGlContext(sim::GlBackend::kOsmesa)->description();
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
