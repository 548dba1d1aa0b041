#include "experiments/batch/batch_report.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "experiments/batch/envelope.h"
#include "experiments/batch/failure_effects.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/report/table.h"
#include "experiments/statistics/paired_tests.h"
#include "experiments/system/plain_text.h"
#include "sim/base/units.h"

namespace turbidock::batch {
namespace {

using report::Json;

// The file's plan or study; nothing where it cannot be read.
std::optional<config::YamlNode> PlanIn(const StoreHeader& header) {
  try {
    return config::ParseYaml(header.plan, "plan");
  } catch (const ConfigError&) {
    return std::nullopt;
  }
}

std::string TitleOf(const StoreHeader& header) {
  const auto plan = PlanIn(header);
  const auto description = plan ? plan->Find("description") : std::nullopt;
  const std::string text = description ? description->Text().value_or("") : "";
  return text.empty() ? header.kind : text;
}

bool IsBatch(const BatchSummary& summary) { return summary.header.kind == "batch"; }

constexpr size_t kMostCells = 60;
constexpr size_t kMostOver = 40;   // values along an axis that are chosen without being asked for
constexpr size_t kMostCurves = 8;  // that can be told apart

// Draws success over the first key of the grid that is a number, by what was asked for, or by the
// next one of few values.
void ChooseAxes(const std::vector<StoredTrial>& trials, BatchSummary* summary) {
  std::vector<std::string>& by = summary->curves_by;
  const bool is_by_given = !by.empty();
  for (const std::string& key : GridOf(summary->header)) {
    const std::vector<GroupSummary> values = Summarise(trials, {key});
    const bool is_number = std::ranges::all_of(
        values, [](const auto& group) { return report::NumberIn(group.group[0]).has_value(); });
    if (values.size() < 2) continue;
    if (summary->over.empty() && is_number && values.size() <= kMostOver)
      summary->over = key;
    else if (by.empty() && values.size() <= kMostCurves)
      by = {key};
  }
  if (is_by_given) std::erase(by, summary->over);
}

void AddCurves(const std::vector<StoredTrial>& trials, const BatchReportOptions& options,
               BatchSummary* summary) {
  for (const std::string& key : options.by)
    if (std::ranges::count(summary->header.keys, key) > 0) summary->curves_by.push_back(key);
  if (options.over.empty()) ChooseAxes(trials, summary);
  if (summary->over.empty()) return;
  summary->curves = SuccessCurves(trials, summary->over, summary->curves_by);
  if (options.over.empty() && summary->curves.size() > kMostCurves) summary->curves.clear();
  for (const std::string& key : GridOf(summary->header))
    if (key != summary->over && std::ranges::count(summary->curves_by, key) == 0 &&
        Summarise(trials, {key}).size() > 1)
      summary->pooled.push_back(NameOfKey(key).label);
}

// How many trials a gate or a tuning run will have, its file does not say.
bool IsComplete(const BatchSummary& summary) {
  return IsBatch(summary) && summary.trials > 0 && summary.scheduler.complete();
}

report::Verdict StateOf(const BatchSummary& summary) {
  const StoreHeader& header = summary.header;
  std::string reason =
      fmt::format("{}: {}, plan {}, written by {}{}.", system::OneLineOf(summary.file), header.kind,
                  header.plan_hash(), header.build,
                  header.shard.count > 1 ? ", shard " + header.shard.Text() : "");
  if (IsComplete(summary) && summary.envelope)
    return {summary.envelope->lines.front(), report::Tone::kNone, reason + " Complete."};
  if (IsComplete(summary))
    return {fmt::format("{:.0f} % succeed [{:.0f} to {:.0f}]", 100 * summary.all.rate(),
                        100 * summary.all.wilson.low, 100 * summary.all.wilson.high),
            report::Tone::kNone, reason + " Complete."};
  if (summary.running) return {"running", report::Tone::kNone, reason};
  if (!IsBatch(summary)) return {"not running", report::Tone::kNone, reason};
  return {summary.trials == 0 ? "empty" : "partial", report::Tone::kNone,
          reason + " Not running: start it again to finish it."};
}

std::string TrialsText(const BatchSummary& summary) {
  const TrialScheduler& scheduler = summary.scheduler;
  if (!IsBatch(summary)) return std::to_string(summary.trials);
  // of a plan that asked for more before
  const int64_t more = summary.trials - scheduler.done();
  return DoneText(scheduler.done(), scheduler.wanted(), scheduler.most()) +
         (more > 0 ? fmt::format(", {} more not asked for", more) : "");
}

std::string RateText(const GroupSummary& all) {
  return fmt::format("{:.0f} % [{:.0f}, {:.0f}]", 100 * all.rate(), 100 * all.wilson.low,
                     100 * all.wilson.high);
}

int64_t BoundariesKnown(const BatchSummary& summary) {
  if (!summary.envelope) return 0;
  const Json& envelopes = summary.envelope_json.at("envelopes");
  return std::ranges::count_if(envelopes,
                               [](const Json& of) { return of.at("reached").get<bool>(); });
}

std::vector<report::Fact> FactsOf(const BatchSummary& summary) {
  const TrialScheduler& scheduler = summary.scheduler;
  const GroupSummary& all = summary.all;
  std::vector<report::Fact> facts = {{"trials", TrialsText(summary)}};
  if (summary.rule.precision)
    facts.push_back(
        {"precision", fmt::format("{:g} % in {} of {} cells", 100 * *summary.rule.precision,
                                  scheduler.reached(), scheduler.cells())});
  if (summary.rule.search)
    facts.push_back({"boundaries",
                     fmt::format("{} of {} known to {:g} % of the ranges", BoundariesKnown(summary),
                                 scheduler.cells(), 100 * summary.rule.search->width)});
  if (all.trials == 0) return facts;
  if (!summary.rule.search)  // trials stand where about half of them fail
    facts.push_back({"success", RateText(all), "interval: " + IntervalText({all})});
  if (all.successes > 0)
    facts.push_back({"time to dock", report::Fixed(all.time_to_dock_s.median, 1) + " s", "median"});
  const auto mm = [](const Spread& spread) {
    return report::Fixed(spread.median ? units::MmFromM(*spread.median) : spread.median, 1);
  };
  if (all.error_true_y_m.median)
    facts.push_back({"true error when docked",
                     fmt::format("y {}, z {} mm", mm(all.error_true_y_m), mm(all.error_true_z_m)),
                     "medians"});
  if (all.false_confidence_s)
    facts.push_back({"false confidence", report::Fixed(*all.false_confidence_s, 2) + " s",
                     "a trial, mean: what the estimate was sure of and was not so"});
  facts.push_back({"failures", all.failures.empty() ? "none" : FailureText(all)});
  return facts;
}

std::string LeastDifferenceText(const BatchSummary& summary) {
  const GroupSummary& least = *std::ranges::min_element(summary.groups, {}, &GroupSummary::trials);
  const double p = summary.all.rate();
  const auto seen = statistics::LeastDifferenceSeen(least.trials, 2 * p * (1 - p));
  const std::string two =
      fmt::format("Two {} of {} trial{}", summary.groups.size() > 1 ? "groups" : "such batches",
                  least.trials, least.trials == 1 ? "" : "s");
  return fmt::format(
      "{} with 80 % power (McNemar's test at 5 %, as if no seeds were common).",
      seen ? fmt::format("{} must differ in success by {:.0f} percentage points to be told apart",
                         two, 100 * *seen)
           : fmt::format("{} cannot be told apart by success", two));
}

// What a batch of this size and plan could not have told.
report::Section LimitsSection(const BatchSummary& summary) {
  report::Section section{.title = "What it could not tell", .lines = {}};
  // groups by how trials ended are no conditions to be told apart
  if (std::ranges::all_of(summary.keys, [&](const std::string& key) {
        return std::ranges::count(summary.header.keys, key) > 0;
      }))
    section.lines.push_back(LeastDifferenceText(summary));
  if (const auto rest = NotVaried(summary.header); !rest.empty())
    section.lines.push_back(fmt::format("Not varied: {}.", fmt::join(rest, ", ")));
  return section;
}

}  // namespace

std::vector<std::string> GridOf(const StoreHeader& header) {
  std::vector<std::string> keys;
  const auto plan = header.is_of_plan() ? PlanIn(header) : std::nullopt;
  if (!plan) return keys;
  if (plan->Find("cases")) keys.emplace_back("case");
  if (const auto grid = plan->Find("grid"))
    for (const auto& [key, values] : grid->Entries()) keys.push_back(key);
  return keys;
}

std::vector<std::string> NotVaried(const StoreHeader& header) {
  const auto plan = PlanIn(header);
  if (!plan) return {};
  std::vector<std::string> rest = {"vehicle", "station", "sea",     "water",
                                   "lights",  "cameras", "control", "faults"};
  const auto vary = [&rest](const config::YamlNode& keys) {
    for (const auto& [key, values] : keys.Entries())
      std::erase(rest, key.substr(0, key.find_first_of(".[")));
  };
  bool scenarios = false;
  const auto look_at = [&](const config::YamlNode& keys) {
    vary(keys);
    scenarios |= keys.Find("scenario").has_value();
  };
  for (const char* part : {"grid", "ranges", "random"})
    if (const auto keys = plan->Find(part)) look_at(*keys);
  for (const char* part : {"cases", "strata"})
    if (const auto cases = plan->Find(part))
      for (const auto& [name, keys] : cases->Entries()) look_at(keys);
  if (scenarios) rest.emplace_back("but for what its scenarios differ in");
  for (std::string& name : rest) name = report::Words(name);
  return rest;
}

BatchSummary SummaryOf(const ResultStore& store, const std::string& file,
                       const BatchReportOptions& options) {
  const std::vector<StoredTrial> trials = store.Trials();
  std::vector<std::string> keys = options.by;
  if (keys.empty() && options.over.empty()) {
    keys = GridOf(store.header());
    if (Summarise(trials, keys).size() > kMostCells) keys.clear();
  }
  if (!options.over.empty()) {
    if (std::ranges::count(keys, options.over) != 0)
      throw ConfigError("--by " + options.over + ": is what success is drawn over");
    keys.push_back(options.over);
  }
  BatchSummary summary{.file = file,
                       .title = TitleOf(store.header()),
                       .header = store.header(),
                       .running = IsLocked(file),
                       .rule = RuleOf(store.header()),
                       .scheduler = SchedulerOf(store),
                       .trials = std::ssize(trials),
                       .keys = keys,
                       .groups = Summarise(trials, keys),
                       .over = options.over};
  if (trials.empty()) return summary;
  summary.all = Summarise(trials, {})[0];
  if (summary.header.is_of_plan()) summary.failures = FailureSection(FailureEffects(trials));
  if (const auto envelopes = EnvelopesOf(summary.header, trials)) {
    summary.envelope = EnvelopeSection(*envelopes);
    summary.envelope_json = EnvelopeJson(*envelopes);
  }
  AddCurves(trials, options, &summary);
  // Who tells so may be the one who just ran the last trial and holds the file still.
  if (IsComplete(summary)) summary.running = false;
  return summary;
}

report::Report ReportOf(const BatchSummary& summary) {
  report::Report report{.kind = summary.header.kind,
                        .title = summary.title,
                        .build = summary.header.build,
                        .verdict = StateOf(summary),
                        .facts = FactsOf(summary)};
  if (summary.trials == 0) report.missing.emplace_back("No trials: none was stored yet");
  if (summary.envelope) report.sections.push_back(*summary.envelope);
  if (!summary.curves.empty()) {
    report.sections.push_back(SuccessSection(summary.over, summary.curves_by, summary.curves));
    if (!summary.pooled.empty())
      report.sections.back().note +=
          fmt::format(" Each point pools all values of {}.", fmt::join(summary.pooled, ", "));
  }
  if (!summary.groups.empty())
    report.sections.push_back(GroupSection(summary.keys, summary.groups, summary.rule.precision));
  if (summary.trials > 0) report.sections.push_back(FailureTable(summary.all));
  if (summary.failures) report.sections.push_back(*summary.failures);
  if (summary.header.is_of_plan() && !summary.groups.empty() && !summary.rule.search)
    report.sections.push_back(LimitsSection(summary));
  if (summary.trials == 0) return report;
  for (const auto& [title, player] : {std::pair{"Success by anything", "success"},
                                      {"Time to dock", "times"},
                                      {"True error when it ended", "errors"},
                                      {"Trials", "trials"}})
    report.sections.push_back({.title = title, .player = player});
  return report;
}

Json ResultJson(const BatchSummary& summary) {
  const StoreHeader& header = summary.header;
  const TrialScheduler& scheduler = summary.scheduler;
  Json json = {{"plan_hash", header.plan_hash()}, {"build", header.build},
               {"shard", header.shard.Text()},    {"trials", scheduler.wanted()},
               {"done", summary.trials},          {"running", summary.running}};
  if (summary.rule.precision)
    json["precision"] = {{"half_width", *summary.rule.precision},
                         {"cells", scheduler.cells()},
                         {"reached", scheduler.reached()}};
  if (summary.envelope) json["envelope"] = summary.envelope_json;
  json["groups"] = GroupsJson(summary.keys, summary.groups);
  if (!summary.curves.empty())
    json["success"] = {
        {"over", summary.over}, {"by", summary.curves_by}, {"curves", summary.curves}};
  return json;
}

std::string DoneText(int64_t done, int64_t total, int64_t most) {
  return fmt::format("{} of {}{}", done, total,
                     total == most || done == total ? "" : fmt::format(" (at most {})", most));
}

}  // namespace turbidock::batch
