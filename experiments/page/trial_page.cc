#include "experiments/page/trial_page.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <utility>

#include "experiments/page/trial_model.h"
#include "experiments/report/quantity.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial.h"

namespace turbidock::page {
namespace {

namespace fs = std::filesystem;
using report::Json;

// Key frames, "cameras/000090_left.jpg" beside "000090_right.jpg": of frame 90.
Json PicturesIn(const fs::path& folder, const trial::Scenario& scenario) {
  std::map<int, Json> pictures;  // by frame
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string(), number = name.substr(0, 6);
    const fs::path right = folder / (number + "_right.jpg");
    if (!name.ends_with("_left.jpg") || !fs::exists(right) ||
        number.find_first_not_of("0123456789") != std::string::npos)
      continue;
    const int frame = std::stoi(number);
    pictures[frame] = {{"time_s", Rounded(scenario.clock.TimeOfFrame(frame))},
                       {"left", Base64(system::ReadWhole(entry.path()))},
                       {"right", Base64(system::ReadWhole(right))}};
  }
  Json list = Json::array();
  for (auto& [frame, picture] : pictures) list.push_back(std::move(picture));
  return list;
}

// Names and units of a record's figures by their dotted keys.
Json NamesIn(const Json& record, const std::string& path = "") {
  Json names = Json::object();
  const report::Quantity group = report::QuantityOf(path);
  for (const auto& [key, value] : record.items()) {
    const std::string name = JoinKey(path, key);
    report::Quantity of = report::QuantityOf(key);
    if (!path.empty()) of.label = group.label + ", " + of.label;
    if (of.unit.empty()) of.unit = group.unit;  // stage_time_s.docking
    names[name] = of;
    if (value.is_object()) names.update(NamesIn(value, name));
  }
  return names;
}

}  // namespace

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
  Page page;
  page.model = TrialModel(scenario);
  page.model.update(
      {{"record", record},
       {"names", NamesIn(record)},
       {"build", record.value("version", "")},
       {"series", Rounded(trial::Series::FromCsv(system::ReadWhole(trajectory), trajectory))},
       {"frames", PicturesIn(in / "cameras", scenario)},
       {"commands",
        {{{"what", "The same trial again, filmed"},
          {"command", fmt::format("turbidock run {} --out again --video", resolved)}}}}});
  if (fs::is_regular_file(video, none)) page.files["video"] = system::ReadWhole(video);
  page.has_3d = !page.model["scene"].is_null();
  return page;
}

}  // namespace turbidock::page
