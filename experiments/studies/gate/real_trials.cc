#include "experiments/studies/gate/real_trials.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <vector>

#include "experiments/config/nearest_name.h"
#include "experiments/statistics/prediction_powered.h"
#include "experiments/system/output_path.h"
#include "sim/base/check.h"

namespace turbidock::gate {
namespace {

// A name as a spreadsheet writes it, with quotes where it has a comma.
std::string Unquoted(const std::string& cell) {
  if (cell.size() < 2 || cell.front() != '"' || cell.back() != '"') return cell;
  std::string text;
  for (size_t i = 1; i + 1 < cell.size(); ++i) {
    text += cell[i];
    if (cell[i] == '"') ++i;  // doubled inside
  }
  return text;
}

std::string Share(const statistics::Count& count) {
  return count.trials == 0 ? "-" : fmt::format("{} of {}", count.successes, count.trials);
}

}  // namespace

std::vector<statistics::Count> LoadRealTrials(const std::string& file, const Gate& gate) {
  std::vector<statistics::Count> counts(gate.conditions.size());
  std::vector<std::string> names;
  for (const Condition& condition : gate.conditions) names.push_back(condition.name);
  std::istringstream lines(system::ReadWhole(file));
  int number = 0, trials = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.ends_with('\r')) line.pop_back();
    if (line.empty()) continue;
    const auto fail = [&](const std::string& why) {
      throw ConfigError(fmt::format("{}:{}: {}", file, number, why));
    };
    if (number == 1) {
      if (line.starts_with("\xef\xbb\xbf")) line.erase(0, 3);  // as spreadsheets write
      if (line != "condition,success") fail("must begin with the columns condition,success");
      continue;
    }
    const size_t comma = line.rfind(',');
    if (comma == std::string::npos) fail("must be CONDITION,SUCCESS");
    const std::string name = Unquoted(line.substr(0, comma)), success = line.substr(comma + 1);
    const auto at = static_cast<size_t>(std::ranges::find(names, name) - names.begin());
    if (at == names.size())
      fail("'" + name + "' is no condition of the gate" + config::DidYouMean(name, names));
    if (success != "0" && success != "1") fail("success is '" + success + "', must be 1 or 0");
    ++counts[at].trials;
    counts[at].successes += success == "1";
    ++trials;
  }
  if (trials == 0) throw ConfigError(file + ": has no trial");
  return counts;
}

RealTrials WithReal(const std::vector<statistics::Count>& real, const GateReport& report) {
  RealTrials trials{.real = real, .simulated = {}, .rate = {}};
  std::vector<statistics::RealAndSimulated> counts;
  for (size_t i = 0; i < real.size(); ++i) {
    const ConditionReport& condition = report.conditions[i];
    trials.simulated.push_back({condition.successes, condition.trials});
    if (real[i].trials > 0 && condition.trials > 0)
      counts.push_back({real[i], trials.simulated.back()});
  }
  if (counts.empty()) return trials;
  trials.rate = statistics::PredictRealRate(counts);
  trials.p = statistics::RealDiffersP(counts);
  return trials;
}

report::Section RealTrialSection(const RealTrials& trials, const GateReport& report) {
  report::Table table({"<condition", "real successes", "simulated"});
  for (size_t i = 0; i < trials.real.size(); ++i)
    table.Row({report.conditions[i].condition, Share(trials.real[i]), Share(trials.simulated[i])});
  report::Section section{
      .title = "Real trials", .note = "None of a simulated condition.", .table = table};
  if (!trials.rate) return section;
  const statistics::RealRate& rate = *trials.rate;
  section.note = fmt::format(
      "Real success rate over these conditions: {} % [{}, {}], 95 %, prediction-powered "
      "(Angelopoulos et al., Science 382 (2023) 669): as sure as {:.1f} trials without the "
      "simulator, which says {} %. {} (p = {}, exact).",
      report::Digits(100 * rate.rate, 3), report::Digits(100 * rate.interval.low, 3),
      report::Digits(100 * rate.interval.high, 3), rate.worth_trials,
      report::Digits(100 * rate.simulated_rate, 3),
      trials.p < 0.05 ? "Simulator and reality differ" : "No difference of the two is shown",
      report::PValue(trials.p));
  return section;
}

report::Json RealTrialJson(const RealTrials& trials, const GateReport& report) {
  report::Json json = {{"conditions", report::Json::array()}};
  for (size_t i = 0; i < trials.real.size(); ++i)
    json["conditions"].push_back({{"condition", report.conditions[i].condition},
                                  {"real_successes", trials.real[i].successes},
                                  {"real_trials", trials.real[i].trials}});
  if (const auto& rate = trials.rate)
    json.update({{"rate", rate->rate},
                 {"low", rate->interval.low},
                 {"high", rate->interval.high},
                 {"worth_trials", rate->worth_trials},
                 {"simulated_rate", rate->simulated_rate},
                 {"p", trials.p}});
  return json;
}

}  // namespace turbidock::gate
