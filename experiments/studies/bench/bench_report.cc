#include <fmt/format.h>

#include <algorithm>

#include "experiments/studies/bench/bench.h"
#include "experiments/system/build_info.h"

namespace turbidock::bench {
namespace {

using report::Fixed;
using report::Json;

Json ToJson(const Repeats& repeats) {
  const Times times = MedianTimes(repeats);
  const auto frames = static_cast<double>(times.frames);
  const auto ms = [&](double sum_s) { return 1000 * sum_s / frames; };  // of a frame
  Json stages = Json::object();
  for (const auto& [stage, name] : EnumNames<LoopStage>::kNames)
    stages[name] = ms(times.stages_s[static_cast<size_t>(stage)]);
  const double search_s = times.stages_s[static_cast<size_t>(LoopStage::kEstimate)];
  return {{"frame_ms", ms(times.frame_s())},
          {"bare_render_ms", ms(times.bare_s)},
          {"ratio_to_bare_render", times.frame_s() / times.bare_s},
          {"stages_ms", stages},
          {"real_time_factor", times.simulated_s / times.frame_s()},
          {"evaluations_per_frame", times.evaluations / frames},
          {"evaluations_per_s", times.evaluations / search_s},
          {"marker_seen_share", static_cast<double>(times.seen) / frames},
          {"frames", times.frames},
          {"repeats", repeats.size()}};
}

report::Table TableOf(const Json& scenarios) {
  std::vector<std::string> heads = {"<"};
  for (const Json& one : scenarios) heads.push_back(one["scenario"]);
  report::Table table(heads);
  const auto row = [&](const std::string& name, const std::string& place, int digits) {
    std::vector<report::Cell> cells = {name};
    for (const Json& one : scenarios)
      cells.emplace_back(Fixed(one.at(Json::json_pointer(place)).get<double>(), digits));
    table.Row(std::move(cells));
  };
  for (const auto& [stage, name] : EnumNames<LoopStage>::kNames)
    row(report::Words(name) + ", ms", fmt::format("/stages_ms/{}", name), 2);
  row("frame, ms", "/frame_ms", 2);
  row("bare rendering, ms", "/bare_render_ms", 2);
  row("ratio to bare rendering", "/ratio_to_bare_render", 2);
  row("real-time factor", "/real_time_factor", 2);
  row("evaluations a frame", "/evaluations_per_frame", 0);
  row("evaluations a second", "/evaluations_per_s", 0);
  row("frames", "/frames", 0);
  row("share of them with the marker seen", "/marker_seen_share", 2);
  return table;
}

}  // namespace

report::Report ReportOf(const Json& result) {
  const Json& scenarios = result["scenarios"];
  const auto factor_of = [](const Json& of) { return of["real_time_factor"].get<double>(); };
  const double least = factor_of(*std::ranges::min_element(scenarios, {}, factor_of));
  const auto repeats = result["repeats"].get<int>();
  std::string reason = fmt::format("{:.2f} times real time", least);
  if (scenarios.size() > 1)
    reason += fmt::format(" in the slowest of {} scenarios, {:.2f} over all their frames together",
                          scenarios.size(), factor_of(result));
  return {.kind = "bench",
          .title = "Speed of the closed loop",
          .build = result["version"],
          .verdict = {least >= 1 ? "faster than real time" : "slower than real time",
                      least >= 1 ? report::Tone::kGood : report::Tone::kNone, reason + "."},
          .facts = {{"a frame", Fixed(result["frame_ms"].get<double>(), 1) + " ms",
                     "both cameras and all that follows from them"},
                    {"ratio to bare rendering",
                     Fixed(result["ratio_to_bare_render"].get<double>(), 2), result["renderer"]}},
          .sections = {{.title = "Times of a frame",
                        .note = (repeats == 1 ? std::string("Of one repeat")
                                              : fmt::format("Median of {} repeats", repeats)) +
                                ", by the clock, so of a machine with nothing else to do. A frame "
                                "in which the marker is not seen searches whole images. Bare: "
                                "mjr_render and mjr_readPixels of the same views.",
                        .table = TableOf(result["scenarios"])}}};
}

Json ResultJson(const std::vector<BenchResult>& results) {
  Repeats all(results.front().repeats.size());  // all scenarios as one workload
  Json scenarios;
  for (const BenchResult& one : results) {
    for (size_t repeat = 0; repeat < all.size(); ++repeat)
      all[repeat].insert(all[repeat].end(), one.repeats[repeat].begin(), one.repeats[repeat].end());
    scenarios.push_back({{"scenario", one.scenario}});
    scenarios.back().update(ToJson(one.repeats));
    scenarios.back()["digest"] = one.digest;
  }
  Json json = ToJson(all);
  json.update({{"version", system::VersionAndCommit()},
               {"renderer", results.front().renderer},
               {"scenarios", scenarios}});
  return json;
}

}  // namespace turbidock::bench
