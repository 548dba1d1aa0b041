#pragma once
// Trials of a batch's file as pages show them: what pictures of them need, and their series as
// parts of the page.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/farm/plan.h"
#include "experiments/farm/result_store.h"
#include "experiments/page/report_page.h"

namespace turbidock::page {

// Packs series into a page until they have so many bytes.
class SeriesPacker {
 public:
  SeriesPacker(const farm::ResultStore& store, int64_t bytes, Page* page);

  // Makes the trial's series the part `name` of the page. Not where none was stored, nor once there
  // was no room for one.
  bool Pack(int64_t trial, const std::string& name);

  bool IsStored(int64_t trial) const;
  size_t stored() const { return stored_.size(); }

 private:
  const farm::ResultStore& store_;
  int64_t bytes_left_;
  Page* page_;
  std::vector<int64_t> stored_;  // ascending
};

// The scenario's name of a trial of a plan with several; empty where there is one.
std::string ScenarioNameOf(const farm::StoredTrial& trial);

// What pictures of the trial need (trial_model.h), which all of its scenario share.
report::Json PictureModel(const farm::Plan& plan, const farm::StoredTrial& trial);

// What links of a report open of a file's trials.
class TrialLinks {
 public:
  // `name` begins the titles ("A") and is part of the names of the page's parts. What cannot be
  // shown is said on the page.
  TrialLinks(const farm::ResultStore& store, std::string file, std::string name,
             int64_t series_bytes, const trial::Plugins& plugins, Page* page);

  LinkedTrial Of(int64_t trial);

 private:
  // The name of the part with the model of the trial's scenario.
  std::string ModelPart(const farm::StoredTrial& trial);

  const farm::ResultStore& store_;
  std::string file_, name_;
  Page* page_;
  SeriesPacker series_;
  std::optional<farm::Plan> plan_;  // none where this program does not understand it
};

}  // namespace turbidock::page
