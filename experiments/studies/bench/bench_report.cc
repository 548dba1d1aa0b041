#include <fmt/format.h>

#include "experiments/studies/bench/bench.h"
#include "experiments/system/build_info.h"

namespace turbidock::bench {
namespace {

using report::Fixed;
using report::Json;

// All scenarios as one workload.
Repeats Together(const std::vector<BenchResult>& results) {
  Repeats all(results.front().repeats.size());
  for (const BenchResult& one : results)
    for (size_t repeat = 0; repeat < all.size(); ++repeat)
      all[repeat].insert(all[repeat].end(), one.repeats[repeat].begin(), one.repeats[repeat].end());
  return all;
}

Json ToJson(const Repeats& repeats) {
  const Times times = TimesOf(repeats);
  Json stages = Json::object();
  for (const auto& [stage, name] : EnumNames<LoopStage>::kNames)
    stages[name] = times.MsOf(times.stages_s[static_cast<size_t>(stage)]);
  return {{"frame_ms", times.MsOf(times.frame_s())},
          {"bare_render_ms", times.MsOf(times.bare_s)},
          {"ratio_to_bare_render", times.ratio_to_bare_render()},
          {"ratio_quartiles", times.ratio_quartiles},
          {"stages_ms", stages},
          {"real_time_factor", times.real_time_factor()},
          {"evaluations_per_frame", times.evaluations / static_cast<double>(times.frames)},
          {"evaluations_per_s", times.evaluations_per_s()},
          {"frames", times.frames},
          {"repeats", repeats.size()}};
}

report::Table TableOf(const Json& result) {
  std::vector<std::string> heads = {"<"};
  for (const Json& one : result["scenarios"]) heads.push_back(one["scenario"]);
  report::Table table(heads);
  const auto row = [&](const std::string& name, const std::string& place, int digits) {
    std::vector<report::Cell> cells = {name};
    for (const Json& one : result["scenarios"])
      cells.emplace_back(Fixed(one.at(Json::json_pointer(place)).get<double>(), digits));
    table.Row(std::move(cells));
  };
  for (const auto& [stage, name] : EnumNames<LoopStage>::kNames)
    row(fmt::format("{}, ms", name), fmt::format("/stages_ms/{}", name), 2);
  row("frame, ms", "/frame_ms", 2);
  row("bare rendering, ms", "/bare_render_ms", 2);
  row("ratio to bare rendering", "/ratio_to_bare_render", 2);
  row("  lower quartile", "/ratio_quartiles/0", 2);
  row("  upper quartile", "/ratio_quartiles/2", 2);
  row("real-time factor", "/real_time_factor", 2);
  row("evaluations a frame", "/evaluations_per_frame", 0);
  row("evaluations a second", "/evaluations_per_s", 0);
  row("frames", "/frames", 0);
  return table;
}

}  // namespace

report::Report ReportOf(const Json& result) {
  return {.kind = "bench",
          .title = "Speed of the closed loop",
          .build = result["version"],
          .facts = {{"a frame", Fixed(result["frame_ms"].get<double>(), 1) + " ms",
                     Fixed(result["real_time_factor"].get<double>(), 1) + " times real time"},
                    {"ratio to bare rendering",
                     Fixed(result["ratio_to_bare_render"].get<double>(), 2), result["renderer"]}},
          .sections = {{.title = "Times of a frame",
                        .note = fmt::format("Median of {} repeats.", result["repeats"].get<int>()),
                        .table = TableOf(result)}}};
}

Json ResultJson(const std::vector<BenchResult>& results) {
  Json json = ToJson(Together(results));
  json["version"] = system::VersionAndCommit();
  json["renderer"] = results.front().renderer;
  for (const BenchResult& result : results) {
    Json one = {{"scenario", result.scenario}};
    one.update(ToJson(result.repeats));
    one["digest"] = result.digest;
    json["scenarios"].push_back(one);
  }
  return json;
}

}  // namespace turbidock::bench
