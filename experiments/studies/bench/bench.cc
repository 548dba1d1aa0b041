#include "experiments/studies/bench/bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <numeric>
#include <utility>

#include "experiments/config/yaml_fields.h"
#include "experiments/statistics/intervals.h"
#include "experiments/trial/trial.h"
#include "sim/vehicle/scene.h"
#include "sim/view/gl_context.h"

namespace turbidock::bench {
namespace {

constexpr int kBlockFrames = 30;  // a second of the trial
constexpr int kBareStride = 3;    // every third state of a block is drawn bare

// MuJoCo's own pictures of the two cameras, drawn and read back as any program would: what the
// closed loop's speed is measured against. At its cheapest: one sample a pixel, no shadows. In a
// context of its own.
class BareRenderer {
 public:
  explicit BareRenderer(const trial::Scenario& scenario)
      : scene_(vehicle::LoadScene(trial::SceneFilesOf(scenario), scenario.rig)),
        context_(view::MakeGlContext(scenario.renderer)),
        data_(mj_makeData(scene_.model.get())),
        viewport_{0, 0, scene_.rig.left.width_px, scene_.rig.left.height_px},
        depth_(static_cast<size_t>(viewport_.width) * viewport_.height),
        rgb_(3 * depth_.size()) {
    context_->MakeCurrent();
    const vehicle::MjModelPtr sized(mj_copyModel(nullptr, scene_.model.get()));
    sized->vis.global.offwidth = viewport_.width;
    sized->vis.global.offheight = viewport_.height;
    sized->vis.quality.offsamples = 0;
    sized->vis.quality.shadowsize = 0;
    mjr_defaultContext(&gl_);
    mjr_makeContext(sized.get(), &gl_, mjFONTSCALE_100);
    mjr_setBuffer(mjFB_OFFSCREEN, &gl_);
    for (mjvScene& drawn : drawn_) {
      mjv_defaultScene(&drawn);
      mjv_makeScene(scene_.model.get(), &drawn, 1000);
    }
  }

  ~BareRenderer() {
    context_->MakeCurrent();
    mjr_freeContext(&gl_);
    for (mjvScene& drawn : drawn_) mjv_freeScene(&drawn);
  }

  BareRenderer(const BareRenderer&) = delete;
  BareRenderer& operator=(const BareRenderer&) = delete;

  // Puts the vehicle at X_WB and lists what there is to draw.
  void Place(const Pose& X_WB) {
    const mjModel& m = *scene_.model;
    const std::array values = {X_WB.p.x(), X_WB.p.y(), X_WB.p.z(), X_WB.q.w(),
                               X_WB.q.x(), X_WB.q.y(), X_WB.q.z()};
    std::ranges::copy(values, data_->qpos + m.jnt_qposadr[m.body_jntadr[scene_.vehicle_body]]);
    mj_forward(&m, data_.get());
    mjvOption option;
    mjv_defaultOption(&option);
    mjvCamera camera;
    mjv_defaultCamera(&camera);
    camera.type = mjCAMERA_FIXED;
    for (const bool right : {false, true}) {
      camera.fixedcamid = right ? scene_.right_camera : scene_.left_camera;
      mjv_updateScene(&m, data_.get(), &option, nullptr, &camera, mjCAT_ALL, &drawn_[right]);
    }
  }

  // mjr_render and mjr_readPixels of colour and depth of both cameras.
  void Render() {
    context_->MakeCurrent();
    mjr_setBuffer(mjFB_OFFSCREEN, &gl_);
    for (mjvScene& drawn : drawn_) {
      mjr_render(viewport_, &drawn, &gl_);
      mjr_readPixels(rgb_.data(), depth_.data(), viewport_, &gl_);
    }
  }

  std::string description() const { return context_->description(); }

