#pragma once
// The report of many trials in one file.

#include <cstdint>
#include <string>

#include "experiments/batch/batch_report.h"
#include "experiments/batch/result_store.h"
#include "experiments/page/page.h"
#include "experiments/trial/plugins.h"

namespace turbidock::page {

struct BatchPageOptions {
  // Stored series are packed into the page, failures first, until they have this many bytes.
  int64_t series_bytes = 2'200'000;
  trial::Plugins plugins{};            // what the trials' scenarios may choose besides ours
  batch::BatchReportOptions report{};  // none of its keys: by the plan's grid
};

// Of a file that `turbidock batch` (or tune) wrote or is writing. What is not there (no trials yet,
// no series) is said in the page. `file` stands for it in commands.
Page BatchPage(const batch::ResultStore& store, const std::string& file,
               const BatchPageOptions& options = {});

}  // namespace turbidock::page
