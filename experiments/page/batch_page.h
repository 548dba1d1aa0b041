#pragma once
// The report of many trials in one file.

#include <cstdint>
#include <string>

#include "experiments/farm/result_store.h"
#include "experiments/page/page.h"
#include "experiments/trial/plugins.h"

namespace turbidock::page {

struct BatchPageOptions {
  // Stored series are packed into the page, failures first, until they have this many bytes.
  int64_t series_bytes = 2'200'000;
  trial::Plugins plugins{};  // what the trials' scenarios may choose besides ours
};

// Of a file that `turbidock batch` (or tune) wrote or is writing. What is not there (no trials yet,
// no series) is said in the page. `file` stands for it in commands.
Page BatchPage(const farm::ResultStore& store, const std::string& file,
               const BatchPageOptions& options = {});

// One of two files that are compared; `name` stands for it in commands.
struct ComparedFile {
  const farm::ResultStore& store;
  std::string name;
};

// Of what `compare --json` says about two such files, with the trials of the seeds that flipped, as
// far as their series were stored.
Page ComparisonPage(const report::Json& comparison, const ComparedFile& a, const ComparedFile& b,
                    const BatchPageOptions& options = {});

// Of one trial in such a file, as far as its series was stored. ConfigError when it is not there.
Page StoredTrialPage(const farm::ResultStore& store, const std::string& file, int64_t trial,
                     const trial::Plugins& plugins = {});

// The description in a file's plan or study.
std::string TitleOf(const farm::StoreHeader& header);

}  // namespace turbidock::page
