#pragma once
// What a study leaves: gains to use, and the evidence.

#include <string>

#include "experiments/report/json.h"
#include "experiments/report/report.h"
#include "experiments/studies/tuning/study.h"
#include "experiments/studies/tuning/tuner.h"
#include "experiments/system/output_path.h"

namespace turbidock::tuning {

inline constexpr system::FileKind kGainsFile = {"gains file of tune",
                                                "# Found by `turbidock tune`"};

// A gains file for `run --gains`: the controller, its whole group, and every other tuned key.
std::string GainsYaml(const Study& study, const TuningResult& result);

// What the study found, or has found so far where it is not finished.
report::Report ReportOf(const Study& study, const TuningResult& result);

// The same in numbers, SI units, for the report's document (report/report_json.h).
report::Json TuningJson(const Study& study, const TuningResult& result);

}  // namespace turbidock::tuning
