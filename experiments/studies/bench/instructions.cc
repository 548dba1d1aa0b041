#include "experiments/studies/bench/instructions.h"

#include <fmt/chrono.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <ctime>
#include <filesystem>
#include <sstream>
#include <string_view>
#include <utility>

#include "experiments/report/table.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/system/subprocess.h"
#include "sim/base/check.h"

namespace turbidock::bench {
namespace {

namespace fs = std::filesystem;

using Stages = std::map<std::string, double>;

// The functions that make up a stage, with all that they call.
constexpr std::pair<const char*, const char*> kFunctions[] = {
    {"render", "turbidock::view::StereoRenderer::Render("},
    {"water", "turbidock::light::Water::Prepare("},
    {"water", "turbidock::light::Water::PaintRows("},
    {"water", "turbidock::light::MarineSnow::Fall("},
    {"water", "turbidock::light::MarineSnow::PaintRows("},
    {"sensor", "turbidock::camera::ImageSensor::DigitiseRegion("},
    {"labels", "turbidock::vision::HueLabeller::Label("},
    {"estimate", "turbidock::vision::RmGa::Update("},
    {"control", "turbidock::control::Autopilot::Update("},
    {"physics", "turbidock::vehicle::Plant::Step["}};

// Light from the balls with the region of interest and without, and light from the lamps.
const std::map<std::string, std::vector<std::string>> kRuns = {
    {"active, region", {"sea_night_active"}},
    {"active, whole", {"sea_night_active", "--set", "trial.region_of_interest=false"}},
    {"passive, whole", {"paper_sea_night_passive", "--set", "trial.region_of_interest=false"}}};

constexpr double kDuration_s = 0.7;  // 21 frames
// The last of them are counted, from one call of this function to the next.
constexpr int kFrames = 15;
constexpr const char* kOnceAFrame = "turbidock::control::Autopilot::Update(*";

const char* StageOf(std::string_view function) {
  for (const auto& [stage, name] : kFunctions)
    if (function.starts_with(name)) return stage;
  return nullptr;
}

// "fn=(12) name" names function 12, "fn=(12)" means it.
std::string_view Named(std::string_view line, std::map<std::string, std::string>* names) {
  const size_t begin = line.find('('), end = line.find(')');
  std::string& name = (*names)[std::string(line.substr(begin, end - begin))];
  if (end + 2 < line.size()) name = line.substr(end + 2);
  return name;
}

// Of a line of callgrind's, whose last word it is.
double CostIn(std::string_view line) {
  const size_t begin = line.rfind(' ') + 1;
  double number = 0;
  const auto [end, error] = std::from_chars(line.data() + begin, line.data() + line.size(), number);
  if (error != std::errc())
    throw ConfigError("", fmt::format("callgrind's \"{}\" ends in no number", line));
  return number;
}

// A folder as long as it is looked at.
struct Scratch {
  fs::path path = fs::temp_directory_path() / fmt::format("turbidock-{}.callgrind", getpid());

  Scratch() { fs::create_directories(path); }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
};

// callgrind's files of a trial's last frames, one after the other; nothing when stopped.
std::optional<std::string> CountTrial(const std::vector<std::string>& run,
                                      const std::function<bool()>& stop) {
  const Scratch folder;
  std::vector<std::string> command = {"valgrind",
                                      "--tool=callgrind",
                                      fmt::format("--dump-before={}", kOnceAFrame),
                                      "--callgrind-out-file=" + (folder.path / "part").string(),
                                      fs::read_symlink("/proc/self/exe").string(),
                                      "run"};
  command.insert(command.end(), run.begin(), run.end());
  for (const std::string& argument :
       {std::string("--quiet"), std::string("--seed"), std::string("5"), std::string("--set"),
        fmt::format("trial.duration_s={}", kDuration_s)})
    command.push_back(argument);
  if (!system::Subprocess(command, "valgrind").FinishUnless(stop)) return std::nullopt;
  // part.N ends at the N-th call; what comes after the last one is in `part`
  int calls = 0;
  const auto part = [&](int number) { return folder.path / fmt::format("part.{}", number); };
  while (fs::exists(part(calls + 1))) ++calls;
  TD_CHECK(calls >= kFrames, "callgrind saw too few frames");
  std::string frames;
  for (int number = calls - kFrames + 1; number <= calls; ++number)
    frames += system::ReadWhole(part(number));
  return frames;
}

std::vector<std::string> Cells(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (const char c : line)
    if (c == '\r')
      continue;
    else if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      cells.emplace_back();
    else
      cells.back() += c;
  return cells;
}

}  // namespace

Stages CountStages(const std::string& callgrind_text) {
  Stages stages;
  std::map<std::string, std::string> names;
  std::string_view caller, callee;
  bool call = false;  // the next line has the cost of one
  std::istringstream lines(callgrind_text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("fn=")) {
      caller = Named(line, &names);
    } else if (line.starts_with("cfn=")) {
      callee = Named(line, &names);
    } else if (line.starts_with("calls=")) {
      call = true;
    } else if (line.starts_with("totals: ")) {
      stages["frame"] += CostIn(line);
    } else if (std::exchange(call, false)) {
      const char* stage = StageOf(callee);
      const char* within = StageOf(caller);
      if (stage != nullptr && stage != within) stages[stage] += CostIn(line);
    }
  }
  for (const auto& [stage, function] : kFunctions)
    if (!stages.contains(stage))
      throw ConfigError("",
                        fmt::format("callgrind saw no {}: was the program stripped?", function));
  stages["estimate"] -= stages["labels"];
  stages["rest"] = stages["frame"];
  for (const char* stage :
       {"render", "water", "sensor", "labels", "estimate", "control", "physics"})
    stages["rest"] -= stages[stage];
  return stages;
}

