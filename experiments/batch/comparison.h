#pragma once
// Two sets of trials, A and B, pair by pair: the one comparison behind `gate`, which decides while
// trials run, `compare`, which looks at two files, and the proof of tuned gains.
//
//   PairedTrials pairs(options);              // without options: no verdicts
//   pairs.Add(TrialOf(before), TrialOf(now));  // in the order of the samples
//   for (const Change& change : pairs.Changes("calm")) ...

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/batch/store_header.h"
#include "experiments/report/report.h"
#include "experiments/statistics/paired_measure.h"
#include "experiments/trial/trial_record.h"
#include "sim/base/fields.h"
#include "sim/base/result_fields.h"

namespace turbidock::batch {

// What is compared besides the success rate, of pairs that succeed on both sides: the list that
// margins, baselines and tables follow. Label and unit are the name's (report::QuantityOf).
struct Measure {
  const char* name;
  double (*of)(const trial::TrialRecord& record);  // NaN: the trial has none
  const char* margin;                              // the key's meaning in Margins
  double worse = 1;                                // the sign of a change for the worse
};
inline constexpr auto kMeasures = std::to_array<Measure>(
    {{"time_s", [](const auto& r) { return r.time_s; },
      "rise of the median time to docking that matters; 0: not judged"},
     {"final_error_m", [](const auto& r) { return r.final_error_true.distance_m(); },
      "rise of the median true final error that matters; 0: not judged"},
     {"tracking_rms_m", [](const auto& r) { return r.tracking_rms_m; },
      "rise of the median tracking error that matters; 0: not judged"},
     {"returns_to_servoing",
      [](const auto& r) { return static_cast<double>(r.returns_to_servoing); },
      "number of returns to servoing by which the median's rise matters; 0: not judged"},
     {"fitness_mean", [](const auto& r) { return r.fitness_mean; },
      "fall of the median of the mean fitness F that matters; 0: not judged", -1},
     {"effort_v", [](const auto& r) { return r.effort_v; },
      "rise of the median effort that matters; 0: not judged"},
     {"false_confidence_s", [](const auto& r) { return r.false_confidence_s; },
      "rise of the median time of false confidence that matters; 0: not judged"}});
using MeasuredValues = std::array<double, kMeasures.size()>;
inline constexpr const char *kSuccessRate = "success_rate", *kArea = "area";

// What a comparison needs of a trial.
struct ComparedTrial {
  int64_t seed = 0;
  trial::Outcome outcome = trial::Outcome::kTimeout;
  int64_t trial = -1;                  // its number, where a plan with ranges chose it
  MeasuredValues values = NoValues();  // of kMeasures; NaN: not measured
  std::string digest{};

  bool success() const { return outcome == trial::Outcome::kSuccess; }
  static constexpr MeasuredValues NoValues() {
    MeasuredValues none{};
    none.fill(std::numeric_limits<double>::quiet_NaN());
    return none;
  }

  static void Fields(auto& self, auto&& field) {
    constexpr bool kReads = !std::is_const_v<std::remove_reference_t<decltype(self)>>;
    if (kReads || self.trial >= 0) field("trial", self.trial, AtLeast(0), "");
    field("seed", self.seed, AtLeast(0), "");
    field("outcome", self.outcome, Finite(), "");
    for (size_t i = 0; i < kMeasures.size(); ++i)  // what was not measured is left out
      if (kReads || !std::isnan(self.values[i]))
        field(kMeasures[i].name, self.values[i], Finite(), "");
    field("digest", self.digest, Finite(), "");
  }
};
ComparedTrial TrialOf(const trial::TrialRecord& record);

// Of error rates and of what a success rate may lose: what the tests are exact for.
inline Range TestedProbability() {
  return InRange(statistics::kLeastProbability, 1 - statistics::kLeastProbability);
}

// The changes for the worse that matter. Zero: not judged.
struct Margins {
  double success_rate = 0.1;
  double area = 0;           // of a plan's ranges; above 0 success_rate follows from it
  MeasuredValues medians{};  // of kMeasures; none negative, also where less is worse

