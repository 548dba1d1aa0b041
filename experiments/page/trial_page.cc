#include "experiments/page/trial_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "experiments/page/compress.h"
#include "experiments/page/trial_model.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/scenario.h"

namespace turbidock::page {
namespace {

namespace fs = std::filesystem;
using report::Json;

// Key frames, "cameras/000090_left.jpg" beside "000090_right.jpg": of frame 90.
Json FramesIn(const fs::path& folder, double frames_per_second) {
  std::vector<std::string> numbers;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with("_left.jpg") && fs::exists(folder / (name.substr(0, 6) + "_right.jpg")))
      numbers.push_back(name.substr(0, 6));
  }
  std::sort(numbers.begin(), numbers.end());
  Json frames = Json::array();
  for (const std::string& number : numbers) {
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    const auto picture = [&](const char* side) {
      return Base64(system::ReadWhole(folder / (number + side)));
    };
    frames.push_back({{"time_s", Rounded(std::stoi(number) / frames_per_second)},
                      {"left", picture("_left.jpg")},
                      {"right", picture("_right.jpg")}});
  }
  return frames;
}

}  // namespace

Page TrialPage(const std::string& folder, const trial::Plugins& plugins) {
  const fs::path in(folder);
  std::error_code none;
  if (!fs::is_directory(in, none)) throw ConfigError(folder + ": no such folder");
  for (const char* name : {"result.json", "resolved.yaml", "trajectory.csv"})
    if (!fs::is_regular_file(in / name, none))
      throw ConfigError(fmt::format("{}: is no trial's folder: it has no {}", folder, name));
  Page page;
  page.model = TrialModel(trial::ParseScenario(system::ReadWhole(in / "resolved.yaml"),
                                               (in / "resolved.yaml").string(), plugins));
  Json& model = page.model;
  model["record"] =
      report::ParseJson(system::ReadWhole(in / "result.json"), (in / "result.json").string());
  if (!model["record"].is_object() || !model["record"].contains("outcome"))
    throw ConfigError((in / "result.json").string() + ": is no trial's result");
  model["build"] = model["record"].value("version", "");
  model["series"] = SeriesModel(trial::Series::FromCsv(system::ReadWhole(in / "trajectory.csv"),
                                                       (in / "trajectory.csv").string()));
  model["frames"] = FramesIn(in / "cameras", model["frames_per_second"].get<double>());
  if (fs::is_regular_file(in / "video.mp4", none))
    page.files["video"] = system::ReadWhole(in / "video.mp4");
  model["commands"] = {{{"what", "The same trial again, filmed"},
                        {"command", fmt::format("turbidock run {} --out again --video",
                                                (in / "resolved.yaml").string())}}};
  page.has_3d = !model["scene"].is_null();
  return page;
}

}  // namespace turbidock::page
