#include "experiments/studies/bench/instructions.h"

#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>
#include <utility>

#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/system/subprocess.h"
#include "sim/base/check.h"

namespace turbidock::bench {
namespace {

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

// What is counted, after the column's name.
const std::map<std::string, Weights> kInstructions = {{"", {{"Ir", 1}}}};
// Lines of 64 bytes that are fetched and written back.
const std::map<std::string, Weights> kTraffic = {
    {", accesses", {{"Dr", 1}, {"Dw", 1}}},
    {", bytes",
     {{"ILmr", 64}, {"DLmr", 64}, {"DLmw", 64}, {"ILdmr", 64}, {"DLdmr", 64}, {"DLdmw", 64}}}};
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

double NumberAt(std::string_view line, size_t begin) {
  double number = 0;
  const auto [end, error] = std::from_chars(line.data() + begin, line.data() + line.size(), number);
  if (error != std::errc()) throw ConfigError(fmt::format("\"{}\" ends in no number", line));
  return number;
}

// Of a line's numbers, one for each event and none for zeros at the end.
double Cost(std::string_view numbers, const std::vector<double>& weights) {
  std::istringstream stream{std::string(numbers)};
  double cost = 0, number = 0;
  for (const double weight : weights)
    if (stream >> number) cost += weight * number;
  return cost;
}

// callgrind's files of a trial's last frames, one after the other.
std::string CountTrial(const std::vector<std::string>& run, bool traffic) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("turbidock-{}.callgrind", getpid());
  std::filesystem::create_directories(folder);
  std::vector<std::string> command = {"valgrind", "--tool=callgrind",
                                      fmt::format("--dump-before={}", kOnceAFrame),
                                      "--callgrind-out-file=" + (folder / "part").string()};
  if (traffic)  // a core's own caches of a common size
    for (const char* argument : {"--cache-sim=yes", "--simulate-wb=yes", "--I1=32768,8,64",
                                 "--D1=32768,8,64", "--LL=2097152,16,64"})
      command.push_back(argument);
  command.push_back(std::filesystem::read_symlink("/proc/self/exe").string());
  command.push_back("run");
  command.insert(command.end(), run.begin(), run.end());
  for (const std::string& argument :
       {std::string("--quiet"), std::string("--seed"), std::string("5"), std::string("--set"),
        fmt::format("trial.duration_s={}", kDuration_s)})
    command.push_back(argument);
  system::Subprocess(command, "valgrind").Finish();
  // part.N ends at the N-th call; what comes after the last one is in `part`
  int calls = 0;
  const auto part = [&](int number) { return folder / fmt::format("part.{}", number); };
  while (std::filesystem::exists(part(calls + 1))) ++calls;
  TD_CHECK(calls >= kFrames, "callgrind saw too few frames");
  std::string frames;
  for (int number = calls - kFrames + 1; number <= calls; ++number)
    frames += system::ReadWhole(part(number));
  std::filesystem::remove_all(folder);
  return frames;
}

std::vector<std::string> Cells(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (const char c : line)
    if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      cells.emplace_back();
    else
      cells.back() += c;
  return cells;
}

}  // namespace

Stages CountStages(const std::string& callgrind_text, const Weights& weights) {
  Stages stages;
  std::vector<double> of_event;
  std::map<std::string, std::string> names;
  std::string_view caller, callee;
  bool call = false;  // the next line has the cost of one
  std::istringstream lines(callgrind_text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("events: ")) {
      std::istringstream events(line.substr(8));
      for (std::string event; events >> event;)
        of_event.push_back(weights.contains(event) ? weights.at(event) : 0);
    } else if (line.starts_with("fn=")) {
      caller = Named(line, &names);
    } else if (line.starts_with("cfn=")) {
      callee = Named(line, &names);
    } else if (line.starts_with("calls=")) {
      call = true;
    } else if (line.starts_with("totals: ")) {
      stages["frame"] += Cost(line.substr(8), of_event);
    } else if (std::exchange(call, false)) {
      const char* stage = StageOf(callee);
      const char* within = StageOf(caller);
      if (stage != nullptr && stage != within)
        stages[stage] += Cost(line.substr(line.find(' ') + 1), of_event);
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

Instructions CountInstructions(bool traffic) {
  Instructions counted;
  CountTrial(kRuns.begin()->second, false);  // fills Mesa's cache of shaders
  for (const auto& [column, run] : kRuns) {
    const std::string frames = CountTrial(run, traffic);
    for (const auto& [what, weights] : traffic ? kTraffic : kInstructions)
      for (const auto& [stage, number] : CountStages(frames, weights))
        counted[column + what][stage] = number / kFrames;
  }
  return counted;
}

Instructions ReadInstructions(const std::string& path) {
  Instructions table;
  std::vector<std::string> heads;
  std::ifstream file(path);
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.starts_with('#')) continue;
    const std::vector<std::string> cells = Cells(line);
    if (heads.empty()) {
      heads = cells;
      continue;
    }
    if (cells.size() != heads.size())
      throw ConfigError(
          "", fmt::format("{}:{}: {} cells, must be {}", path, number, cells.size(), heads.size()));
    for (size_t i = 1; i < cells.size(); ++i)
      table[heads[i]][cells[0]] = 1e6 * NumberAt(cells[i], 0);
  }
  if (table.empty()) throw ConfigError(path + ": no table of instructions");
  return table;
}

void WriteInstructions(const std::string& path, const Instructions& instructions) {
  std::string text, line;
  std::ifstream file(path);
  while (std::getline(file, line) && line.starts_with('#')) text.append(line).append("\n");
  text += fmt::format("\"{}\"", Cells(line)[0]);
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
      const auto of_column = table.find(column);
      if (of_column == table.end() || !of_column->second.contains(stage)) continue;
      const double least = of_column->second.at("frame") / 100;
      if (number > (1 + kAllowedGrowth) * std::max(of_column->second.at(stage), least))
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
      const double number = stages.at(stage);
      const auto known = table.find(column);
      const double before =
          known != table.end() && known->second.contains(stage) ? known->second.at(stage) : 0;
      cells.emplace_back(report::Fixed(number / 1e6, 2));
      cells.emplace_back(before > 0 ? report::Fixed(before / 1e6, 2) : "-");
      cells.emplace_back(before > 0 ? report::Fixed(number / before, 3) : "-");
    }
    rows.Row(std::move(cells));
  }
  const std::vector<std::string> grown = Grown(now, table);
  return {.kind = "instructions",
          .title = "What a frame takes",
          .build = system::VersionAndCommit(),
          .facts = {{"more than 5 % above the table",
                     grown.empty() ? "nothing" : fmt::format("{}", fmt::join(grown, ", ")), ""}},
          .sections = {{.title = "Millions a frame, by stage", .table = rows}}};
}

}  // namespace turbidock::bench
