#include "experiments/app/build_table.h"

#include <mujoco/mujoco.h>

#include <exception>
#include <opencv2/core/version.hpp>

#include "experiments/system/build_info.h"
#include "sim/view/gl_context.h"

namespace turbidock::app {

std::vector<std::pair<std::string, std::string>> BuildTable() {
  std::string mesa;
  try {
    mesa = view::MakeGlContext(view::GlBackend::kOsmesa)->description();
  } catch (const std::exception& error) {
    mesa = error.what();
  }
  return {{"turbidock", system::Version()},
          {"git", system::Commit()},
          {"compiler", system::Compiler()},
          {"build", system::BuildType()},
          {"MuJoCo", mj_versionString()},
          {"Mesa", mesa},
          {"OpenCV", CV_VERSION}};
}

}  // namespace turbidock::app
