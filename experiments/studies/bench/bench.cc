#include "experiments/studies/bench/bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <utility>

#include "experiments/statistics/intervals.h"
#include "experiments/studies/bench/bare_renderer.h"
#include "experiments/system/subprocess.h"
#include "experiments/trial/trial.h"

namespace turbidock::bench {
namespace {

constexpr int kBlockFrames = 30;  // a second of the trial
constexpr int kBareStride = 3;    // every third state of a block is drawn bare
constexpr int kStartUpRepeats = 5;

template <class Work>
double SecondsOf(Work&& work) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  work();
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// One trial in blocks, with bare rendering after each of them.
class BlockRecorder {
 public:
  BlockRecorder(double frame_period_s, BareRenderer* bare, StageTimer* timer)
      : frame_period_s_(frame_period_s), bare_(*bare), timer_(*timer) {}

  void Add(const trial::TrialFrame& frame) {
    states_.push_back(frame.record.true_X_WB);
    evaluations_ += static_cast<double>(frame.evaluations);
    if (std::ssize(states_) == kBlockFrames) Close();
  }

  // Ends the block, which is left out when it is of one frame.
  void Close() {
    if (states_.size() < 2) return;
    const auto frames = static_cast<double>(states_.size());
    Block block{.frames = static_cast<int>(states_.size()),
                .frame_period_s = frame_period_s_,
                .stages_s = timer_.Take(),
                .evaluations = std::exchange(evaluations_, 0) / frames};
    for (double& s : block.stages_s) s /= frames;
    block.frame_s = std::accumulate(block.stages_s.begin(), block.stages_s.end(), 0.0);
    int drawn = 0;
    for (size_t i = 0; i < states_.size(); i += kBareStride, ++drawn) {
      bare_.Place(states_[i]);
      if (drawn == 0) bare_.Render();  // what the loop has pushed out of the caches comes back
      block.bare_s += SecondsOf([&] { bare_.Render(); });
    }
    block.bare_s /= drawn;
    blocks_.push_back(block);
    states_.clear();
  }

  const std::vector<Block>& blocks() const { return blocks_; }

 private:
  double frame_period_s_;
  BareRenderer& bare_;
  StageTimer& timer_;
  std::vector<Pose> states_;
  double evaluations_ = 0;
  std::vector<Block> blocks_;
};

}  // namespace

Times TimesOf(const Repeats& repeats) {
  Times times;
  std::vector<double> ratios;
  for (size_t i = 0; i < repeats.front().size(); ++i) {
    std::vector<Block> same;  // of each repeat
    std::vector<double> bare_s;
    for (const auto& blocks : repeats) {
      same.push_back(blocks[i]);
      bare_s.push_back(blocks[i].bare_s);
      ratios.push_back(blocks[i].frame_s / blocks[i].bare_s);
    }
    // the one with the median time, whose stages add up to it; of two in the middle the slower
    std::ranges::sort(same, {}, &Block::frame_s);
    const Block& median = same[same.size() / 2];
    const auto add = [&](double value, double* sum) { *sum += median.frames * value; };
    times.frames += median.frames;
    for (size_t k = 0; k < kLoopStages; ++k) add(median.stages_s[k], &times.stages_s[k]);
    add(median.frame_s, &times.frame_s);
    add(*statistics::Median(bare_s), &times.bare_s);
    add(median.frame_period_s, &times.frame_period_s);
    add(median.evaluations, &times.evaluations);
  }
  const auto frames = static_cast<double>(times.frames);
  for (double& sum : times.stages_s) sum /= frames;
  for (double* sum : {&times.frame_s, &times.bare_s, &times.frame_period_s, &times.evaluations})
    *sum /= frames;
  times.ratio_to_bare = {*statistics::Quantile(ratios, 0.25), *statistics::Median(ratios),
                         *statistics::Quantile(ratios, 0.75)};
  times.evaluations_per_s =
      times.evaluations / times.stages_s[static_cast<size_t>(LoopStage::kEstimate)];
  return times;
}

BenchResult RunBench(const trial::Scenario& scenario, const BenchOptions& options) {
  trial::Scenario limited = scenario;
  limited.duration_s = std::min(limited.duration_s, limited.clock.TimeOfFrame(options.frames));
  BareRenderer bare(limited);
  BenchResult result{.scenario = scenario.description, .renderer = bare.description()};
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    StageTimer timer;
    BlockRecorder recorder(scenario.clock.frame_s(), &bare, &timer);
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
    result.repeats.push_back(recorder.blocks());
    if (result.repeats.back().empty())
      throw ConfigError(fmt::format("bench: {} ends after {} frame; timing it takes 2 at least",
                                    scenario.description, std::ssize(ended.log.frames)));
  }
  return result;
}

WorkerCost MeasureWorker(const std::string& program, const std::vector<std::string>& arguments) {
  const auto run = [&](const std::string& duration) {
    std::vector<std::string> command = {program, "run", "--quiet", "--json"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    command.insert(command.end(), {"--set", "duration_s=" + duration});
    return report::ParseJson(system::Subprocess(command, "turbidock").Finish(), "turbidock run");
  };
  std::vector<double> seconds;
  for (int i = 0; i < kStartUpRepeats; ++i) seconds.push_back(SecondsOf([&] { run("0.001"); }));
  return {.start_up_s = *statistics::Median(seconds),
          .peak_memory_mib = run("2").at("peak_memory_mib")};
}

}  // namespace turbidock::bench
