#include "experiments/report/json.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "sim/base/check.h"
#include "sim/base/result_fields.h"

namespace turbidock::report {
namespace {

enum class Color { kRed, kBlue };
constexpr auto Names(Color) {
  return EnumList<Color>({{Color::kRed, "red"}, {Color::kBlue, "blue"}});
}

struct Bounds {
  double low = 0, high = 0;
  std::array<double, 2> AsList() const { return {low, high}; }
};

struct Point {
  double x_m = 0;
  int64_t count = 0;
  bool operator==(const Point&) const = default;
  TURBIDOCK_FIELDS(x_m, count)
};

struct Flagged {
  bool json = true;
};

struct Everything {
  bool yes = true;
  int64_t most = std::numeric_limits<int64_t>::max();
  double third = 1.0 / 3, infinite = std::numeric_limits<double>::infinity();
  std::string text = "a \"b\"";
  Color color = Color::kBlue;
  std::optional<double> none;
  std::optional<int> some = 2;
  Bounds bounds = {1, 2};
  std::optional<Bounds> no_bounds;
  Point point = {.x_m = 0.5, .count = 3};
  std::vector<Point> points = {{1, 1}, {2, 2}}, no_points;
  std::map<Color, double> by_color = {{Color::kBlue, 1}};
  Eigen::Vector3d vector = {1, 2, 3};
  Eigen::Matrix2d matrix = (Eigen::Matrix2d() << 1, 2, 3, 4).finished();
  Eigen::Quaterniond q = {1, 2, 3, 4};
  double hidden = 7;

  static void Fields(auto& self, auto&& field) {
    field("computed", self.point.count + 1);
    self.VisitFields(field);
    field("hidden", self.hidden, Flagged{.json = false}, "not in the JSON");
  }
  TURBIDOCK_VISIT_FIELDS(yes, most, third, infinite, text, color, none, some, bounds, no_bounds,
                         point, points, no_points, by_color, vector, matrix, q)
};

TEST(Json, AStructIsAnObjectOfItsFieldsInTheirOrder) {
  EXPECT_EQ(JsonLine(Everything()),
            R"({"computed":4,"yes":true,"most":9223372036854775807,"third":0.3333333333333333,)"
            R"("infinite":null,"text":"a \"b\"","color":"blue","none":null,"some":2,)"
            R"("bounds":[1.0,2.0],"no_bounds":null,"point":{"x_m":0.5,"count":3},)"
            R"("points":[{"x_m":1.0,"count":1},{"x_m":2.0,"count":2}],"no_points":[],)"
            R"("by_color":{"blue":1.0},"vector":[1.0,2.0,3.0],"matrix":[[1.0,2.0],[3.0,4.0]],)"
            R"("q":[1.0,2.0,3.0,4.0]})");
}

struct Sent {
  std::vector<Point> points;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  std::string text;
  TURBIDOCK_FIELDS(points, p, q, text)
};

TEST(Json, WhatWasWrittenReadsBack) {
  Sent sent{
      .points = {{std::numbers::pi, -1}}, .p = {1, 5e-324, -0.0}, .q = {4, 3, 2, 1}, .text = "é"};
  const Sent back = ParseJson(JsonText(sent), "").get<Sent>();
  EXPECT_EQ(back.points, sent.points);
  EXPECT_EQ(back.p, sent.p);
  EXPECT_TRUE(std::signbit(back.p.z()));
  EXPECT_EQ(back.q.coeffs(), sent.q.coeffs());
  EXPECT_EQ(back.text, sent.text);
}

TEST(Json, TextThatIsNoJsonNamesWhereItIsFrom) {
  try {
    ParseJson("{\"a\": ", "results.json");
    FAIL() << "nothing was thrown";
  } catch (const ConfigError& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with("results.json: is no JSON: parse error at "))
        << error.what();
  }
}

TEST(Json, ALineReplacesBytesThatAreNoUtf8) {
  EXPECT_EQ(JsonLine(Json("a\xff\nb")), "\"a\xef\xbf\xbd\\nb\"");
}

TEST(Csv, HasTheKeysOnceAndQuotesWhatNeedsIt) {
  std::string csv;
  AddCsv({{"a,b", 1.0 / 3}, {"c", "x\"y"}, {"d", nullptr}, {"e", true}}, &csv);
  AddCsv({{"a,b", 2}, {"c", "one\ntwo"}, {"d", -0.0}, {"e", std::nan("")}}, &csv);
  EXPECT_EQ(csv, "\"a,b\",c,d,e\n0.3333333333333333,\"x\"\"y\",,true\n2,\"one\ntwo\",-0,nan\n");
}

}  // namespace
}  // namespace turbidock::report