  static void Fields(auto& self, auto&& field) {
    field(kSuccessRate, self.success_rate, TestedProbability(),
          "loss of success rate, as a share of the trials, that matters");
    field(kArea, self.area, InRange(0, 1),
          "share of a plan's ranges whose loss, from where success is above the rate, matters");
    for (size_t i = 0; i < kMeasures.size(); ++i)
      field(kMeasures[i].name, self.medians[i], AtLeast(0), kMeasures[i].margin);
  }
  int tests() const;  // how many measures are judged
};

// How trials are judged while they run.
struct JudgeOptions {
  double alpha = 0.05, beta = 0.05;  // of each measure's test
  int max_trials = 100;
  Margins margins{};
};

// One measure over the pairs of a group: the success rate, or a median of those that succeed on
// both sides.
struct Change : statistics::PairedResult {
  std::string group{};  // "sea.state=calm", or "all"
  std::string measure{};
  bool significant = false;             // without a margin: see MarkSignificant
  std::vector<Parameter> parameters{};  // those of the group

  bool is_rate() const { return measure == kSuccessRate; }
  static void Fields(auto& self, auto&& field) {
    field("group", self.group);
    field("measure", self.measure);
    self.statistics::PairedResult::VisitFields(field);
    if (!self.margin) field("significant", self.significant);
  }
};

class PairedTrials {
 public:
  explicit PairedTrials(const std::optional<JudgeOptions>& options = {});

  // The next pair. Ignored once done.
  void Add(const ComparedTrial& a, const ComparedTrial& b);
  int64_t pairs() const { return pairs_; }
  // Something is worse, everything is known, or the trials allowed are spent.
  bool done() const;
  // The worst of the measures'; nothing without options.
  std::optional<statistics::Verdict> verdict() const;
  // The success rate first, then medians: with options those that are judged, else those that a
  // pair has.
  std::vector<Change> Changes(const std::string& group) const;

 private:
  struct Median {
    size_t of;  // kMeasures
    statistics::PairedMeasure pairs;
  };

  int64_t pairs_ = 0, max_trials_ = std::numeric_limits<int64_t>::max();
  statistics::PairedMeasure rate_;
  std::vector<Median> medians_;
};

// Marks what is significant among these rows: 5 % over all rates, which are one family of tests,
// and over all medians, another (Holm).
void MarkSignificant(std::vector<Change>* changes);

// Succeeded in A only, in B only; ended in B as none may, and did not succeed in A either.
enum class FlipKind { kLost, kGained, kForbidden };
constexpr auto Names(FlipKind) {
  using enum FlipKind;
  return EnumList<FlipKind>({{kLost, "lost"}, {kGained, "gained"}, {kForbidden, "forbidden"}});
}

// A pair that ended otherwise in B than in A.
struct Flip {
  int64_t seed = 0;
  FlipKind change = FlipKind::kLost;
  std::string group;  // where: a condition, or the pair's parameters for people
  std::string why;    // of the side that failed
  std::string link;   // what opens it in a page
  std::optional<int64_t> trial_a{}, trial_b{};  // their numbers, where they have one

  TURBIDOCK_FIELDS(seed, change, group, why, link, trial_a, trial_b)
};

// A measure's name and unit for people, such as "success, %".
report::Quantity QuantityOf(const std::string& measure);

// "sea state calm, water milk 20 ml/m3" of parameters.
std::string Named(const std::vector<Parameter>& parameters);

// The tables of a comparison: a row a change, those that count first; and a row a seed.
report::Section ChangeSection(std::vector<Change> changes, const Sides& sides);
report::Section FlipSection(const std::vector<Flip>& flips, const Sides& sides);

}  // namespace turbidock::batch
