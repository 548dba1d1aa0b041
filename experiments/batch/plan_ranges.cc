#include "experiments/batch/plan_ranges.h"

#include <array>
#include <cmath>
#include <cstdlib>

#include "experiments/config/yaml_fields.h"

namespace turbidock::batch {
namespace {

constexpr std::array kValues{41, 21, 11};  // of a range, by how many there are

RangeKey ReadRange(const std::string& key, const config::YamlNode& node) {
  RangeKey range{.key = key};
  if (!node.IsMap() || !node.Find("from") || !node.Find("to"))
    node.Fail("must have the keys `from` and `to`");
  config::Origins origins;
  config::ReadFields(node, &range, &origins);
  config::CheckSettings(range, origins, node.path);
  if (range.from == range.to) node.Find("to")->Fail("must differ from `from`");
  if (range.scale == Scale::kLogarithmic && !(range.from > 0 && range.to > 0))
    node.Fail("both ends must be > 0 on a logarithmic scale");
  constexpr int kSteps = kValues[0] - 1;
  for (int i = 0; i < kSteps; ++i)
    if (range.At(i / (1.0 * kSteps)) == range.At((i + 1) / (1.0 * kSteps)))
      node.Find("to")->Fail("is so near to `from` that values between them are equal in 6 digits");
  return range;
}

}  // namespace

double RangeKey::At(double place) const {
  if (place <= 0 || place >= 1) return place <= 0 ? from : to;
  const double value =
      scale == Scale::kLinear ? from + (to - from) * place : from * std::pow(to / from, place);
  constexpr double kDigits = 6;
  if (value == 0) return 0;
  const double unit = std::pow(
      10,
      kDigits - 1 - std::floor(std::log10(std::max(std::abs(value), 1e-9 * std::abs(to - from)))));
  return std::round(value * unit) / unit;
}

search::BoundarySearch EnvelopePlan::Search() const {
  search::BoundarySearch search{
      .rate = find.rate, .width = find.width, .most = find.trials, .most_of_cell = kMostOfCell};
  for (const RangeKey& range : ranges)
    search.lattice.axes.push_back({kValues.at(ranges.size() - 1), range.success});
  return search;
}

std::optional<EnvelopePlan> ReadEnvelope(const config::YamlNode& plan) {
  const auto ranges = plan.Find("ranges"), find = plan.Find("find");
  if (!ranges && find) find->Fail("goes with `ranges`, which this plan does not have");
  if (!ranges) return std::nullopt;
  if (!find) ranges->Fail("go with `find`: {rate: 0.9, width: 0.1}");
  for (const char* key : {"precision", "strata"})
    if (const auto given = plan.Find(key); given && given->Canonical() != "0")
      given->Fail("does not go with `ranges`, whose trials `find` chooses");
  EnvelopePlan envelope;
  for (const auto& [key, node] : ranges->Entries()) envelope.ranges.push_back(ReadRange(key, node));
  if (envelope.ranges.empty() || envelope.ranges.size() > kValues.size())
    ranges->Fail("must be one to three keys");
  config::Origins origins;
  config::ReadFields(*find, &envelope.find, &origins);
  config::CheckSettings(envelope.find, origins, "find");
  return envelope;
}

}  // namespace turbidock::batch
