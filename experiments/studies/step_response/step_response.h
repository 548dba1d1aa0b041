#pragma once
// How the closed loop answers in still water: steps of the desired pose, steps of force, and the
// gain of the loop over frequency. Each measurement is a trial that begins at the servoing pose and
// never docks.

#include <functional>
#include <optional>
#include <vector>

#include "control/axes.h"
#include "experiments/report/report.h"
#include "experiments/trial/scenario.h"
#include "sim/base/result_fields.h"
#include "sim/base/units.h"

namespace turbidock::step_response {

inline constexpr double kStep_m = 0.05, kStep_rad = units::RadFromDeg(5);  // of yaw
inline constexpr double kPush_newton = 1, kPush_newton_m = 0.1;  // steady; the moment about z
inline constexpr double kAddedShare = 0.12;  // amplitude of the sinusoids, of the authority

struct StepOptions {
  std::vector<control::Axis> axes = {control::kSurge, control::kSway, control::kHeave,
                                     control::kYaw};
  double rest_s = 10;    // before anything happens
  double record_s = 20;  // of an answer
  std::vector<double> frequencies_hz = {0.05, 0.08, 0.125, 0.18, 0.25, 0.35, 0.5,
                                        0.7,  1.0,  1.4,   2.0,  2.8,  4.0};
  std::function<void(double share)> on_progress = {};
};

// A row a frame from the beginning of the step.
struct Answer {
  double wanted = 0;  // size of the step, m or rad; 0 for a push
  std::vector<double> time_s{};
  std::vector<double> actual{};  // the marker's true place less that at rest, m or rad
  std::vector<double> demand{};  // of the controller, in its unit
};

struct StepResponse {
  Answer answer{};
  // Nothing where the answer never gets there. Of the step's size:
  std::optional<double> rise_time_s{};      // from 10 % to 90 %
  double overshoot = 0;                     // largest value beyond 1
  std::optional<double> settling_time_s{};  // until it stays within 5 %, for 2 s at least

  TURBIDOCK_FIELDS(rise_time_s, overshoot, settling_time_s)
};

struct DisturbanceResponse {
  Answer answer{};
  double peak = 0;                          // largest displacement, m or rad
  std::optional<double> recovery_time_s{};  // the same of a tenth of the peak, to rest

  TURBIDOCK_FIELDS(peak, recovery_time_s)
};

// The loop opened at the controller's output: with the sinusoid w added to the demand c, L = -c /
// (c + w), each the Fourier coefficient at w's frequency over whole periods in Hann's window. The
// other axes stay closed, and the true pose is without noise. Thrusters and allocation are not
// linear, so it holds for the amplitude it was measured with.
struct LoopPoint {
  double frequency_hz = 0;
  double gain = 0, phase_rad = 0;  // of L; phase unwrapped from the lowest frequency

  TURBIDOCK_FIELDS(frequency_hz, gain, phase_rad)
};

struct LoopResponse {
  std::vector<LoopPoint> points{};
  // The smallest over all crossings, interpolated between the points; nothing without a crossing.
  std::optional<double> crossover_hz;      // of the smallest phase margin
  std::optional<double> phase_margin_rad;  // at gain 1
  std::optional<double> gain_margin;       // factor to gain 1 at phase -180 degrees, above 1
  std::optional<double> delay_margin_s;    // phase margin over the crossover's angular frequency
  double sensitivity_peak = 0;             // largest |1 / (1 + L)| of the points

  TURBIDOCK_FIELDS(crossover_hz, phase_margin_rad, gain_margin, delay_margin_s, sensitivity_peak,
                   points)
};

const char* AxisName(control::Axis axis);  // "x", "y", "z", "yaw"

struct AxisResponse {
  control::Axis axis = control::kSurge;
  // Why nothing was measured: the vehicle did not stay in front of the marker; empty: it was.
  std::string not_measured = {};
  StepResponse step{};
  DisturbanceResponse disturbance{};
  LoopResponse loop{};

  static void Fields(auto& self, auto&& field) {
    field("axis", AxisName(self.axis));
    self.VisitFields(field);
  }
  TURBIDOCK_VISIT_FIELDS(not_measured, step, disturbance, loop)
};

// ConfigError for a scenario that cannot run.
std::vector<AxisResponse> MeasureStepResponses(const trial::Scenario& scenario,
                                               const StepOptions& options = {});

// A row an axis in mm and degrees; of each axis the answers to step and force, and the loop's gain
// and phase.
report::Report ReportOf(const trial::Scenario& scenario,
                        const std::vector<AxisResponse>& responses);

// From the series, apart for tests.
void JudgeStep(StepResponse* response);
void JudgeDisturbance(DisturbanceResponse* response);
void JudgeLoop(LoopResponse* response);

}  // namespace turbidock::step_response
