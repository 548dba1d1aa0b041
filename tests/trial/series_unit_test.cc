// A log's columns: the frames' values, unchanged by JSON and CSV.

#include "experiments/trial/series.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "sim/base/check.h"

namespace turbidock::trial {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// Numbers that short texts do not hold.
TrialLog AwkwardLog(int64_t first_frame = int64_t{1} << 53) {
  TrialLog log{.thrusters = {"port", "starboard"}};
  for (int64_t i = 0; i < 7; ++i) {
    FrameRecord& frame = log.frames.emplace_back();
    frame.frame = first_frame + i;  // 2^53: beyond what a double tells apart
    frame.time_s = static_cast<double>(i) / 3;
    frame.stage = i < 3 ? control::Stage::kApproach : control::Stage::kVisualServoing;
    frame.controlled = i % 2 == 1;
    frame.fitness = i == 2 ? std::nan("") : -0.0;
    frame.true_X_WB.p = {5e-324, -1e308, 1e-7};
    frame.command.volts = {2.5, 1.0 / 7};
  }
  return log;
}

size_t IndexOf(const Series& series, const std::string& name) {
  for (size_t i = 0; i < series.columns().size(); ++i)
    if (series.columns()[i].name == name) return i;
  ADD_FAILURE() << "no column " << name;
  return 0;
}

// Bit for bit, but for the sign of what is not a number.
void ExpectEqual(const Series& a, const Series& b) {
  ASSERT_EQ(a.names(), b.names());
  ASSERT_EQ(a.rows(), b.rows());
  for (size_t i = 0; i < a.columns().size(); ++i) {
    ASSERT_EQ(a.columns()[i].values.index(), b.columns()[i].values.index()) << a.names()[i];
    for (size_t row = 0; row < a.rows(); ++row) {
      const Cell x = a.At(row, i), y = b.At(row, i);
      if (x.is_number_float() && std::isnan(x.get<double>())) {
        EXPECT_TRUE(std::isnan(y.get<double>())) << a.names()[i];
        continue;
      }
      EXPECT_EQ(x, y) << a.names()[i];
      if (x.is_number_float()) {
        EXPECT_EQ(std::signbit(x.get<double>()), std::signbit(y.get<double>()));
      }
    }
  }
}

TEST(Series, HasTheFramesInTheColumnsOfTrajectoryCsv) {
  const Series series = Series::Of(AwkwardLog());
  EXPECT_EQ(series.rows(), 7u);
  EXPECT_THAT(
      series.Csv(),
      StartsWith("frame,time_s,stage,controlled,fitness,"
                 "est_x_m,est_y_m,est_z_m,est_qw,est_qx,est_qy,est_qz,"
                 "image_time_s,true_at_image_x_m,true_at_image_y_m,true_at_image_z_m,"
                 "true_at_image_qw,true_at_image_qx,true_at_image_qy,true_at_image_qz,"
                 "true_x_m,true_y_m,true_z_m,true_qw,true_qx,true_qy,true_qz,"
                 "desired_x_m,desired_y_m,desired_z_m,desired_yaw_rad,port_v,starboard_v,"
                 "vehicle_x_m,vehicle_y_m,vehicle_z_m,vehicle_qw,vehicle_qx,vehicle_qy,vehicle_qz,"
                 "surge_mps,sway_mps,heave_mps,roll_rate_rad_s,pitch_rate_rad_s,yaw_rate_rad_s,"
                 "insertion_depth_m,dock_force_newton,collision_force_newton\n"
                 "9007199254740992,0,approach,0,-0,"));
  EXPECT_EQ(series.At(3, IndexOf(series, "frame")), (int64_t{1} << 53) + 3);
  EXPECT_EQ(series.At(3, IndexOf(series, "stage")), "visual_servoing");
  EXPECT_EQ(series.At(3, IndexOf(series, "controlled")), 1);
  EXPECT_EQ(series.At(3, IndexOf(series, "starboard_v")), 1.0 / 7);
}

TEST(Series, AFrameWithoutACommandHasNeutralVolts) {
  TrialLog log;
  log.frames.resize(1);
  const Series series = Series::Of(log);
  for (const std::string& thruster : log.thrusters)
    EXPECT_EQ(series.At(0, IndexOf(series, thruster + "_v")), kNeutralVolts);
}

TEST(Series, KeepsEveryNthFrameFromTheFirstOn) {
  const Series all = Series::Of(AwkwardLog()), third = Series::Of(AwkwardLog(), 3);
  ASSERT_EQ(third.rows(), 3u);
  for (size_t row = 0; row < 3; ++row)
    for (size_t i = 0; i < all.columns().size(); ++i)
      EXPECT_EQ(third.At(row, i).dump(), all.At(3 * row, i).dump());
  EXPECT_EQ(Series::Of(AwkwardLog(), 1000).rows(), 1u);
}

// A short blow between two rows, as a collision that ends a trial, is in the row before it.
TEST(Series, ARowHasTheStrongestContactUntilTheNext) {
  TrialLog log = AwkwardLog();
  log.frames[3].dock_force_newton = 5;
  log.frames[4].dock_force_newton = 40;
  log.frames[6].collision_force_newton = 933;
  const Series series = Series::Of(log, 3), all = Series::Of(log);
  const auto forces = [](const Series& of, const std::string& name) {
    return std::get<std::vector<double>>(of.columns()[IndexOf(of, name)].values);
  };
  EXPECT_EQ(forces(series, "dock_force_newton"), (std::vector<double>{0, 40, 0}));
  EXPECT_EQ(forces(series, "collision_force_newton"), (std::vector<double>{0, 0, 933}));
  EXPECT_EQ(forces(Series::Of(log, 4), "collision_force_newton"), (std::vector<double>{0, 933}));
  EXPECT_EQ(forces(all, "dock_force_newton"), (std::vector<double>{0, 0, 0, 5, 40, 0, 0}));
}

TEST(Series, BytesAndCsvGiveItBack) {
  const Series series = Series::Of(AwkwardLog());
  ExpectEqual(Series::FromBytes(series.Bytes()), series);
  EXPECT_TRUE(Series::FromBytes(Series().Bytes()).columns().empty());
  const Series empty(TrialLog().thrusters);
  ExpectEqual(Series::FromBytes(empty.Bytes()), empty);

  const Series small = Series::Of(AwkwardLog(0));
  ExpectEqual(Series::FromCsv(small.Csv(), "t.csv"), small);
}

// By hand: the first column's bytes, the least significant of both rows first.
TEST(Series, BytesAreALineOfJsonAndPlanesOfBytes) {
  TrialLog log = AwkwardLog(0x0102);
  log.frames.resize(2);
  const std::string bytes = Series::Of(log).Bytes();
  EXPECT_THAT(bytes, StartsWith(R"({"rows":2,"columns":[["frame","int"],["time_s","double"],)"
                                R"(["stage",["approach",)"));
  const std::string first = bytes.substr(bytes.find('\n') + 1, 16);
  EXPECT_EQ(first, std::string("\2\3\1\1\0\0\0\0\0\0\0\0\0\0\0\0", 16));
}

TEST(Series, DamagedBytesAreAnError) {
  const std::string bytes = Series::Of(AwkwardLog()).Bytes();
  const auto said = [](const std::string& text) -> std::string {
    try {
      Series::FromBytes(text);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  for (size_t size = 0; size < bytes.size(); ++size)
    EXPECT_NE(said(bytes.substr(0, size)), "accepted") << size;
  EXPECT_THAT(said(R"({"rows":-1,"columns":[["frame","int"]]})"), HasSubstr("it has no column"));
  std::string other = bytes;
  other.replace(other.find("[\"time_s\",\"double\"]"), 20, "[\"time_s\",\"double2\"");
  EXPECT_NE(said(other), "accepted");
  other = bytes;
  other.replace(other.find("\"rows\":7"), 8, "\"rows\":9");
  EXPECT_NE(said(other), "accepted");
  const size_t stage = bytes.find('\n') + 1 + 2 * 8 * 7;
  other = bytes;
  other[stage] = 77;
  EXPECT_EQ(said(other), "a series: a word out of range");
}

TEST(Series, RoundedNumbersHaveTheirDigits) {
  const Series series = Series::Of(AwkwardLog()), rounded = series.Rounded(4);
  for (size_t i = 0; i < series.columns().size(); ++i)
    for (size_t row = 0; row < series.rows(); ++row) {
      const Cell a = series.At(row, i), b = rounded.At(row, i);
      if (!a.is_number_float() || !std::isfinite(a.get<double>())) {
        EXPECT_EQ(a.dump(), b.dump());
        continue;
      }
      const double x = a.get<double>(), y = b.get<double>();
      if (std::isnormal(x)) {
        EXPECT_NEAR(y / x, 1, 0.5e-4);
      }
      // of times more is kept: they find their frame
      const bool is_time = series.columns()[i].name.ends_with("time_s");
      if (is_time) {
        EXPECT_NEAR(y, x, 1e-6);
      }
      EXPECT_EQ(std::bit_cast<uint64_t>(y) & (is_time ? 0xffffff : 0xffffffff), 0u);
    }
  ExpectEqual(rounded.Rounded(4), rounded);
}

TEST(Series, ReadsTheColumnsOfACsvInAnyOrder) {
  const std::vector<std::string> names = Series(TrialLog().thrusters).names();
  std::string header, values;
  for (size_t i = names.size(); i-- > 0;) {
    header += names[i] + (i > 0 ? "," : "\n");
    values += (names[i] == "stage" ? "docked" : std::to_string(i)) + (i > 0 ? "," : "\n");
  }
  const Series series = Series::FromCsv(header + values, "t.csv");
  ASSERT_EQ(series.columns().size(), names.size());
  for (size_t i = 0; i < names.size(); ++i)
    EXPECT_EQ(series.At(0, IndexOf(series, names[i])),
              names[i] == "stage" ? Cell("docked") : Cell(i));
}

TEST(Series, SaysWhatIsWrongWithACsv) {
  const auto said = [](const std::string& text) -> std::string {
    try {
      Series::FromCsv(text, "t.csv");
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  const std::string csv = Series::Of(AwkwardLog(0)).Csv(), header = csv.substr(0, csv.find('\n'));
  EXPECT_EQ(said(""), "t.csv: is empty");
  EXPECT_EQ(said("a,b\n1,2\n"), "t.csv: is no trajectory: no log has a column a");
  EXPECT_EQ(said(header + ",more\n"), "t.csv: is no trajectory: no log has a column more");
  EXPECT_EQ(said(header + "\n1,2\n"), "t.csv:2: has 2 values, the header 49");
  EXPECT_EQ(said("frame\n1\n"), "t.csv: is no trajectory: it has no column time_s");
  const std::string none = "t.csv: is no trajectory: ";
  std::string other = csv;
  other.replace(other.find("approach"), 8, "lunch");
  EXPECT_EQ(said(other), none + "stage in row 1: 'lunch' is no word of this program");
  other.replace(other.find("lunch"), 5, "");
  EXPECT_EQ(said(other), none + "stage in row 1: is missing");
  other = csv;
  other.replace(other.find("\n0,") + 1, 1, "first");
  EXPECT_EQ(said(other), none + "frame in row 1: 'first' is no number");
}

}  // namespace
}  // namespace turbidock::trial
