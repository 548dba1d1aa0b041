#pragma once
// Trials of a batch's file as pages show them: what pictures of them need, and their series as
// parts of the page.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/batch/result_store.h"
#include "experiments/page/report_page.h"

namespace turbidock::page {

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
  // its scenario need (trial_model.h) "model-NAME-SCENARIO". Not where none was stored, nor once
  // there was no room for one.
  bool Pack(const batch::StoredTrial& trial);

  // What a link of a report opens.
  LinkedTrial Of(int64_t trial);

 private:
  std::string SeriesPart(const batch::StoredTrial& trial) const;
  std::string ModelPart(const batch::StoredTrial& trial) const;

  const batch::ResultStore& store_;
  std::string file_, name_;
  int64_t bytes_left_;
  Page* page_;
  std::vector<int64_t> stored_;  // ascending
  std::optional<batch::Plan> plan_;
};

}  // namespace turbidock::page
