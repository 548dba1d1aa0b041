#include "experiments/studies/bench/bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

#include "experiments/report/json.h"
#include "experiments/report/table.h"
#include "experiments/statistics/intervals.h"
#include "experiments/studies/bench/bare_renderer.h"
#include "experiments/system/build_info.h"
#include "experiments/system/subprocess.h"
#include "experiments/trial/trial.h"

namespace turbidock::bench {
namespace {

using report::Json;

constexpr int kBlockFrames = 30;  // a second of the trial
constexpr int kBareStride = 3;    // every third state of a block is drawn bare
constexpr int kStartUpRepeats = 5;
constexpr double kMsPerS = 1000;

double WallSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double ThreadCpuSeconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Seconds a frame, of a block's frames.
struct Block {
  int frames = 0;
  StageTimer::Seconds stages_s{};
  double frame_s = 0, frame_cpu_s = 0;
  double bare_s = 0, bare_cpu_s = 0, bare_as_modelled_s = 0;
  double evaluations = 0;
};

// The wall and processor time of drawing something a few times.
template <class Work>
std::pair<double, double> Timed(Work&& work) {
  const double wall_s = WallSeconds(), cpu_s = ThreadCpuSeconds();
  work();
  return {WallSeconds() - wall_s, ThreadCpuSeconds() - cpu_s};
}

// Both kinds of bare rendering, in a context of their own.
class BareRendering {
 public:
  explicit BareRendering(const trial::Scenario& scenario)
      : scene_(vehicle::LoadScene(trial::SceneFilesOf(scenario), scenario.rig)),
        context_(view::MakeGlContext(scenario.renderer)),
        cheapest_(*context_, scene_, Cheapest(scene_)),
        as_modelled_(*context_, scene_, scene_.model->vis.quality) {}

  void Measure(const std::vector<Pose>& states, Block* block) {
    int drawn = 0;
    for (size_t i = 0; i < states.size(); i += kBareStride, ++drawn) {
      cheapest_.Place(states[i]);
      if (drawn == 0) cheapest_.Render();  // what the loop has pushed out of the caches comes back
      const auto [wall_s, cpu_s] = Timed([&] { cheapest_.Render(); });
      block->bare_s += wall_s;
      block->bare_cpu_s += cpu_s;
    }
    block->bare_s /= drawn;
    block->bare_cpu_s /= drawn;
    as_modelled_.Place(states.front());
    block->bare_as_modelled_s = Timed([&] { as_modelled_.Render(); }).first;
  }

  std::string description() const { return context_->description(); }

 private:
  static BareRenderer::Quality Cheapest(const vehicle::Scene& scene) {
    BareRenderer::Quality quality = scene.model->vis.quality;
    quality.offsamples = 0;
    quality.shadowsize = 0;
    return quality;
  }

  vehicle::Scene scene_;
  std::unique_ptr<view::GlContext> context_;
  BareRenderer cheapest_, as_modelled_;
};

// One trial in blocks, with bare rendering after each of them.
class BlockRecorder {
 public:
  BlockRecorder(BareRendering* bare, StageTimer* timer) : bare_(*bare), timer_(*timer) {}

  void Add(const trial::TrialFrame& frame) {
    states_.push_back(frame.record.true_X_WB);
    block_.evaluations += static_cast<double>(frame.evaluations);
    ++block_.frames;
    if (block_.frames == kBlockFrames)
      Close();
    else if (!cpu_start_s_)
      cpu_start_s_ = ThreadCpuSeconds();
  }

  // Ends the block. Its first frame has no processor time: the watch starts when it is over.
  void Close() {
    if (block_.frames < 2) return;
    block_.frame_cpu_s = (ThreadCpuSeconds() - *cpu_start_s_) / (block_.frames - 1);
    block_.stages_s = timer_.Take();
    for (double& s : block_.stages_s) s /= block_.frames;
    block_.frame_s = std::accumulate(block_.stages_s.begin(), block_.stages_s.end(), 0.0);
    block_.evaluations /= block_.frames;
    bare_.Measure(states_, &block_);
    blocks_.push_back(std::exchange(block_, {}));
    states_.clear();
    cpu_start_s_.reset();
  }

