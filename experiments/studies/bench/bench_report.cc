#include <fmt/format.h>

#include <algorithm>

#include "experiments/studies/bench/bench.h"
#include "experiments/system/build_info.h"

namespace turbidock::bench {
namespace {

using report::Fixed;
using report::Json;

constexpr double kMsPerS = 1000;

// All scenarios as one workload.
Times Together(const std::vector<BenchResult>& results) {
  Repeats all(results.front().repeats.size());
  for (const BenchResult& one : results)
    for (size_t repeat = 0; repeat < all.size(); ++repeat)
      all[repeat].insert(all[repeat].end(), one.repeats[repeat].begin(), one.repeats[repeat].end());
  return TimesOf(all);
}

WorkerCost Dearest(const std::vector<WorkerCost>& workers) {
  WorkerCost dearest;
  for (const WorkerCost& one : workers) {
    dearest.start_up_s = std::max(dearest.start_up_s, one.start_up_s);
    dearest.peak_memory_mib = std::max(dearest.peak_memory_mib, one.peak_memory_mib);
  }
  return dearest;
}

Json ToJson(const Times& times, const WorkerCost& worker, size_t repeats) {
  Json stages = Json::object();
  for (const auto& [stage, name] : EnumNames<LoopStage>::kNames)
    stages[name] = kMsPerS * times.stages_s[static_cast<size_t>(stage)];
  return {{"frame_ms", kMsPerS * times.frame_s},
          {"bare_render_ms", kMsPerS * times.bare_s},
          {"ratio_to_bare_render", times.ratio_to_bare_render()},
          {"ratio_quartiles", times.ratio_to_bare},
          {"stages_ms", stages},
          {"real_time_factor", times.real_time_factor()},
          {"evaluations_per_frame", times.evaluations},
          {"evaluations_per_s", times.evaluations_per_s},
          {"frames", times.frames},
          {"repeats", repeats},
          {"start_up_s", worker.start_up_s},
          {"peak_memory_mib", worker.peak_memory_mib}};
}

report::Table TableOf(const std::vector<BenchResult>& results) {
  std::vector<std::string> heads = {"<"};
  std::vector<Times> times;
  for (const BenchResult& result : results) {
    heads.push_back(result.scenario);
    times.push_back(TimesOf(result.repeats));
  }
  report::Table table(heads);
  const auto row = [&](const std::string& name, int digits, auto&& value_of) {
    std::vector<report::Cell> cells = {name};
    for (const Times& one : times) cells.emplace_back(Fixed(value_of(one), digits));
    table.Row(std::move(cells));
  };
  for (const auto& [stage, name] : EnumNames<LoopStage>::kNames)
    row(fmt::format("{}, ms", name), 2,
        [k = static_cast<size_t>(stage)](const Times& one) { return kMsPerS * one.stages_s[k]; });
  row("frame, ms", 2, [](const Times& one) { return kMsPerS * one.frame_s; });
  row("bare rendering, ms", 2, [](const Times& one) { return kMsPerS * one.bare_s; });
  row("ratio to bare rendering", 2, [](const Times& one) { return one.ratio_to_bare_render(); });
  row("  lower quartile", 2, [](const Times& one) { return one.ratio_to_bare.low; });
  row("  upper quartile", 2, [](const Times& one) { return one.ratio_to_bare.high; });
  row("real-time factor", 2, [](const Times& one) { return one.real_time_factor(); });
  row("evaluations a frame", 0, [](const Times& one) { return one.evaluations; });
  row("evaluations, million/s", 2, [](const Times& one) { return 1e-6 * one.evaluations_per_s; });
  row("frames", 0, [](const Times& one) { return static_cast<double>(one.frames); });
  return table;
}

}  // namespace

report::Report ReportOf(const std::vector<BenchResult>& results,
                        const std::vector<WorkerCost>& workers) {
  const Times all = Together(results);
  const WorkerCost worker = Dearest(workers);
  return {.kind = "bench",
          .title = "Speed of the closed loop",
          .build = system::VersionAndCommit(),
          .facts = {{"a frame", Fixed(kMsPerS * all.frame_s, 1) + " ms",
                     Fixed(all.real_time_factor(), 1) + " times real time"},
                    {"ratio to bare rendering", Fixed(all.ratio_to_bare_render(), 2),
                     results.front().renderer},
                    {"start of a worker", Fixed(worker.start_up_s, 2) + " s",
                     "until its first frame is over"},
                    {"memory of a worker", Fixed(worker.peak_memory_mib, 0) + " MiB"}},
          .sections = {{.title = "Times of a frame",
                        .note = fmt::format("Median of {} repeats.", results[0].repeats.size()),
                        .table = TableOf(results)}}};
}

Json ResultJson(const std::vector<BenchResult>& results, const std::vector<WorkerCost>& workers) {
  const size_t repeats = results.front().repeats.size();
  Json json = ToJson(Together(results), Dearest(workers), repeats);
  json["version"] = system::VersionAndCommit();
  json["renderer"] = results.front().renderer;
  for (size_t i = 0; i < results.size(); ++i) {
    Json one = {{"scenario", results[i].scenario}};
    one.update(ToJson(TimesOf(results[i].repeats), workers[i], repeats));
    one["digest"] = results[i].digest;
    json["scenarios"].push_back(one);
  }
  return json;
}

}  // namespace turbidock::bench
