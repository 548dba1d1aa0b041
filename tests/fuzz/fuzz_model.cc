// Any bytes as a file of a scene: refused, or a scene in which the vehicle moves, or ends for a
// reason. The first byte says as which:
//
//   v the vehicle   s the whole scene   o, m, t a mesh of the vehicle (OBJ, MSH, STL)

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "sim/base/check.h"
#include "sim/vehicle/plant.h"
#include "tests/fuzz/input_file.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

namespace {

namespace fs = std::filesystem;

const std::string kModels = TURBIDOCK_FUZZ_MODELS;

// A folder of this process with the published vehicle, which has a mesh there.
struct Workshop {
  Workshop() {
    fs::create_directories(folder);
    std::ifstream in(kModels + "/vehicle.xml");
    const std::string model((std::istreambuf_iterator<char>(in)), {});
    for (const char* kind : {"obj", "msh", "stl"}) {
      std::string with = model;
      with.insert(with.find("<worldbody>"),
                  std::string("<asset><mesh name=\"fin\" file=\"fin.") + kind + "\"/></asset>");
      with.insert(with.find("<geom name=\"hull_box\""),
                  "<geom name=\"hull_fin\" type=\"mesh\" mesh=\"fin\" contype=\"0\" "
                  "conaffinity=\"0\"/>");
      std::ofstream(folder + "/" + kind + ".xml") << with;
    }
  }
  ~Workshop() { fs::remove_all(folder); }

  const std::string folder = fs::temp_directory_path() / ("fuzz_model_" + std::to_string(getpid()));
};

vehicle::SceneFiles FilesOf(char kind, const testing::InputFile& input, const uint8_t* data,
                            size_t size) {
  static const Workshop workshop;
  if (kind == 's') {
    vehicle::SceneFiles files{.scene = input.path()};
    for (const char* part : {"common", "sea", "station", "marker_active", "vehicle"})
      files.shared[part + std::string(".xml")] = kModels + "/" + part + ".xml";
    return files;
  }
  std::string vehicle = input.path();
  if (kind != 'v') {
    const std::string mesh = kind == 'o' ? "obj" : kind == 'm' ? "msh" : "stl";
    vehicle = workshop.folder + "/" + mesh + ".xml";
    std::ofstream(workshop.folder + "/fin." + mesh, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  }
  return {.scene = kModels + "/sea_active.xml", .parts = {{"vehicle.xml", vehicle}}};
}

void Fly(const vehicle::Scene& scene) {
  vehicle::Plant plant(scene, {}, {}, vehicle::Sea());
  plant.Reset(Pose::Translation(-1, 0, -1));
  for (int tick = 0; tick < 20; ++tick) {
    if (plant.Step(ThrusterCommand::Neutral(scene.thrusters.size()))) return;
    TD_CHECK(plant.truth().X_WB.IsFinite(), "a pose");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return -1;
  const testing::InputFile file(data + 1, size - 1);
  try {
    Fly(vehicle::LoadScene(FilesOf(static_cast<char>(data[0]), file, data + 1, size - 1), {}));
  } catch (const ConfigError&) {
  }
  return 0;
}
