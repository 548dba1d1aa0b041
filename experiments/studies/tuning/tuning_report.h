#pragma once
// What a tuning run leaves: gains to use, the evidence, and its pictures.

#include <string>

#include "experiments/studies/tuning/study.h"
#include "experiments/studies/tuning/tuner.h"
#include "experiments/system/output_path.h"

namespace turbidock::tuning {

inline constexpr system::FileKind kGainsFile = {"gains file of tune",
                                                "# Found by `turbidock tune`"};

// A gains file for `run --gains`: the law, its whole group, and every other tuned key.
std::string GainsYaml(const Study& study, const TuningResult& result);

// Everything, SI units.
std::string TuningJson(const Study& study, const TuningResult& result);

// The same for people, Markdown.
std::string TuningMarkdown(const Study& study, const TuningResult& result);

// Cost over the generations; how each gain moved; each gain's sensitivity; with nsga2 the front.
void WriteTuningFigure(const std::string& path, const Study& study, const TuningResult& result);

}  // namespace turbidock::tuning
