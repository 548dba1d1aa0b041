#pragma once
// A comparison as a page.

#include <cstdint>

#include "experiments/page/page.h"
#include "experiments/studies/compare/comparison.h"

namespace turbidock::compare {

// The report, in which a seed that changed opens its trials in both sets, with so many bytes of
// their stored series.
page::Page PageOf(const Comparison& comparison, const ComparedFile& a, const ComparedFile& b,
                  int64_t series_bytes = 2'200'000);

}  // namespace turbidock::compare
