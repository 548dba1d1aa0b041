// Any bytes as a URDF: refused, or MJCF that MuJoCo takes or refuses, whose mass is the URDF's
// where it takes it.

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "experiments/studies/check_vehicle/urdf.h"
#include "sim/base/check.h"
#include "sim/vehicle/model_files.h"
#include "tests/fuzz/input_file.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const testing::InputFile file(data, size);
  static const std::string mjcf =
      std::filesystem::temp_directory_path() / ("fuzz_urdf_" + std::to_string(getpid()) + ".xml");
  try {
    check_vehicle::IsUrdf(file.path());
    const check_vehicle::UrdfVehicle made =
        check_vehicle::ReadUrdf(file.path(), std::filesystem::path(mjcf).parent_path());
    std::ofstream(mjcf) << made.mjcf;
    const std::string models = TURBIDOCK_FUZZ_MODELS;
    const vehicle::MjModelPtr model = vehicle::ReadModel(
        {.scene = models + "/sea_active.xml", .parts = {{"vehicle.xml", mjcf}}, .shared = {}});
    const double kg = model->body_subtreemass[mj_name2id(model.get(), mjOBJ_BODY, "vehicle")];
    TD_CHECK(std::abs(kg - made.body.mass_kg) <= 1e-6 * kg, "the URDF's mass");
  } catch (const ConfigError&) {
  }
  std::filesystem::remove(mjcf);
  return 0;
}
