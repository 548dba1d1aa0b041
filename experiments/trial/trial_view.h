#pragma once
// How a trial is shown: what its pictures have in common.

#include <array>
#include <cmath>
#include <string>

#include "control/stage.h"
#include "experiments/trial/scenario.h"
#include "sim/base/fields.h"
#include "sim/base/image.h"
#include "sim/base/published.h"
#include "sim/base/result_fields.h"
#include "sim/base/units.h"

namespace turbidock::trial {

// The lines to draw: published limits (section "Fitness" and the docking criterion of the paper);
// those of y and z are about the desired value.
struct ViewCriteria {
  double docking_fitness = published::kReliableFitness;    // Area I from here
  double detection_fitness = published::kDetectedFitness;  // Area II from here, Area III below
  double tolerance_y_m = published::kDockTolerance_m, tolerance_z_m = tolerance_y_m;
  double docked_x_m = published::kDockDistance_m;
  double enter_y_m = 0.02, enter_z_m = 0.02;  // servoing must be closer than docking may be
  TURBIDOCK_FIELDS(docking_fitness, detection_fitness, tolerance_y_m, tolerance_z_m, docked_x_m,
                   enter_y_m, enter_z_m)

  // What a stage allows of y and z; not a number where it allows anything.
  std::array<double, 2> Allowed_m(control::Stage stage) const {
    if (stage == control::Stage::kVisualServoing) return {enter_y_m, enter_z_m};
    if (stage == control::Stage::kDocking || stage == control::Stage::kDocked)
      return {tolerance_y_m, tolerance_z_m};
    return {NAN, NAN};
  }
};

// The limits to draw in a scenario's pictures.
inline ViewCriteria CriteriaOf(const Scenario& scenario) {
  const control::ProcedureParams& p = scenario.procedure;
  return {.docking_fitness = p.found_fitness,
          .detection_fitness = p.lost_fitness,
          .tolerance_y_m = p.allowance_y_m,
          .tolerance_z_m = p.allowance_z_m,
          .docked_x_m = p.docked_x_m,
          .enter_y_m = p.enter_y_m,
          .enter_z_m = p.enter_z_m};
}

inline constexpr const char* kFitnessMeaning =
    "F, fitness: how well both images agree with the estimated pose, -1 to 1; 1 is a perfect match";

// "Area I", "Area II", "Area III".
inline const char* AreaTitle(double fitness, const ViewCriteria& criteria) {
  if (fitness >= criteria.docking_fitness) return "Area I";
  return fitness >= criteria.detection_fitness ? "Area II" : "Area III";
}

// The same hues on paper (figure) and on dark ground (video), lighter there. The truth is grey:
// video halves the resolution of colour, and two hues on top of each other would mix to a third.
struct ViewColors {
  Rgb estimate, truth, desired, limit;
  std::array<Rgb, 6> stages;  // in the order of Stage
  TURBIDOCK_FIELDS(estimate, truth, desired, limit, stages)

  const Rgb& Of(control::Stage stage) const { return stages[static_cast<size_t>(stage)]; }
};

inline constexpr ViewColors kOnPaper = {.estimate = {24, 104, 178},
                                        .truth = {158, 166, 174},
                                        .desired = {200, 40, 96},
                                        .limit = {46, 139, 87},
                                        .stages = {{{148, 156, 164},
                                                    {74, 144, 217},
                                                    {216, 152, 24},
                                                    {60, 168, 110},
                                                    {150, 110, 190},
                                                    {196, 120, 104}}}};

inline constexpr ViewColors kOnDark = {.estimate = {58, 164, 255},
                                       .truth = {236, 240, 244},
                                       .desired = {255, 112, 164},
                                       .limit = {92, 214, 146},
                                       .stages = {{{160, 170, 180},
                                                   {88, 166, 240},
                                                   {250, 196, 72},
                                                   {84, 208, 140},
                                                   {190, 150, 235},
                                                   {236, 158, 140}}}};

}  // namespace turbidock::trial
