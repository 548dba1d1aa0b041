// The lists of keys that people read: `turbidock list keys | grep WORD` shows a line without those
// before it, so each says what its key is, in which unit, and what applies where no file gives it.

#include <gtest/gtest.h>

#include <iterator>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/studies/gate/gate_plan.h"
#include "experiments/studies/tuning/study.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/scenario.h"
#include "tests/support/own_folder.h"

namespace turbidock {
namespace {

std::vector<config::KeyDoc> AllKeys() {
  std::vector<config::KeyDoc> all = trial::ScenarioKeys();
  for (const auto& keys : {batch::PlanKeys(), gate::GateKeys(), tuning::StudyKeys()})
    all.insert(all.end(), keys.begin(), keys.end());
  return all;
}

// `list result-keys` is a table: key, column, meaning.
std::vector<config::KeyDoc> ResultKeys() {
  std::vector<config::KeyDoc> keys;
  std::istringstream table(trial::ResultKeyTable());
  const std::regex row(R"(\| (.*) \| (.*) \| (?!Meaning)(.*) \|)");
  for (std::string line; std::getline(table, line);)
    if (std::smatch cells; std::regex_match(line, cells, row))
      keys.push_back({.key = cells[1].length() > 0 ? cells[1] : cells[2],
                      .type = "",
                      .value = "",
                      .range = "",
                      .doc = cells[3]});
  return keys;
}

TEST(TheLineOfAKey, IsUnderstoodAlone) {
  const std::regex hangs_on_another(
      "^(of|and|or|its?|their|they|them|these|that|this|likewise|also|along|about|for|from|to|at|"
      "in|by|on|as|with|which|whose|while|where|when)\\b|^(the|an?|how|what|whether) (it|its|they|"
      "their|them|first|last|others?|rest|same)\\b|likewise|as (above|before)|meanwhile|"
      "the same (axes|of|for)");
  const std::regex asks("^(how|what)\\b");
  std::vector<config::KeyDoc> keys = AllKeys();
  const std::vector<config::KeyDoc> results = ResultKeys();
  EXPECT_GT(results.size(), 50u);
  keys.insert(keys.end(), results.begin(), results.end());
  for (const config::KeyDoc& key : keys) {
    std::istringstream words(key.doc);
    EXPECT_GE(std::distance(std::istream_iterator<std::string>(words), {}), 3)
        << key.key << ": " << key.doc;
    const bool is_group = key.type == "group of keys" || key.type == "list of groups";
    EXPECT_FALSE(std::regex_search(key.doc, hangs_on_another) ||
                 (!is_group && std::regex_search(key.doc, asks)))
        << key.key << ": " << key.doc;
  }
}

// The unit ends the key; or the line has it in brackets or as 8-bit steps, or says that it is a
// number without one.
TEST(TheLineOfANumber, NamesItsUnit) {
  const std::regex in_key(
      "_(m|m2|m3|mps|mps2|m_s|s|s2|s3|hz|rad|rad_s|rad_s2|px|v|volts|newton|kg|kg_m2|electrons|"
      "frames|images|wxyz|rgb|factor|share|ratio|exponent|coefficient|probability)$|_per_[a-z0-9_]+"
      "$|_w_(m2_)?sr$|_w_m2$|_ml(_m3)?$|_kg_m3$");
  const std::regex in_line(
      R"(\[[^\]]+\]|8-bit steps|\b(share|cosine|error .*, relative|unit quaternion)\b|)"
      R"((^|: |largest |drag |damping )(number|factors?|ratios?|exponent|coefficient|probability|)"
      R"(fitness|component|version|half width, as a share|colour)\b|fitness F)");
  const auto is_number = [](const std::string& type) {
    return type == "number" || type == "whole number" ||
           (type.starts_with("list of ") && type.ends_with("numbers"));
  };
  int numbers = 0;
  for (const config::KeyDoc& key : AllKeys()) {
    if (!is_number(key.type)) continue;
    ++numbers;
    EXPECT_TRUE(std::regex_search(key.key, in_key) || std::regex_search(key.doc, in_line))
        << key.key << ": " << key.doc;
  }
  EXPECT_GT(numbers, 300);
}

TEST(TheLineOfAVector, NamesItsFrame) {
  const std::regex is_vector("(^|\\.)(?!.*_per_)\\w+_(m|mps|rad_s|m_s)$"),
      names_it("frame [BWM]|forwards");
  int vectors = 0;
  for (const config::KeyDoc& key : AllKeys()) {
    if (key.type != "list of 3 numbers" || !std::regex_search(key.key, is_vector)) continue;
    ++vectors;
    EXPECT_TRUE(std::regex_search(key.doc, names_it)) << key.key << ": " << key.doc;
  }
  EXPECT_GT(vectors, 10);
}

class TheDefaultOfAKey : public testing::OwnFolder {};

TEST_F(TheDefaultOfAKey, IsWhatAScenarioWithoutItHas) {
  const std::string file =
      File("least.yaml",
           "{schema_version: 1, trial: {seed: 1, duration_s: 1, scene: pool_active.xml}}\n");
  const trial::Scenario least = trial::LoadScenario(file, std::vector<std::string>());
  int required = 0, compared = 0;
  for (const config::KeyDoc& key : trial::ScenarioKeys()) {
    required += key.required ? 1 : 0;
    const bool is_group = key.type == "group of keys" || key.type == "list of groups";
    if (key.required || is_group || key.key.find("[]") != std::string::npos) continue;
    EXPECT_EQ(config::ValueOf(least, key.key), key.value) << key.key;
    ++compared;
  }
  EXPECT_EQ(required, 4);
  EXPECT_GT(compared, 300);
}

}  // namespace
}  // namespace turbidock
