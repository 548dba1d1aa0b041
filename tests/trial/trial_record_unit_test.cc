// One list of fields: JSON, rows and the documented table have each of them, and give back what
// went in.

#include "experiments/report/json.h"
#include "experiments/trial/trial_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "experiments/report/table.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "sim/base/check.h"

namespace turbidock::trial {
namespace {

using Json = nlohmann::ordered_json;

struct Field {
  std::string key, doc;
  FieldPolicy policy;
};

std::vector<Field> FieldsOfARecord() {
  std::vector<Field> fields;
  const TrialRecord record;
  TrialRecord::Fields(
      record, [&](const char* key, const auto&, const FieldPolicy& policy, const char* doc) {
        fields.push_back({key, doc, policy});
      });
  return fields;
}

// Nothing in it has its default.
TrialRecord AwkwardRecord() {
  TrialRecord r;
  r.outcome = Outcome::kFalseDock;
  r.failure = Failure::kFalseLock;
  r.reason = "a \"reason\", with\na line";
  r.docked = r.inserted = true;
  r.time_s = 1.0 / 3;
  r.start = {-0.1, 5e-324, -1e308, 1};
  r.final_error_true = {-0.0, 0.1, 0.2, 0.3};
  r.final_error_estimated = {std::nextafter(1, 2), 2, 3, 4};
  r.fitness_mean = -0.25;
  r.fitness_best = 0.75;
  r.false_confidence_s = 0.4;
  r.normalised_error2_mean = 5.5;
  r.first_sight_m = 1.4;
  r.handover_time_s = 20.5;
  r.handover_navigation_error_m = 0.31;
  r.handover_navigation_error_rad = -0.08;
  r.searches = 6;
  r.attempts = 4;
  r.dockings = 2;
  r.returns_to_servoing = 3;
  r.tracking_rms_m = 0.01;
  r.overshoot_m = 0.02;
  r.effort_v = 0.03;
  r.insertion_depth_m = -0.04;
  r.insertion_time_s = -0.0;
  r.first_dock_contact = Contact{0, 1.5};
  r.dock_force_max_newton = 2.5;
  r.jam_time_s = 7;
  r.energy.thruster_work = 11;
  r.stage_time_s = {{control::Stage::kApproach, 1.5}, {control::Stage::kDocked, 0.1}};
  r.seed = std::numeric_limits<int64_t>::max();
  r.digest = "0123";
  r.wall_time_s = 4;
  r.cpu_time_s = 5;
  r.rss_bytes = std::numeric_limits<int64_t>::max() - 1;
  r.printed = "killed";
  return r;
}

TEST(TrialRecord, ARowGivesItBack) {
  const TrialRecord record = AwkwardRecord();
  const Json sent = report::ParseJson(report::JsonLine(CellsOf(record)), "a row");
  const TrialRecord back = RecordOf(sent.get<std::vector<Cell>>());
  EXPECT_TRUE(back == record);
  EXPECT_TRUE(std::signbit(back.final_error_true.x_m));
  EXPECT_TRUE(std::signbit(*back.insertion_time_s));

  TrialRecord absent = record;
  absent.insertion_time_s = absent.jam_time_s = std::nullopt;
  absent.first_dock_contact = std::nullopt;
  absent.stage_time_s.clear();
  EXPECT_TRUE(RecordOf(CellsOf(absent)) == absent);

  TrialRecord nan = record;
  nan.fitness_mean = nan.time_s = std::nan("");
  const TrialRecord nan_back = RecordOf(CellsOf(nan));
  EXPECT_TRUE(std::isnan(nan_back.fitness_mean));
  EXPECT_TRUE(std::isnan(nan_back.time_s));
  EXPECT_EQ(nan_back.seed, nan.seed);
}

TEST(TrialRecord, WithoutAnEndOfItsOwnItHasNoNumbers) {
  TrialRecord record;
  record.outcome = Outcome::kHung;
  record.failure = Failure::kHung;
  record.wall_time_s = 60;
  const std::vector<Cell> cells = CellsOf(record);
  size_t absent = 0;
  for (size_t i = 0; i < cells.size(); ++i) absent += cells[i].is_null();
  EXPECT_EQ(absent, Metrics().size());
  for (const Metric& metric : Metrics()) EXPECT_FALSE(metric.of(record)) << metric.name;
  EXPECT_TRUE(RecordOf(cells) == record);
}

TEST(TrialRecord, AnUnknownWordIsAnError) {
  std::vector<Cell> cells = CellsOf({});
  cells[0] = std::string("docket");
  EXPECT_THROW(RecordOf(cells), ConfigError);
}

TEST(TrialRecord, EveryFieldIsInResultJsonAndAColumnUnlessItSaysSo) {
  const Json json = Json::parse(report::JsonText([] {
    TrialRecord record = AwkwardRecord();
    record.reason = "\"quotes\",\nlines";
    record.fitness_mean = std::nan("");
    record.jam_time_s.reset();
    record.transitions = {{3, control::Stage::kApproach, control::Stage::kDocking, "why"}};
    return record;
  }()));
  const std::vector<Field> fields = FieldsOfARecord();
  std::set<std::string> keys;
  size_t in_json = 0, columns = 0, groups = 0;
  for (const Field& field : fields) {
    EXPECT_TRUE(keys.insert(field.key).second) << field.key << " twice";
    EXPECT_NE(field.doc, "") << field.key;
    EXPECT_TRUE(field.policy.json || field.policy.storage != Storage::kNowhere) << field.key;
    EXPECT_EQ(json.contains(field.key), field.policy.json) << field.key;
    in_json += field.policy.json;
    const bool is_group = std::string(field.policy.column).find("{}") != std::string::npos;
    groups += is_group;
    columns += field.policy.storage != Storage::kNowhere && !is_group;
  }
  EXPECT_EQ(json.size(), in_json);
  // A pose has four columns, the contact two, the stages one each.
  ASSERT_EQ(groups, 5u);
  const size_t stages = EnumNames<control::Stage>::kNames.size();
  EXPECT_EQ(Columns().size(), columns + 3 * 4 + 2 + stages);

  EXPECT_EQ(json["reason"], "\"quotes\",\nlines");
  EXPECT_EQ(json["fitness_mean"], nullptr);
  EXPECT_EQ(json["jam_time_s"], nullptr);
  EXPECT_EQ(json["jammed"], false);
  EXPECT_TRUE(std::signbit(json["final_error_true"]["x_m"].get<double>()));
  EXPECT_EQ(json["first_dock_contact"], (Json{{"time_s", 0.0}, {"force_newton", 1.5}}));
  EXPECT_EQ(json["energy"]["residual_joule"], -11);
  EXPECT_EQ(json["stage_time_s"].size(), 2u);
  EXPECT_EQ(json["transitions"][0]["to"], "docking");
  EXPECT_EQ(json["seed"], std::numeric_limits<int64_t>::max());
}

TEST(TrialRecord, MetricsAreFoundByTheNameOfTheirColumn) {
  const auto value = [](const std::string& name) {
    for (const Metric& metric : Metrics())
      if (metric.name == name) return metric.of(AwkwardRecord());
    ADD_FAILURE() << name << " is no metric";
    return std::optional<double>();
  };
  EXPECT_EQ(value("time_s"), 1.0 / 3);
  EXPECT_EQ(value("final_error_estimated_yaw_rad"), 4);
  EXPECT_EQ(value("returns_to_servoing"), 3);
  EXPECT_EQ(value("dock_contact_force_newton"), 1.5);
  EXPECT_EQ(value("thruster_work_joule"), 11);
  EXPECT_EQ(value("docking_time_s"), 0);
  EXPECT_EQ(value("docked_time_s"), 0.1);
}

TEST(TrialRecord, TheTableOfKeysHasEachColumnOnce) {
  std::multiset<std::string> documented;  // the cells of the table's second column
  std::istringstream lines(ResultKeyTable());
  for (std::string line; std::getline(lines, line);)
    if (const size_t begin = line.find('|', 1); begin != std::string::npos)
      documented.insert(line.substr(begin + 1, line.find('|', begin + 1) - begin - 1));
  for (const Column& column : Columns())
    EXPECT_EQ(documented.count(" `" + std::string(column.name) + "` "), 1u) << column.name;
}

// "newton_m" is no number of metres: a unit of several words is shown whole, or not at all.
TEST(Record, HasNoQuantityWithAPartOfItsUnit) {
  std::set<std::string> names;
  for (const Column& column : Columns()) names.insert(column.name);
  for (const config::KeyDoc& doc : ScenarioKeys())
    names.insert(doc.key.substr(doc.key.find_last_of('.') + 1));
  const std::set<std::string> units = {"m", "s", "rad", "newton", "kg", "v", "w", "ml", "per"};
  int compound = 0;
  for (const std::string& name : names) {
    const report::Quantity quantity = report::QuantityOf(name);
    const std::string last = quantity.label.substr(quantity.label.find_last_of(' ') + 1);
    compound += name.ends_with("rad_s") || name.ends_with("m3");
    EXPECT_FALSE(!quantity.unit.empty() && units.contains(last)) << name << " in " << quantity.unit;
  }
  EXPECT_GT(compound, 5);
}

}  // namespace
}  // namespace turbidock::trial
