#include "experiments/config/number_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "experiments/system/output_path.h"
#include "sim/base/check.h"

namespace turbidock::config {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;

std::string File(const std::string& text) {
  const std::string name = ::testing::TempDir() + "table.csv";
  system::WriteWhole(name, text);
  return name;
}

std::string RefusalOf(const std::string& text) {
  try {
    const std::string file = File(text);
    TimesOf(ReadNumberTable(file), file);
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

TEST(NumberTable, ReadsWhatItWrites) {
  const NumberTable table{.names = {"time_s", "sway_v"},
                          .columns = {{0, 0.1, 1.0 / 3}, {2.5, NAN, -1e-300}}};
  EXPECT_EQ(table.Csv(), "time_s,sway_v\n0,2.5\n0.1,\n0.3333333333333333,-1e-300\n");
  const NumberTable again = ReadNumberTable(File(table.Csv()));
  EXPECT_EQ(again.names, table.names);
  EXPECT_EQ(again.columns[0], table.columns[0]);
  EXPECT_TRUE(std::isnan(again.columns[1][1]));
  EXPECT_EQ(again.columns[1][2], -1e-300);
  EXPECT_EQ(again.Find("heave_v"), nullptr);
}

TEST(NumberTable, TakesWordsSpacesAndOtherLineEnds) {
  const NumberTable table =
      ReadNumberTable(File("time_s, stage\r\n 0 , approach\r\n1,docking\r\n"));
  EXPECT_THAT(table.names, ElementsAre("time_s", "stage"));
  EXPECT_THAT(table.columns[0], ElementsAre(0, 1));
  EXPECT_TRUE(std::isnan(table.columns[1][0]));
}

TEST(NumberTable, SaysTheLineOfAMistake) {
  EXPECT_EQ(RefusalOf("time_s\n0\n1\n"), "");
  EXPECT_THAT(RefusalOf("time_s,a\n0,1\n1\n"), EndsWith("table.csv:3: has 1 values, the header 2"));
  EXPECT_THAT(RefusalOf("time_s,a,a\n0,1,2\n"), EndsWith("table.csv:1: has the column a twice"));
  EXPECT_THAT(RefusalOf("time_s\n"), EndsWith("table.csv: has no rows"));
  EXPECT_THAT(RefusalOf(""), EndsWith("table.csv: has no rows"));
  EXPECT_THAT(RefusalOf("a\n1\n"), EndsWith("table.csv:1: has no column time_s"));
  EXPECT_THAT(RefusalOf("time_s\n0\nnoon\n"), EndsWith("table.csv:3: time_s is no number"));
  EXPECT_THAT(RefusalOf("time_s\n0\n0\n"),
              EndsWith("table.csv:3: the clock runs backwards, from 0 to 0 s"));
}

}  // namespace
}  // namespace turbidock::config
