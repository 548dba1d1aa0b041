#include "experiments/studies/step_response/step_response.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>

#include "experiments/config/yaml_fields.h"
#include "experiments/trial/trial.h"
#include "experiments/trial/world.h"
#include "sim/base/check.h"

namespace turbidock::step_response {
namespace {

using control::Axes;
using control::Axis;
using std::numbers::pi;

constexpr double kWithin = 0.05;    // of the step: settled
constexpr double kRecovered = 0.1;  // of the peak
constexpr double kLeastStay_s = 2;  // what swings through is not there to stay
constexpr double kMinWatch_s = 8;   // a sinusoid is watched for at least this long ...
constexpr int kMinPeriods = 4;      // ... and these periods, after as long to settle

// A trial that stands at the servoing pose for as long as it is left alone.
trial::Scenario AtTheServoingPose(trial::Scenario scenario) {
  const std::string there = FormatNumber(scenario.procedure.servo_x_m);
  trial::Resolve(
      config::ParseAssignments({"start.distance_min_m=" + there, "start.distance_max_m=" + there,
                                "start.lateral_m=0", "start.vertical_m=0", "start.heading_rad=0",
                                "start.roll_rad=0", "start.pitch_rad=0", "start.position_m=[]",
                                "start.quaternion_wxyz=[]", "start.velocity_mps=[]",
                                "start.turn_rate_rad_s=[]",
                                "procedure.enter_hold_s=600",  // longer than any of these trials
                                "procedure.found_hold_s=0.2", "estimator.true_pose.found_after_s=0",
                                "sea=" + config::TextOf(trial::Scenario(), "sea")}),
      &scenario);
  return scenario;
}

// An answer that is none.
struct NotInFront {
  std::string why;
};

// The frames of a trial that is excited from `first` on. NotInFront when it ends before its time,
// or when the vehicle then searches or drifts: what it does is not its controller's answer.
std::vector<trial::FrameRecord> Run(trial::Scenario scenario, Axis axis, size_t first,
                                    double duration_s,
                                    const std::function<trial::TrialExcitation(int64_t)>& excite) {
  trial::Resolve({config::ParseAssignment("trial.duration_s=" + FormatNumber(duration_s))},
                 &scenario);
  trial::TrialOptions options;
  options.excite = excite;
  trial::TrialResult result = trial::RunTrial(scenario, options);
  if (result.outcome != trial::Outcome::kTimeout)
    throw NotInFront{std::string("excited in ") + AxisName(axis) +
                     ", the vehicle does not stay in front of the marker: " + result.reason};
  if (!std::ranges::all_of(std::span(result.log.frames).subspan(first),
                           &trial::FrameRecord::controlled))
    throw NotInFront{std::string("excited in ") + AxisName(axis) +
                     ", the vehicle loses the marker"};
  return std::move(result.log.frames);
}

// The answer to what is done from `rest_s` on; rest is what was there on average in the second
// before.
Answer MeasureAnswer(const trial::Scenario& scenario, const StepOptions& options, Axis axis,
                     const trial::TrialExcitation& excitation) {
  const ClockParams& clock = scenario.clock;
  const auto first = static_cast<size_t>(clock.FramesFor(options.rest_s));
  const double duration_s = options.rest_s + options.record_s;
  const auto frames = Run(scenario, axis, first, duration_s, [&](int64_t frame) {
    return static_cast<size_t>(frame) >= first ? excitation : trial::TrialExcitation();
  });
  const auto place = [&](size_t n) { return control::ToAxes(frames[n].true_X_HM)[axis]; };
  const size_t before = std::min(first, static_cast<size_t>(clock.frames_per_second));
  double rest = 0;
  for (size_t n = first - before; n < first; ++n) rest += place(n) / static_cast<double>(before);
  Answer answer{.wanted = excitation.control.wanted[axis]};
  for (size_t n = first; n < frames.size(); ++n) {
    const double moved = place(n) - rest;
    answer.time_s.push_back(clock.TimeOfFrame(static_cast<int64_t>(n - first)));
    answer.actual.push_back(axis == control::kYaw ? WrapAngle(moved) : moved);
    answer.demand.push_back(frames[n].demand[axis]);
  }
  return answer;
}

// When the values enter the band to stay, if they do.
std::optional<double> EntersToStay(const Answer& answer, double center, double band) {
  size_t i = answer.actual.size();
  while (i > 0 && std::abs(answer.actual[i - 1] - center) <= band) --i;
  if (i == answer.actual.size() || answer.time_s.back() - answer.time_s[i] < kLeastStay_s)
    return std::nullopt;
  return answer.time_s[i];
}

// L at a frequency, from a trial of its own.
std::complex<double> MeasureLoop(const trial::Scenario& scenario, const StepOptions& options,
                                 Axis axis, double authority, double frequency_hz) {
  const ClockParams& clock = scenario.clock;
  const double periods = std::max<double>(kMinPeriods, std::ceil(kMinWatch_s * frequency_hz));
  const int64_t first = clock.FramesFor(options.rest_s);
  const int64_t watched_from = first + clock.FramesFor(periods / frequency_hz);
  const int64_t end = watched_from + clock.FramesFor(periods / frequency_hz);
  const double omega = 2 * pi * frequency_hz;
  const auto added_share = [&](int64_t frame) {
    return kAddedShare * std::sin(omega * clock.TimeOfFrame(frame - first));
  };
  const auto frames =
      Run(scenario, axis, static_cast<size_t>(first), clock.TimeOfFrame(end), [&](int64_t frame) {
        trial::TrialExcitation excitation;
        if (frame >= first) excitation.control.share[axis] = added_share(frame);
        return excitation;
      });
  std::complex<double> demand, total;
  for (int64_t n = watched_from; n < std::min<int64_t>(end, std::ssize(frames)); ++n) {
    // Hann's window: what is left of the beginning is slower and far larger at high frequencies
    const double share =
        static_cast<double>(n - watched_from) / static_cast<double>(end - watched_from);
    const auto turn = std::polar(1 - std::cos(2 * pi * share), -omega * clock.TimeOfFrame(n));
    const double c = frames[static_cast<size_t>(n)].demand[axis];
    demand += c * turn;
    total += (c + authority * added_share(n)) * turn;
  }
  return -demand / total;
}

AxisResponse MeasureAxis(trial::Scenario scenario, const StepOptions& options, Axis axis,
                         const std::function<void()>& one_more) {
  trial::TrialExcitation step, push;
  if (axis == control::kYaw) {
    step.control.wanted[axis] = kStep_rad;
    push.F_B_B.tau.z() = kPush_newton_m;
  } else {
    step.control.wanted[axis] = kStep_m;
    push.F_B_B.f[axis] = kPush_newton;
  }
  AxisResponse response{.axis = axis};
  response.step.answer = MeasureAnswer(scenario, options, axis, step);
  JudgeStep(&response.step);
  one_more();
  response.disturbance.answer = MeasureAnswer(scenario, options, axis, push);
  JudgeDisturbance(&response.disturbance);
  one_more();
  const double authority =
      control::MakeAllocation(scenario.plugins.Spec(), trial::ModelOf(scenario))->authority()[axis];
  scenario.true_pose.noise.setZero();
  for (const double frequency_hz : options.frequencies_hz) {
    if (frequency_hz >= 0.45 * scenario.clock.frames_per_second) break;
    const std::complex<double> L = MeasureLoop(scenario, options, axis, authority, frequency_hz);
    response.loop.points.push_back({frequency_hz, std::abs(L), std::arg(L)});
    one_more();
  }
  JudgeLoop(&response.loop);
  return response;
}

}  // namespace

void JudgeStep(StepResponse* response) {
  const Answer& a = response->answer;
  const double step = a.wanted;
  TD_CHECK(!a.actual.empty() && step != 0, "an answer to judge");
  const auto first_beyond = [&](double share) -> std::optional<double> {
    for (size_t i = 0; i < a.actual.size(); ++i)
      if (a.actual[i] / step >= share) return a.time_s[i];
    return std::nullopt;
  };
  const auto low = first_beyond(0.1), high = first_beyond(0.9);
  if (low && high) response->rise_time_s = *high - *low;
  double most = 0;
  for (const double actual : a.actual) most = std::max(most, actual / step);
  response->overshoot = std::max(0.0, most - 1);
  response->settling_time_s = EntersToStay(a, step, kWithin * std::abs(step));
}

void JudgeDisturbance(DisturbanceResponse* response) {
  const Answer& a = response->answer;
  TD_CHECK(!a.actual.empty(), "an answer to judge");
  for (const double actual : a.actual)
    if (std::abs(actual) > std::abs(response->peak)) response->peak = actual;
  response->recovery_time_s = EntersToStay(a, 0, kRecovered * std::abs(response->peak));
}

void JudgeLoop(LoopResponse* response) {
  std::vector<LoopPoint>& points = response->points;
  double phase = -pi;  // a loop with integrators begins between -360 and 0 degrees
  for (LoopPoint& point : points) {
    phase += WrapAngle(point.phase_rad - phase);
    point.phase_rad = phase;
    response->sensitivity_peak =
        std::max(response->sensitivity_peak, 1 / std::abs(1.0 + std::polar(point.gain, phase)));
  }
  // straight lines in log gain and phase over log frequency
  for (size_t i = 1; i < points.size(); ++i) {
    const LoopPoint &a = points[i - 1], &b = points[i];
    const double log_a = std::log(a.gain), log_b = std::log(b.gain);
    if ((log_a > 0) != (log_b > 0)) {
      const double share = log_a / (log_a - log_b);
      const double margin = WrapAngle(std::lerp(a.phase_rad, b.phase_rad, share) + pi);
      if (!response->phase_margin_rad || std::abs(margin) < std::abs(*response->phase_margin_rad)) {
        response->phase_margin_rad = margin;
        response->crossover_hz = a.frequency_hz * std::pow(b.frequency_hz / a.frequency_hz, share);
        response->delay_margin_s = std::max(0.0, margin) / (2 * pi * *response->crossover_hz);
      }
    }
    // any odd multiple of 180 degrees
    const auto [from, to] = std::minmax(a.phase_rad, b.phase_rad);
    const double odd = 2 * std::ceil((from / pi - 1) / 2) + 1;
    if (from == to || odd * pi > to) continue;
    const double share = (odd * pi - a.phase_rad) / (b.phase_rad - a.phase_rad);
    const double margin = std::exp(-std::lerp(log_a, log_b, share));
    if (margin > 1 && (!response->gain_margin || margin < *response->gain_margin))
      response->gain_margin = margin;
  }
}

const char* AxisName(Axis axis) {
  constexpr std::array kNames = {"x", "y", "z", "yaw"};
  return kNames[axis];
}

std::vector<AxisResponse> MeasureStepResponses(const trial::Scenario& given,
                                               const StepOptions& options) {
  const trial::Scenario scenario = AtTheServoingPose(given);
  const double runs =
      static_cast<double>(options.axes.size() * (2 + options.frequencies_hz.size()));
  double done = 0;
  const auto one_more = [&] {
    if (options.on_progress) options.on_progress(++done / runs);
  };
  std::vector<AxisResponse> responses;
  for (const Axis axis : options.axes) try {
      responses.push_back(MeasureAxis(scenario, options, axis, one_more));
    } catch (const NotInFront& left) {
      responses.push_back({.axis = axis, .not_measured = left.why});
    }
  return responses;
}

}  // namespace turbidock::step_response
