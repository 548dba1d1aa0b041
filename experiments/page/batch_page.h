#pragma once
// The report of many trials in one file; and trials of such a file as other pages show them: what
// pictures of them need, and their series as parts of the page.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/batch_report.h"
#include "experiments/batch/plan.h"
#include "experiments/batch/result_store.h"
#include "experiments/page/report_page.h"
#include "experiments/trial/plugins.h"

namespace turbidock::page {

struct BatchPageOptions {
  // Stored series are packed into the page, failures first, until they have this many bytes.
  int64_t series_bytes = 3'300'000;
  trial::Plugins plugins{};            // what the trials' scenarios may choose besides ours
  batch::BatchReportOptions report{};  // none of its keys: by the plan's grid
};

// Of a file that `turbidock batch` (or tune) wrote or is writing. What is not there (no trials yet,
// no series) is said in the page. `file` stands for it in commands.
Page BatchPage(const batch::ResultStore& store, const std::string& file,
               const BatchPageOptions& options = {});

class StoredTrials {
 public:
  // `name` begins titles of trials ("A") and is part of the names of the page's parts. Series are
  // packed until they have so many bytes. What cannot be shown is said in page.model["missing"].
  StoredTrials(const batch::ResultStore& store, std::string file, std::string name,
               int64_t series_bytes, const trial::Plugins& plugins, Page* page);

  // None of a file that is no batch's or that this program does not understand.
  const std::optional<batch::Plan>& plan() const { return plan_; }

  // How many trials have a series, packed or not.
  size_t count() const { return stored_.size(); }

  // Makes the trial's series the part "series-NAME-TRIAL" of the page and, once, what pictures of
  // its scenario need (trial_page.h) "model-NAME-SCENARIO". Not where none was stored, nor once
  // there was no room for one.
  bool Pack(const batch::StoredTrial& trial);

  // What a link of a report opens.
  LinkedTrial Of(int64_t trial);

 private:
  std::string SeriesPart(const batch::StoredTrial& trial) const;
  std::string ModelPart(const batch::StoredTrial& trial) const;

  const batch::ResultStore& store_;
  std::string file_, name_, replay_;
  int64_t bytes_left_;
  Page* page_;
  std::vector<int64_t> stored_;  // ascending
  std::optional<batch::Plan> plan_;
};

}  // namespace turbidock::page
