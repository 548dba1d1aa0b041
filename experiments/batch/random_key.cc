#include "experiments/batch/random_key.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "experiments/config/yaml_fields.h"
#include "experiments/statistics/sampling.h"

namespace turbidock::batch {
namespace {

std::pair<double, double> Pair(const config::YamlNode& at, const char* names) {
  try {
    const auto [first, second] =
        config::Peek({.assignments = {"pair=" + at.OneLine()}}, "pair", std::array<double, 2>{});
    return {first, second};
  } catch (const ConfigError&) {
    at.Fail(std::string("must be two numbers, [") + names + "]");
  }
}

}  // namespace

RandomKey RandomKey::Read(const std::string& key, const config::YamlNode& distribution) {
  constexpr auto& kKinds = EnumNames<Kind>::kNames;
  RandomKey random;
  random.key = key;
  random.text = distribution.OneLine();
  bool has_kind = false;
  for (const auto& [word, value] : distribution.Entries()) {
    if (word == "within") {
      random.within = Pair(value, "low, high");
      if (random.within->first >= random.within->second) value.Fail("low must be below high");
      continue;
    }
    const auto kind = std::find_if(kKinds.begin(), kKinds.end(), [&name = word](const auto& known) {
      return known.second == name;
    });
    if (kind == kKinds.end() || has_kind)
      value.Fail("must be one of uniform, normal, log_uniform, choice");
    has_kind = true;
    random.kind = kind->first;
    if (random.kind == Kind::kChoice) {
      for (const config::YamlNode& choice : value.Elements())
        random.choices.push_back(choice.OneLine());
      if (random.choices.empty()) value.Fail("must be a list of values");
      continue;
    }
    const bool is_normal = random.kind == Kind::kNormal;
    std::tie(random.first, random.second) =
        Pair(value, is_normal ? "mean, standard deviation" : "low, high");
    if (is_normal && random.second <= 0) value.Fail("the standard deviation must be > 0");
    if (!is_normal && random.first >= random.second) value.Fail("low must be below high");
    if (random.kind == Kind::kLogUniform && random.first <= 0) value.Fail("low must be > 0");
  }
  if (!has_kind) distribution.Fail("must be one of uniform, normal, log_uniform, choice");
  if (random.within && random.kind != Kind::kNormal)
    distribution.Fail("only a normal distribution has `within`");
  // beyond that next to nothing is left to draw from
  constexpr double kFarthest = 5;  // standard deviations
  if (random.within && (random.within->first > random.first + kFarthest * random.second ||
                        random.within->second < random.first - kFarthest * random.second))
    distribution.Fail("`within` is more than 5 standard deviations from the mean");
  return random;
}

std::string RandomKey::ValueAt(double u) const {
  switch (kind) {
    case Kind::kUniform:
      return FormatNumber(statistics::UniformAt(u, first, second));
    case Kind::kLogUniform:
      return FormatNumber(statistics::LogUniformAt(u, first, second));
    case Kind::kNormal:
      return FormatNumber(
          within ? statistics::NormalAt(u, first, second, within->first, within->second)
                 : statistics::NormalAt(u, first, second));
    case Kind::kChoice:
      break;
  }
  return choices[static_cast<size_t>(u * static_cast<double>(choices.size()))];
}

}  // namespace turbidock::batch
