#pragma once
// Ranges of a plan and what is looked for in them: where success crosses a rate.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "experiments/search/boundary_search.h"
#include "sim/base/fields.h"

namespace turbidock::config {
struct YamlNode;
}

namespace turbidock::batch {

enum class Scale { kLinear, kLogarithmic };
constexpr auto Names(Scale) {
  using enum Scale;
  return EnumList<Scale>({{kLinear, "linear"}, {kLogarithmic, "logarithmic"}});
}

// A key of the scenario and the values between which it is varied.
struct RangeKey {
  std::string key{};
  double from = 0, to = 0;
  Scale scale = Scale::kLinear;
  search::Trend success = search::Trend::kUnknown;  // towards `to`

  // The value at a place in [0, 1] of the range, in 6 significant digits.
  double At(double place) const;

  static void Fields(auto& self, auto&& field) {
    field("from", self.from, Finite(), "first value of the range");
    field("to", self.to, Finite(), "last value of the range");
    field("scale", self.scale, Finite(), "spacing of the range's values");
    field("success", self.success, Finite(),
          "whether success falls or rises from the first value to the last, which takes fewer "
          "trials; unknown: may do both");
  }
};

struct FindSettings {
  double rate = 0.9;
  double width = 0.1;
  int64_t trials = 5000;

  static void Fields(auto& self, auto&& field) {
    field("rate", self.rate, InRange(0.01, 0.99),
          "success rate of which the boundary is looked for");
    field(
        "width", self.width, InRange(0.005, 0.5),
        "share of the ranges that may stay undecided, on neither side with 95 %: of one range, how "
        "wide its boundary's band may be");
    field(
        "trials", self.trials, InRange(100, 100'000),
        "the search ends with the round in which it has run so many trials, if not before, of each "
        "combination of cases and grid");
  }
};

// Trials that a cell of the lattice has at most; their numbers are kept free.
inline constexpr int64_t kMostOfCell = 1000;

// What a plan looks for: cells on a lattice over its ranges.
struct EnvelopePlan {
  std::vector<RangeKey> ranges = {};
  FindSettings find = {};

  search::BoundarySearch Search() const;
  int64_t points() const { return Search().lattice.cells(); }
};

// Of a plan that has ranges; nothing of any other. ConfigError for what is wrong with them.
std::optional<EnvelopePlan> ReadEnvelope(const config::YamlNode& plan);

}  // namespace turbidock::batch