 private:
  vehicle::Scene scene_;
  std::unique_ptr<view::GlContext> context_;
  vehicle::MjDataPtr data_;
  mjvScene drawn_[2];  // left, right
  mjrContext gl_;
  mjrRect viewport_;
  std::vector<float> depth_;
  std::vector<uint8_t> rgb_;
};

// Bare rendering of some of these states, as if of all of them.
double BareSeconds(const std::vector<Pose>& states, BareRenderer* bare) {
  using Clock = std::chrono::steady_clock;
  std::chrono::duration<double> sum{};
  size_t drawn = 0;
  for (size_t i = 0; i < states.size(); i += kBareStride, ++drawn) {
    bare->Place(states[i]);
    if (drawn == 0) bare->Render();  // what the loop has pushed out of the caches comes back
    const Clock::time_point start = Clock::now();
    bare->Render();
    sum += Clock::now() - start;
  }
  return sum.count() * static_cast<double>(states.size()) / static_cast<double>(drawn);
}

}  // namespace

double Times::frame_s() const { return std::accumulate(stages_s.begin(), stages_s.end(), 0.0); }

Times MedianTimes(const Repeats& repeats) {
  Times sum;
  for (size_t i = 0; i < repeats.front().size(); ++i) {
    std::vector<Times> same;  // of each repeat
    std::vector<double> bare_s;
    for (const auto& blocks : repeats) {
      same.push_back(blocks[i]);
      bare_s.push_back(blocks[i].bare_s);
    }
    // the one with the median time, whose stages add up to it; of two in the middle the slower
    std::ranges::sort(same, {}, &Times::frame_s);
    const Times& median = same[same.size() / 2];
    sum.frames += median.frames;
    sum.seen += median.seen;
    sum.simulated_s += median.simulated_s;
    for (size_t k = 0; k < kLoopStages; ++k) sum.stages_s[k] += median.stages_s[k];
    sum.bare_s += *statistics::Median(bare_s);
    sum.evaluations += median.evaluations;
  }
  return sum;
}

BenchResult RunBench(const trial::Scenario& scenario, const BenchOptions& options) {
  trial::Scenario limited = scenario;
  const double duration_s = std::min(limited.duration_s, limited.clock.TimeOfFrame(options.frames));
  trial::Resolve({config::ParseAssignment("trial.duration_s=" + FormatNumber(duration_s))},
                 &limited);
  BareRenderer bare(limited);
  BenchResult result{.scenario = scenario.description, .renderer = bare.description()};
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    StageTimer timer;
    std::vector<Times> blocks;
    std::vector<Pose> states;
    double evaluations = 0;
    int64_t seen = 0;
    const auto close_block = [&] {
      if (states.size() < 2) return;  // a single frame is left out
      blocks.push_back(
          {.frames = std::ssize(states),
           .seen = std::exchange(seen, 0),
           .simulated_s = static_cast<double>(states.size()) * scenario.clock.frame_s(),
           .stages_s = timer.Take(),
           .bare_s = BareSeconds(states, &bare),
           .evaluations = std::exchange(evaluations, 0)});
      states.clear();
    };
    trial::TrialOptions trial;
    trial.timer = &timer;
    trial.observe = [&](const trial::TrialFrame& frame) {
      states.push_back(frame.record.true_X_WB);
      evaluations += static_cast<double>(frame.evaluations);
      seen += frame.record.fitness >= limited.procedure.lost_fitness;
      if (std::ssize(states) == kBlockFrames) close_block();
    };
    const trial::TrialResult ended = trial::RunTrial(limited, trial);
    close_block();
    if (repeat > 0 && ended.digest != result.digest)
      throw SimulatorFault(fmt::format("repeat {} of {} gives the digest {}, the first gave {}",
                                       repeat + 1, scenario.description, ended.digest,
                                       result.digest));
    if (blocks.empty())
      throw ConfigError(fmt::format("bench: {} ends after {} frame; timing it takes 2 at least",
                                    scenario.description, std::ssize(ended.log.frames)));
    result.digest = ended.digest;
    result.repeats.push_back(std::move(blocks));
    if (options.on_repeat) options.on_repeat(repeat + 1);
  }
  return result;
}

}  // namespace turbidock::bench