  const std::vector<Block>& blocks() const { return blocks_; }

 private:
  BareRendering& bare_;
  StageTimer& timer_;
  Block block_;
  std::vector<Pose> states_;
  std::optional<double> cpu_start_s_;
  std::vector<Block> blocks_;
};

// The median over the repeats of what a block's number is.
template <class Number>
double MedianOf(const std::vector<std::vector<Block>>& repeats, size_t block, Number&& number) {
  std::vector<double> values;
  values.reserve(repeats.size());
  for (const auto& blocks : repeats) values.push_back(number(blocks[block]));
  return *statistics::Median(std::move(values));
}

// Of a block's repeats the one with the median time, whose stages add up to it; of two in the
// middle the slower.
const Block& MedianBlock(const std::vector<std::vector<Block>>& repeats, size_t block) {
  std::vector<const Block*> order;
  order.reserve(repeats.size());
  for (const auto& blocks : repeats) order.push_back(&blocks[block]);
  std::sort(order.begin(), order.end(),
            [](const Block* a, const Block* b) { return a->frame_s < b->frame_s; });
  return *order[order.size() / 2];
}

// The statistics of all blocks, by repeat and place in the trial.
void Summarise(const std::vector<std::vector<Block>>& repeats, BenchResult* result) {
  double frames = 0;
  for (size_t i = 0; i < repeats.front().size(); ++i) {
    const double weight = repeats.front()[i].frames;
    frames += weight;
    const Block& median = MedianBlock(repeats, i);
    for (size_t k = 0; k < kLoopStages; ++k) result->stages_s[k] += weight * median.stages_s[k];
    result->frame_s += weight * median.frame_s;
    const auto add = [&](double Block::*number, double* sum) {
      *sum += weight * MedianOf(repeats, i, [&](const Block& b) { return b.*number; });
    };
    add(&Block::frame_cpu_s, &result->frame_cpu_s);
    add(&Block::bare_s, &result->bare_s);
    add(&Block::bare_cpu_s, &result->bare_cpu_s);
    add(&Block::bare_as_modelled_s, &result->bare_as_modelled_s);
    add(&Block::evaluations, &result->evaluations);
  }
  for (double* sum : {&result->frame_s, &result->frame_cpu_s, &result->bare_s, &result->bare_cpu_s,
                      &result->bare_as_modelled_s, &result->evaluations})
    *sum /= frames;
  for (double& s : result->stages_s) s /= frames;

  std::vector<double> ratios;
  for (const auto& blocks : repeats)
    for (const Block& block : blocks) ratios.push_back(block.frame_s / block.bare_s);
  result->ratio_to_bare = {*statistics::Quantile(ratios, 0.25), *statistics::Quantile(ratios, 0.5),
                           *statistics::Quantile(ratios, 0.75)};
  result->evaluations_per_s =
      result->evaluations / result->stages_s[static_cast<size_t>(LoopStage::kEstimate)];
}

}  // namespace

BenchResult RunBench(const trial::Scenario& scenario, const BenchOptions& options) {
  trial::Scenario limited = scenario;
  limited.duration_s = std::min(limited.duration_s, limited.clock.TimeOfFrame(options.frames));
  BareRendering bare(limited);
  BenchResult result;
  result.scenario = scenario.description;
  result.renderer = bare.description();
  result.frame_period_s = scenario.clock.frame_s();
  std::vector<std::vector<Block>> repeats;
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    StageTimer timer;
    BlockRecorder recorder(&bare, &timer);
    trial::TrialOptions trial;
    trial.timer = &timer;
    trial.observe = [&](const trial::TrialFrame& frame) {
      recorder.Add(frame);
      if (!options.progress) return;
      const double over_s = limited.clock.TimeOfFrame(frame.record.frame + 1);
      const double share = std::min(1.0, over_s / limited.duration_s);
      options.progress((repeat + share) / options.repeats,
                       fmt::format("{}, repeat {}", scenario.description, repeat + 1));
    };
    const trial::TrialResult ended = trial::RunTrial(limited, trial);
    recorder.Close();
    if (repeat > 0 && ended.digest != result.digest)
      throw SimulatorFault(fmt::format("repeat {} of {} gives the digest {}, the first gave {}",
                                       repeat + 1, scenario.description, ended.digest,
                                       result.digest));
    result.digest = ended.digest;
    result.frames = std::ssize(ended.log.frames);
    repeats.push_back(recorder.blocks());
    if (repeats.back().empty())
      throw ConfigError(fmt::format("bench: {} ends after {} frame; timing it takes 2 at least",
                                    scenario.description, result.frames));
  }
  result.repeats = options.repeats;
  Summarise(repeats, &result);
  return result;
}

