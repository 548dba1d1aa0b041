// What is wrong with a plan's trials, or changes none of them, before any is run.

#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <numeric>

#include "experiments/batch/plan.h"
#include "experiments/trial/switched_off.h"

namespace turbidock::batch {

// Whether its value of each range is one that the plan gives: `from` or `to`.
bool Plan::IsAtEnds(int64_t cell) const {
  for (size_t i = 0; i < envelope_->ranges.size(); ++i) {
    const int64_t n = std::ssize(grid_[grid_.size() - 1 - i].values), at = cell % n;
    if (at != 0 && at != n - 1) return false;
    cell /= n;
  }
  return true;
}

void Plan::CheckDraws() {
  for (size_t i = 0; i < random_.size(); ++i)
    for (const auto& [name, scenario] : scenarios_) {
      random_[i].RequireAllowed(scenario, distributions_[i]);
      if (const std::string remark = random_[i].RemarkOn(scenario); !remark.empty())
        remarks_.push_back(remark);
    }
}

void Plan::CheckTrials(const std::string& file, bool sees_images) {
  // Without draws the trials of a cell's stratum differ in nothing but the seed.
  constexpr int64_t kMostDrawn = 10'000;  // a second's work
  const int64_t strata = std::max<int64_t>(1, std::ssize(strata_));
  const int64_t drawn = random_.empty() ? 0 : std::min(kMostDrawn / cells_, samples_);
  trial::IdleKeys idle(sees_images);
  std::vector<int64_t> cells(static_cast<size_t>(cells_));
  std::iota(cells.begin(), cells.end(), 0);
  // errors then name values that the file has
  if (envelope_)
    std::stable_partition(cells.begin(), cells.end(), [this](int64_t c) { return IsAtEnds(c); });
  for (const int64_t cell : cells)
    for (int64_t sample = 0; sample < std::max(strata, drawn); ++sample) {
      const TrialSpec spec = Trial(NumberOf(cell, sample));
      try {
        const trial::Scenario scenario = ScenarioOf(spec);
        if (scenario.model_files.empty()) AddFiles(scenario);
        code_.insert(scenario.plugins.CodeInUse());
        for (const std::string& remark : scenario.given.remarks)
          if (std::ranges::count(remarks_, remark) == 0) remarks_.push_back(remark);
        idle.Look(scenario);
      } catch (const ConfigError& error) {
        const std::string what = error.what();
        if (what.starts_with(file + ":") || what.starts_with(config::kFromSet)) throw;
        std::vector<std::string> given;
        for (const Parameter& parameter : spec.parameters) given.push_back(parameter.Assignment());
        throw ConfigError(
            fmt::format("{}: trial {}{}: {}", file, spec.trial,
                        given.empty() ? "" : fmt::format(" ({})", fmt::join(given, ", ")), what));
      }
    }
  std::ranges::move(idle.Remarks(), std::back_inserter(remarks_));
  CheckDraws();
}

}  // namespace turbidock::batch
