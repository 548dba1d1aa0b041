#pragma once
// The page of a comparison: its report, in which a seed that flipped opens its trials in both sets.

#include "experiments/page/page.h"
#include "experiments/studies/compare/comparison.h"
#include "experiments/trial/plugins.h"

namespace turbidock::compare {

struct ComparisonPageOptions {
  int64_t series_bytes = 2'200'000;  // of the trials' stored series, half for each set
  trial::Plugins plugins = {};       // what their scenarios may choose besides ours
};

page::Page PageOf(const Comparison& comparison, const ComparedFile& a, const ComparedFile& b,
                  const ComparisonPageOptions& options = {});

}  // namespace turbidock::compare