std::optional<Instructions> CountInstructions(const std::function<void(int done, int of)>& on_trial,
                                              const std::function<bool()>& stop) {
  Instructions counted;
  const int trials = 1 + static_cast<int>(kRuns.size());
  // fills Mesa's cache of shaders
  if (!CountTrial(kRuns.begin()->second, stop)) return std::nullopt;
  for (const auto& [column, run] : kRuns) {
    on_trial(1 + static_cast<int>(counted.size()), trials);
    const std::optional<std::string> frames = CountTrial(run, stop);
    if (!frames) return std::nullopt;
    for (const auto& [stage, number] : CountStages(*frames))
      counted[column][stage] = number / kFrames;
  }
  return counted;
}

Instructions ReadInstructions(const std::string& path) {
  Instructions table;
  std::vector<std::string> heads;
  std::istringstream file(system::ReadWhole(path));
  int number = 0;
  const auto fail = [&](const std::string& why) {
    throw ConfigError(fmt::format("{}:{}: {}", path, number, why));
  };
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.starts_with('#')) continue;
    const std::vector<std::string> cells = Cells(line);
    if (heads.empty()) {
      heads = cells;
      for (size_t i = 1; i < heads.size(); ++i)
        if (!kRuns.contains(heads[i])) fail("no column of such a table: " + heads[i]);
      if (heads.size() != kRuns.size() + 1) fail("its columns must be those that --update writes");
      continue;
    }
    if (cells.size() != heads.size())
      fail(fmt::format("{} cells, must be {}", cells.size(), heads.size()));
    if (std::ranges::count(kCountedStages, cells[0]) == 0) fail("no stage: " + cells[0]);
    for (size_t i = 1; i < cells.size(); ++i) {
      const std::optional<double> millions = report::NumberIn(cells[i]);
      if (!millions || !(*millions >= 0)) fail("no number of instructions: " + cells[i]);
      table[heads[i]][cells[0]] = 1e6 * *millions;
    }
  }
  for (const char* stage : kCountedStages)
    if (table.empty() || !table.begin()->second.contains(stage))
      fail(fmt::format("has no row {}; --update writes such a table", stage));
  return table;
}

void WriteInstructions(const std::string& path, const Instructions& instructions) {
  std::string text = "# title: Instructions of a frame by stage\n";
  if (fs::exists(path)) {
    text.clear();
    std::istringstream file(system::ReadWhole(path));
    for (std::string line; std::getline(file, line) && line.starts_with('#');)
      if (!line.starts_with("# date:")) text += line + "\n";
  }
  const std::time_t now = std::time(nullptr);
  text += fmt::format("# date: {:%Y-%m-%d}\n", fmt::localtime(now));
  text += "\"millions of instructions a frame\"";
  for (const auto& [column, stages] : instructions) text += fmt::format(",\"{}\"", column);
  text += "\n";
  for (const char* stage : kCountedStages) {
    text += stage;
    for (const auto& [column, stages] : instructions)
      text += fmt::format(",{:.3f}", stages.at(stage) / 1e6);
    text += "\n";
  }
  system::WriteWhole(path, text);
}

std::vector<std::string> Grown(const Instructions& now, const Instructions& table) {
  std::vector<std::string> grown;
  for (const auto& [column, stages] : now)
    for (const auto& [stage, number] : stages) {
      const Stages& before = table.at(column);
      if (number > (1 + kAllowedGrowth) * std::max(before.at(stage), before.at("frame") / 100))
        grown.push_back(fmt::format("{}: {}", column, stage));
    }
  return grown;
}

report::Report ReportOf(const Instructions& now, const Instructions& table) {
  std::vector<std::string> heads = {"<"};
  for (const auto& [column, stages] : now)
    for (const std::string& head : {column, std::string("table"), std::string("ratio")})
      heads.push_back(head);
  report::Table rows(heads);
  for (const char* stage : kCountedStages) {
    std::vector<report::Cell> cells = {stage};
    for (const auto& [column, stages] : now) {
      const double number = stages.at(stage), before = table.at(column).at(stage);
      cells.emplace_back(report::Fixed(number / 1e6, 2));
      cells.emplace_back(report::Fixed(before / 1e6, 2));
      cells.emplace_back(before > 0 ? report::Fixed(number / before, 3) : "-");
    }
    rows.Row(std::move(cells));
  }
  const std::vector<std::string> grown = Grown(now, table);
  return {.kind = "instructions",
          .title = "What a frame takes",
          .build = system::VersionAndCommit(),
          .facts = {{"more than 5 % above the table",
                     grown.empty() ? "nothing" : fmt::format("{}", fmt::join(grown, ", ")),
                     "what is less than 1 % of a frame counts as 1 %"}},
          .sections = {{.title = "Millions of instructions a frame, by stage", .table = rows}}};
}

}  // namespace turbidock::bench
