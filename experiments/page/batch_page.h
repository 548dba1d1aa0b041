#pragma once
// The report of many trials in one file.

#include <cstdint>
#include <string>

#include "experiments/farm/result_store.h"
#include "experiments/page/page.h"

namespace turbidock::page {

struct BatchPageOptions {
  // Stored series are packed into the page, failures first, until they have this many bytes.
  int64_t series_bytes = 2'200'000;
};

// Of a file that `turbidock batch` (or tune) wrote or is writing. What is not there (no trials yet,
// no series, columns that an older program did not know) is said in the page. `file` stands for it
// in commands.
Page BatchPage(const farm::ResultStore& store, const std::string& file,
               const BatchPageOptions& options = {});

// Of one trial in such a file, as far as its series was stored. ConfigError when it is not there.
Page StoredTrialPage(const farm::ResultStore& store, const std::string& file, int64_t trial);

// The description in a file's plan or study.
std::string TitleOf(const farm::StoreHeader& header);

}  // namespace turbidock::page