namespace {

// `turbidock run` with these arguments and more, quietly.
std::vector<std::string> RunCommand(const std::string& program,
                                    const std::vector<std::string>& arguments,
                                    const std::vector<std::string>& more = {}) {
  std::vector<std::string> command = {program, "run", "--quiet", "--json"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

}  // namespace

WorkerCost MeasureWorker(const std::string& program, const std::vector<std::string>& arguments) {
  const auto run = [&](const std::string& duration) {
    system::Subprocess worker(RunCommand(program, arguments, {"--set", "duration_s=" + duration}),
                              "turbidock");
    return report::ParseJson(worker.Finish(), "turbidock run");
  };
  WorkerCost cost;
  std::vector<double> seconds;
  seconds.reserve(kStartUpRepeats);
  for (int i = 0; i < kStartUpRepeats; ++i) seconds.push_back(Timed([&] { run("0.001"); }).first);
  cost.start_up_s = *statistics::Quantile(seconds, 0.5);
  cost.peak_memory_mib = run("2").at("peak_memory_mib");
  return cost;
}

Throughput MeasureThroughput(const std::string& program, const std::vector<std::string>& arguments,
                             int workers) {
  constexpr int kRounds = 2;
  Throughput result;
  result.scenario = arguments.front();
  result.workers = workers;
  result.trials = kRounds * workers;
  const std::vector<std::string> command = RunCommand(program, arguments);
  for (int round = 0; round < kRounds; ++round) {
    const double start_s = WallSeconds();
    std::vector<std::unique_ptr<system::Subprocess>> running(static_cast<size_t>(workers));
    for (auto& one : running) one = std::make_unique<system::Subprocess>(command, "turbidock");
    for (auto& one : running) one->Finish();
    result.wall_s += WallSeconds() - start_s;
  }
  return result;
}

namespace {

Json ToJson(const BenchResult& result) {
  Json stages = Json::object();
  for (const auto& [stage, name] : EnumNames<LoopStage>::kNames)
    stages[name] = kMsPerS * result.stages_s[static_cast<size_t>(stage)];
  return {
      {"frame_ms", kMsPerS * result.frame_s},
      {"bare_render_ms", kMsPerS * result.bare_s},
      {"ratio_to_bare_render", result.ratio_to_bare_render()},
      {"ratio_quartiles", result.ratio_to_bare},
      {"stages_ms", stages},
      {"real_time_factor", result.real_time_factor()},
      {"evaluations_per_frame", result.evaluations},
      {"evaluations_per_s", result.evaluations_per_s},
      {"bare_render_as_modelled_ms", kMsPerS * result.bare_as_modelled_s},
      {"frame_cpu_ms", kMsPerS * result.frame_cpu_s},
      {"bare_render_cpu_ms", kMsPerS * result.bare_cpu_s},
      {"frames", result.frames},
      {"repeats", result.repeats},
  };
}

// All scenarios as one workload: every frame counts the same.
BenchResult Together(const std::vector<BenchResult>& results) {
  BenchResult all;
  all.repeats = results.front().repeats;
  double ratio_low = 0, ratio_median = 0, ratio_high = 0;
  for (const BenchResult& one : results) all.frames += one.frames;
  for (const BenchResult& one : results) {
    const double share = static_cast<double>(one.frames) / static_cast<double>(all.frames);
    for (size_t k = 0; k < kLoopStages; ++k) all.stages_s[k] += share * one.stages_s[k];
    for (auto number :
         {&BenchResult::frame_s, &BenchResult::bare_s, &BenchResult::bare_as_modelled_s,
          &BenchResult::frame_cpu_s, &BenchResult::bare_cpu_s, &BenchResult::frame_period_s,
          &BenchResult::evaluations})
      all.*number += share * (one.*number);
    ratio_low += share * one.ratio_to_bare.low;
    ratio_median += share * one.ratio_to_bare.median;
    ratio_high += share * one.ratio_to_bare.high;
  }
  all.ratio_to_bare = {ratio_low, ratio_median, ratio_high};
  all.evaluations_per_s = all.evaluations / all.stages_s[static_cast<size_t>(LoopStage::kEstimate)];
  return all;
}

WorkerCost Dearest(const std::vector<WorkerCost>& workers) {
  WorkerCost dearest;
  for (const WorkerCost& one : workers) {
    dearest.start_up_s = std::max(dearest.start_up_s, one.start_up_s);
    dearest.peak_memory_mib = std::max(dearest.peak_memory_mib, one.peak_memory_mib);
  }
  return dearest;
}

}  // namespace

std::string BenchJson(const BenchReport& report) {
  Json json = ToJson(Together(report.results));
  if (!report.workers.empty()) json.update(Dearest(report.workers));
  json["version"] = system::VersionAndCommit();
  json["renderer"] = report.results.front().renderer;
  Json list = Json::array();
  for (size_t i = 0; i < report.results.size(); ++i) {
    const BenchResult& result = report.results[i];
    Json one = {{"scenario", result.scenario}};
    one.update(ToJson(result));
    if (i < report.workers.size()) one.update(report.workers[i]);
    one["digest"] = result.digest;
    list.push_back(one);
  }
  json["scenarios"] = list;
  if (!report.throughputs.empty()) json["throughput"] = report.throughputs;
  return report::JsonText(json);
}

std::string BenchTable(const BenchReport& report) {
  std::vector<std::string> heads = {"<"};
  std::vector<Json> results;
  for (const BenchResult& result : report.results) {
    heads.push_back(result.scenario);
    results.push_back(ToJson(result));
  }
  heads.emplace_back("<");
  report::Table table(heads);
  // The numbers at that place in the JSON.
  const auto row = [&](const std::string& name, const std::string& place, const char* unit = "",
                       int digits = 2, double factor = 1) {
    std::vector<report::Cell> cells = {name};
    for (const Json& result : results)
      cells.push_back(
          report::Fixed(factor * result.at(Json::json_pointer(place)).get<double>(), digits));
    cells.emplace_back(unit);
    table.Row(std::move(cells));
  };
  for (const auto& [stage, name] : EnumNames<LoopStage>::kNames)
    row(fmt::format("  {}", name), fmt::format("/stages_ms/{}", name), "ms");
  row("frame", "/frame_ms", "ms");
  row("bare rendering", "/bare_render_ms", "ms");
  row("ratio to bare rendering", "/ratio_to_bare_render");
  row("  lower quartile", "/ratio_quartiles/0");
  row("  upper quartile", "/ratio_quartiles/2");
  row("real-time factor", "/real_time_factor");
  row("frame, processor time", "/frame_cpu_ms", "ms");
  row("bare, processor time", "/bare_render_cpu_ms", "ms");
  row("bare as the scene asks", "/bare_render_as_modelled_ms", "ms");
  row("evaluations", "/evaluations_per_frame", "a frame", 0);
  row("evaluations", "/evaluations_per_s", "million/s", 2, 1e-6);
  row("frames", "/frames", "", 0);
  row("repeats", "/repeats", "", 0);
  std::string text = table.Text();
  if (!report.workers.empty()) {
    const WorkerCost worker = Dearest(report.workers);
    text += fmt::format("a worker: {:.2f} s from start to first frame, {:.0f} MiB at most\n",
                        worker.start_up_s, worker.peak_memory_mib);
  }
  for (const Throughput& one : report.throughputs)
    text += fmt::format("{}, {} worker{}: {:.0f} trials an hour\n", one.scenario, one.workers,
                        one.workers == 1 ? "" : "s", one.trials_per_hour());
  return text + report.results.front().renderer + "\n";
}

}  // namespace turbidock::bench
