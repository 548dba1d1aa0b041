#include "experiments/page/trial_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "experiments/page/trial_model.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/trial_files.h"

namespace turbidock::page {
namespace {

namespace fs = std::filesystem;
using report::Json;

// Key frames, "cameras/000090_left.jpg" beside "000090_right.jpg": of frame 90.
std::vector<CameraPictures> PicturesIn(const fs::path& folder) {
  std::vector<CameraPictures> pictures;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string(), number = name.substr(0, 6);
    const fs::path right = folder / (number + "_right.jpg");
    if (!name.ends_with("_left.jpg") || !fs::exists(right) ||
        number.find_first_not_of("0123456789") != std::string::npos)
      continue;
    pictures.push_back(
        {std::stoi(number), {system::ReadWhole(entry.path()), system::ReadWhole(right)}});
  }
  std::ranges::sort(pictures, {}, &CameraPictures::frame);
  return pictures;
}

}  // namespace

Page TrialPage(const trial::Scenario& scenario, const TrialParts& parts) {
  Page page;
  Json& model = page.model;
  model = TrialModel(scenario);
  model["record"] = parts.record;
  model["build"] = parts.record.value("version", "");
  model["series"] = SeriesModel(parts.series);
  model["frames"] = Json::array();
  for (const auto& [frame, jpeg] : parts.pictures)
    model["frames"].push_back({{"time_s", Rounded(scenario.clock.TimeOfFrame(frame))},
                               {"left", Base64(jpeg.left)},
                               {"right", Base64(jpeg.right)}});
  if (!parts.video.empty()) page.files["video"] = parts.video;
  model["commands"] = parts.commands;
  page.has_3d = !model["scene"].is_null();
  return page;
}

Json CommandsOf(const std::string& folder) {
  return {{{"what", "The same trial again, filmed"},
           {"command", fmt::format("turbidock run {} --out again --video",
                                   (fs::path(folder) / "resolved.yaml").string())}}};
}

Page TrialPage(const std::string& folder, const trial::Plugins& plugins) {
  const fs::path in(folder);
  std::error_code none;
  if (!fs::is_directory(in, none)) throw ConfigError(folder + ": no such folder");
  for (const std::string& name : trial::kRecordFiles)
    if (!fs::is_regular_file(in / name, none))
      throw ConfigError(fmt::format("{}: is no trial's folder: it has no {}", folder, name));
  const std::string result = (in / "result.json").string(),
                    trajectory = (in / "trajectory.csv").string(),
                    resolved = (in / "resolved.yaml").string(), video = (in / "video.mp4").string();
  const trial::Scenario scenario =
      trial::ParseScenario(system::ReadWhole(resolved), resolved, plugins);
  const Json record = report::ParseJson(system::ReadWhole(result), result);
  if (!record.is_object() || !record.contains("outcome"))
    throw ConfigError(result + ": is no trial's result");
  return TrialPage(scenario,
                   {.record = record,
                    .series = trial::Series::FromCsv(system::ReadWhole(trajectory), trajectory),
                    .pictures = PicturesIn(in / "cameras"),
                    .video = fs::is_regular_file(video, none) ? system::ReadWhole(video) : "",
                    .commands = CommandsOf(folder)});
}

}  // namespace turbidock::page
