// Strict YAML: every kind of bad input with its exact message, layers, --set, saving, the table of
// keys.

#include "experiments/config/yaml_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "tests/support/message_of.h"

namespace turbidock::config {

enum class Lamp { kOff, kPassive, kActive };

constexpr auto Names(Lamp) {
  using enum Lamp;
  return EnumList<Lamp>({{kOff, "off"}, {kPassive, "passive"}, {kActive, "active"}});
}

namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MessageOf;

struct Water {
  double milk_ml_m3 = 10;
  double scatter_scale = 1;

  static void Fields(auto& self, auto&& field) {
    field("milk_ml_m3", self.milk_ml_m3, AtLeast(0), "milk in the water");
    field("scatter_scale", self.scatter_scale, Above(0), "");
  }
};

struct Ball {
  std::string name = "ball";
  double radius_m = 0.02;
  Eigen::Vector3d p_m = {0, 0, 0.07};
  Water inside{};

  static void Fields(auto& self, auto&& field) {
    field("name", self.name, Finite(), "colour");
    field("radius_m", self.radius_m, InRange(0.001, 1), "radius");
    field("p_m", self.p_m, Finite(), "centre in the marker");
    field("inside", self.inside, Finite(), "what it is filled with");
  }
};

struct Nothing {
  static void Fields(auto&, auto&&) {}
};

struct OneOfEverything {
  bool enabled = true;
  int count = 3;
  int64_t seed = 1;
  double baseline_m = 0.12;
  double gain = 1;
  std::string title = "first";
  Lamp lamp = Lamp::kActive;
  Eigen::Vector3d axis = {1, 0, 0};
  Eigen::Matrix<double, 6, 1> drag_newton_s_per_m = Eigen::Matrix<double, 6, 1>::Ones();
  Eigen::Matrix<double, 2, 3> gains;
  std::array<double, 2> limits_v{0.5, 1.5};
  std::vector<double> distances_m{0.4, 0.6};
  Water water;
  std::vector<Ball> balls{{.name = "red"}, {.name = "green"}};
  Nothing nothing;

  OneOfEverything() { gains << 1, 2, 3, 4, 5, 6; }

  static void Fields(auto& self, auto&& field) {
    field("enabled", self.enabled, Finite(), "whether it runs");
    field("count", self.count, InRange(1, 100), "how many");
    field("seed", self.seed, AtLeast(0), "the seed");
    field("baseline_m", self.baseline_m, InRange(0.01, 1), "distance of the cameras");
    field("gain", self.gain, Finite(), "no unit");
    field("title", self.title, Finite(), "any text");
    field("lamp", self.lamp, Finite(), "which marker");
    field("axis", self.axis, InRange(-1, 1), "a direction");
    field("drag_newton_s_per_m", self.drag_newton_s_per_m, AtLeast(0), "by axis");
    field("gains", self.gains, Finite(), "two rows");
    field("limits_v", self.limits_v, InRange(0, 2.5), "a pair");
    field("distances_m", self.distances_m, Above(0), "any number of them");
    field("water", self.water, Finite(), "the medium");
    field("balls", self.balls, Finite(), "of the marker");
    field("nothing", self.nothing, Finite(), "");
  }

  void Check(const std::string& path) const {
    if (gain > 100 * baseline_m)
      throw ConfigError(JoinKey(path, "gain"), "too large for the baseline");
    if (water.milk_ml_m3 > 500 && water.scatter_scale > 2)
      throw ConfigError("water", "too turbid to compute");
  }
};

// The whole state, to the last bit.
std::vector<std::string> Bits(const OneOfEverything& o) {
  std::vector<std::string> all;
  auto number = [&](double x) {
    uint64_t bits = 0;
    std::memcpy(&bits, &x, sizeof bits);
    all.push_back(std::to_string(bits));
  };
  all.push_back(o.enabled ? "t" : "f");
  all.push_back(std::to_string(o.count));
  all.push_back(std::to_string(o.seed));
  number(o.baseline_m);
  number(o.gain);
  all.push_back(o.title);
  all.push_back(NameOf(o.lamp));
  for (const double x : o.axis) number(x);
  for (const double x : o.drag_newton_s_per_m) number(x);
  for (int i = 0; i < 6; ++i) number(o.gains(i / 3, i % 3));
  for (const double x : o.limits_v) number(x);
  all.push_back(std::to_string(o.distances_m.size()));
  for (const double x : o.distances_m) number(x);
  auto water = [&](const Water& w) {
    number(w.milk_ml_m3);
    number(w.scatter_scale);
  };
  water(o.water);
  all.push_back(std::to_string(o.balls.size()));
  for (const Ball& ball : o.balls) {
    all.push_back(ball.name);
    number(ball.radius_m);
    for (const double x : ball.p_m) number(x);
    water(ball.inside);
  }
  return all;
}

OneOfEverything Load(const std::string& text) {
  OneOfEverything object;
  ReadFields(ParseYaml(text, "a.yaml"), &object, nullptr);
  return object;
}

std::string LoadError(const std::string& text) {
  return MessageOf([&] { Load(text); });
}

template <class T>
void ApplySet(const std::string& assignment, T* object, Origins* origins) {
  for (const auto& [key, place] : SetLayers({ParseAssignment(assignment)}, object))
    if (origins) (*origins)[key] = place;
}

std::string SetError(const std::string& assignment) {
  OneOfEverything object;
  return MessageOf([&] { ApplySet(assignment, &object, nullptr); });
}

// A file that is gone when the test ends.
class TemporaryFile {
 public:
  TemporaryFile(const std::string& name, const std::string& text)
      : path_(std::filesystem::path(::testing::TempDir()) / ("yaml_fields_" + name)) {
    std::ofstream(path_) << text;
  }
  ~TemporaryFile() { std::filesystem::remove(path_); }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

// ---------------------------------------------------------------------------------------- reading

TEST(YamlFields, ReadsEveryKindOfField) {
  const OneOfEverything o = Load(R"(
enabled: false
count: 7
seed: 9007199254740993   # not a double
baseline_m: .25
gain: -1.5e-3
title: "120 mm # and more"
lamp: passive
axis: [0, +0.5, -1]
drag_newton_s_per_m: [1, 2, 3, 4, 5, 6]
gains:
  - [10, 20, 30]
  - [40, 50, 60]
limits_v: [1, 2]
distances_m: [0.4, 0.6, 0.8]
water: {milk_ml_m3: 20}
balls:
  - name: blue
    p_m: [0, -0.07, 0]
  - {radius_m: 0.03, inside: {scatter_scale: 2}}
  - {}
nothing: {}
)");
  EXPECT_FALSE(o.enabled);
  EXPECT_EQ(o.count, 7);
  EXPECT_EQ(o.seed, 9007199254740993);
  EXPECT_EQ(o.baseline_m, 0.25);
  EXPECT_EQ(o.gain, -1.5e-3);
  EXPECT_EQ(o.title, "120 mm # and more");
  EXPECT_EQ(o.lamp, Lamp::kPassive);
  EXPECT_EQ(o.axis, Eigen::Vector3d(0, 0.5, -1));
  EXPECT_EQ(o.drag_newton_s_per_m[5], 6);
  EXPECT_EQ(o.gains(0, 2), 30);
  EXPECT_EQ(o.gains(1, 0), 40);
  EXPECT_THAT(o.limits_v, ElementsAre(1, 2));
  EXPECT_THAT(o.distances_m, ElementsAre(0.4, 0.6, 0.8));
  EXPECT_EQ(o.water.milk_ml_m3, 20);
  EXPECT_EQ(o.water.scatter_scale, 1);  // absent: the default
  ASSERT_EQ(o.balls.size(), 3);
  EXPECT_EQ(o.balls[0].name, "blue");
  EXPECT_EQ(o.balls[0].p_m.y(), -0.07);
  EXPECT_EQ(o.balls[1].name, "ball");  // the element's default, not that of the list's second
  EXPECT_EQ(o.balls[1].inside.scatter_scale, 2);
  EXPECT_EQ(o.balls[2].radius_m, 0.02);
}

TEST(YamlFields, AbsentKeysKeepTheirDefaults) {
  OneOfEverything expected;
  expected.count = 4;
  EXPECT_EQ(Bits(Load("count: 4")), Bits(expected));
}

TEST(YamlFields, TextTakesAnyScalar) {
  EXPECT_EQ(Load("title: 12").title, "12");
  EXPECT_EQ(Load("title: true").title, "true");
  EXPECT_EQ(Load("title: ''").title, "");
}

TEST(YamlFields, FlowStyleIsYaml) {
  const OneOfEverything o = Load("{limits_v: [1, 2], gain: 3, count: 3}");
  EXPECT_EQ(o.limits_v[1], 2);
  EXPECT_EQ(o.count, 3);
}

TEST(YamlFields, UnknownKeyNamesTheNearest) {
  EXPECT_EQ(LoadError("count: 1\nwater:\n  milk_ml_m4: 3\n"),
            "a.yaml:3: water.milk_ml_m4: unknown key; did you mean milk_ml_m3?");
  // at the root, where there are few, it says them all
  EXPECT_EQ(LoadError("basline_m: 1"),
            "a.yaml:1: basline_m: unknown key; did you mean baseline_m? Allowed: enabled, count, "
            "seed, baseline_m, gain, title, lamp, axis, drag_newton_s_per_m, gains, limits_v, "
            "distances_m, water, balls, nothing");
  EXPECT_THAT(LoadError("gaim: 1"), HasSubstr("a.yaml:1: gaim: unknown key; did you mean gain?"));
  // a key without its unit
  EXPECT_THAT(LoadError("baseline: 1"), HasSubstr("did you mean baseline_m?"));
  EXPECT_EQ(LoadError("water: {milk: 1}"),
            "a.yaml:1: water.milk: unknown key; did you mean milk_ml_m3?");
  EXPECT_EQ(LoadError("balls: [{}, {radius_mm: 3}]"),
            "a.yaml:1: balls[1].radius_mm: unknown key; did you mean radius_m?");
}

TEST(YamlFields, UnknownKeyThatBelongsElsewhere) {
  EXPECT_EQ(LoadError("milk_ml_m3: 1"),
            "a.yaml:1: milk_ml_m3: unknown key; did you mean water.milk_ml_m3?");
  EXPECT_EQ(LoadError("water.milk_ml_m3: 1"),
            "a.yaml:1: water.milk_ml_m3: unknown key; a file nests its keys, one level a line");
}

TEST(YamlFields, UnknownKeyNearNothingListsWhatIsAllowed) {
  EXPECT_EQ(LoadError("water: {whatever: 1}"),
            "a.yaml:1: water.whatever: unknown key; allowed: milk_ml_m3, scatter_scale");
}

TEST(YamlFields, DuplicateKeyNamesBothLines) {
  EXPECT_EQ(LoadError("count: 1\ngain: 2\ncount: 1\n"),
            "a.yaml:3: count: duplicate key, first given in line 1");
  EXPECT_EQ(LoadError("water:\n  milk_ml_m3: 1\n  milk_ml_m3: 2\n"),
            "a.yaml:3: water.milk_ml_m3: duplicate key, first given in line 2");
}

TEST(YamlFields, WrongTypeNamesTypeAndUnit) {
  EXPECT_EQ(LoadError("baseline_m: abc"), "a.yaml:1: baseline_m = 'abc', must be a number");
  EXPECT_EQ(LoadError("gain: abc"), "a.yaml:1: gain = 'abc', must be a number");
  EXPECT_EQ(LoadError("water: {milk_ml_m3: x}"),
            "a.yaml:1: water.milk_ml_m3 = 'x', must be a number");
  EXPECT_EQ(LoadError("baseline_m: [1]"), "a.yaml:1: baseline_m = a list, must be a number");
  EXPECT_EQ(LoadError("baseline_m: {m: 1}"),
            "a.yaml:1: baseline_m = a group of keys, must be a number");
  EXPECT_EQ(LoadError("baseline_m: true"), "a.yaml:1: baseline_m = 'true', must be a number");
  EXPECT_EQ(LoadError("baseline_m: '0.12'"),
            "a.yaml:1: baseline_m = '0.12', must be a number, without quotes");
  EXPECT_EQ(LoadError("baseline_m: !!str 0.12"),
            "a.yaml:1: baseline_m: has a tag, !!str; leave it out");
  EXPECT_EQ(LoadError("title: [a]"), "a.yaml:1: title = a list, must be text");
  EXPECT_EQ(LoadError("water: 5"), "a.yaml:1: water = '5', must be a group of keys");
  EXPECT_EQ(LoadError("balls: {name: x}"),
            "a.yaml:1: balls = a group of keys, must be a list of groups");
  EXPECT_EQ(LoadError("balls:\n  - {}\n  - red\n"),
            "a.yaml:3: balls[1] = 'red', must be a group of keys");
  EXPECT_EQ(LoadError("gain: " + std::string(70, 'x')),
            "a.yaml:1: gain = '" + std::string(60, 'x') + "...', must be a number");
}

TEST(YamlFields, NumberWithAUnit) {
  EXPECT_EQ(LoadError("baseline_m: 120 mm"),
            "a.yaml:1: baseline_m = '120 mm', give a plain number");
  EXPECT_EQ(LoadError("baseline_m: 0.12m"), "a.yaml:1: baseline_m = '0.12m', give a plain number");
  EXPECT_EQ(LoadError("count: 5 pieces"),
            "a.yaml:1: count = '5 pieces', give a plain whole number");
  EXPECT_EQ(LoadError("gain: 1,5"), "a.yaml:1: gain = '1,5', give a plain number");
  EXPECT_EQ(LoadError("gain: 0x10"), "a.yaml:1: gain = '0x10', give a plain number");
}

TEST(YamlFields, OutOfRangeSaysTheRange) {
  EXPECT_EQ(LoadError("baseline_m: -0.1"), "a.yaml:1: baseline_m = -0.1, must be in [0.01, 1]");
  EXPECT_EQ(LoadError("water: {scatter_scale: 0}"),
            "a.yaml:1: water.scatter_scale = 0, must be > 0");
  EXPECT_EQ(LoadError("seed: -1"), "a.yaml:1: seed = -1, must be >= 0");
  EXPECT_EQ(LoadError("count: 101"), "a.yaml:1: count = 101, must be in [1, 100]");
  EXPECT_EQ(LoadError("distances_m:\n- 1\n- 0\n"), "a.yaml:3: distances_m[1] = 0, must be > 0");
  EXPECT_EQ(LoadError("axis: [0, 0, 2]"), "a.yaml:1: axis[2] = 2, must be in [-1, 1]");
}

TEST(YamlFields, NanAndInfinityAreRefused) {
  EXPECT_EQ(LoadError("gain: .nan"), "a.yaml:1: gain = .nan, must be finite");
  EXPECT_EQ(LoadError("gain: .inf"), "a.yaml:1: gain = .inf, must be finite");
  EXPECT_EQ(LoadError("gain: -.Inf"), "a.yaml:1: gain = -.Inf, must be finite");
  EXPECT_EQ(LoadError("gain: nan"), "a.yaml:1: gain = 'nan', must be a number");
  EXPECT_EQ(LoadError("gain: 1e999"), "a.yaml:1: gain = 1e999, is too large or too small a number");
  EXPECT_EQ(LoadError("baseline_m: .nan"), "a.yaml:1: baseline_m = .nan, must be in [0.01, 1]");
}

TEST(YamlFields, WholeNumbers) {
  EXPECT_EQ(LoadError("count: 3.5"), "a.yaml:1: count = 3.5, must be a whole number");
  EXPECT_EQ(LoadError("count: 1e1"), "a.yaml:1: count = 1e1, must be a whole number");
  EXPECT_EQ(LoadError("count: x"), "a.yaml:1: count = 'x', must be a whole number");
  EXPECT_EQ(LoadError("count: 3000000000"), "a.yaml:1: count = 3000000000, must be in [1, 100]");
  EXPECT_EQ(LoadError("seed: 9223372036854775808"),
            "a.yaml:1: seed = 9223372036854775808, must be in [0, 9223372036854775807]");
  EXPECT_EQ(Load("seed: 9223372036854775807").seed, std::numeric_limits<int64_t>::max());
}

TEST(YamlFields, TrueOrFalseOnly) {
  for (const std::string text : {"yes", "1", "True", "'true'", "on"})
    EXPECT_THAT(LoadError("enabled: " + text), HasSubstr("must be true or false")) << text;
  EXPECT_EQ(LoadError("enabled: yes"), "a.yaml:1: enabled = 'yes', must be true or false");
}

TEST(YamlFields, EnumsListTheirNames) {
  EXPECT_EQ(LoadError("lamp: activ"),
            "a.yaml:1: lamp = 'activ', must be one of off, passive, active");
  EXPECT_EQ(LoadError("lamp: [active]"),
            "a.yaml:1: lamp = a list, must be one of off, passive, active");
}

TEST(YamlFields, ListsOfWrongLength) {
  EXPECT_EQ(LoadError("axis: [1, 2]"),
            "a.yaml:1: axis has 2 elements, must be a list of 3 numbers");
  EXPECT_EQ(LoadError("drag_newton_s_per_m: [1]"),
            "a.yaml:1: drag_newton_s_per_m has 1 element, must be a list of 6 numbers");
  EXPECT_EQ(LoadError("limits_v: 5"), "a.yaml:1: limits_v = '5', must be a list of 2 numbers");
  EXPECT_EQ(LoadError("gains: [1, 2, 3, 4, 5, 6]"),
            "a.yaml:1: gains has 6 elements, must be a list of 2 rows of 3 numbers");
  EXPECT_EQ(LoadError("gains:\n- [1, 2, 3]\n- [4, 5]\n"),
            "a.yaml:3: gains[1] has 2 elements, must be a list of 3 numbers");
  EXPECT_EQ(LoadError("gains: [[1, 2, 3], [4, five, 6]]"),
            "a.yaml:1: gains[1][1] = 'five', must be a number");
}

TEST(YamlFields, KeysWithoutAValue) {
  EXPECT_EQ(LoadError("baseline_m:\n"), "a.yaml:1: baseline_m: has no value, must be a number");
  EXPECT_EQ(LoadError("count: ~"), "a.yaml:1: count: has no value, must be a whole number");
  EXPECT_EQ(LoadError("title:"), "a.yaml:1: title: has no value, must be text");
  EXPECT_EQ(LoadError("gain: 1\nwater:\n"),
            "a.yaml:2: water: has no value, must be a group of keys");
}

TEST(YamlFields, KeysMustBeText) {
  EXPECT_EQ(LoadError("gain: 1\n[a, b]: 2\n"), "a.yaml:2: a key must be plain text");
  EXPECT_EQ(LoadError("water: {[a]: 2}"), "a.yaml:1: water: a key must be plain text");
}

// -------------------------------------------------------------------------------------- documents

TEST(YamlFields, EmptyDocuments) {
  for (const std::string text : {"", "\n\n", "# only a comment\n", "---\n", "~\n"})
    EXPECT_EQ(LoadError(text), "a.yaml: is empty") << text;
}

TEST(YamlFields, DocumentsThatAreNoMap) {
  EXPECT_EQ(LoadError("# list\n- 1\n- 2\n"), "a.yaml:2: is a list, must be a group of keys");
  EXPECT_EQ(LoadError("just text"), "a.yaml:1: is 'just text', must be a group of keys");
  EXPECT_EQ(LoadError("gain: 1\n---\ngain: 2\n"),
            "a.yaml:2: one YAML document ends and more follows");
}

TEST(YamlFields, StrayTextIsNotIgnoredAndDoesNotHang) {
  EXPECT_EQ(LoadError("{gain: 1} 5"), "a.yaml:1: one YAML document ends and more follows");
  EXPECT_EQ(LoadError(", gain: 1"), "a.yaml:1: one YAML document ends and more follows");
  EXPECT_EQ(Load("%YAML 1.2\n---\ngain: 3\n...\n").gain, 3);
}

TEST(YamlFields, InvalidYamlNamesTheLine) {
  EXPECT_THAT(LoadError("gain: 1\nwater: {milk_ml_m3: 1\n"),
              ::testing::StartsWith("a.yaml:3: not valid YAML: "));
  EXPECT_THAT(LoadError("gain: 1\n  count: 2\n"),
              ::testing::StartsWith("a.yaml:2: not valid YAML: "));
  EXPECT_THAT(LoadError("gain: *nowhere"), ::testing::StartsWith("a.yaml:1: not valid YAML: "));
  EXPECT_EQ(LoadError(std::string(10000, '[')), "a.yaml:1: is nested deeper than 64 levels");
}

TEST(YamlFields, SaysSeveralMistakesAtOnce) {
  EXPECT_EQ(LoadError("count: x\nwater:\n  milk_ml_m4: 3\n  scatter_scale: 0\ngain: 2\nballs:\n"
                      "- {radius_m: wide}\n- {p_m: 3, nane: x}\n"),
            "a.yaml:1: count = 'x', must be a whole number\n"
            "a.yaml:3: water.milk_ml_m4: unknown key; did you mean milk_ml_m3?\n"
            "a.yaml:4: water.scatter_scale = 0, must be > 0\n"
            "a.yaml:7: balls[0].radius_m = 'wide', must be a number\n"
            "a.yaml:8: balls[1].p_m = '3', must be a list of 3 numbers\n"
            "a.yaml:8: balls[1].nane: unknown key; did you mean name?");
  std::string many;
  for (int i = 0; i < 14; ++i) many += "nothing_like_it_" + std::to_string(i) + ": 1\n";
  EXPECT_THAT(LoadError(many), ::testing::EndsWith("\nand 4 mistakes more"));
  EXPECT_THROW(Load("count: x\ngain: y"), ConfigErrors);
}

TEST(YamlFields, FilesThatCannotBeRead) {
  EXPECT_EQ(MessageOf([] { LoadYaml("no/such.yaml"); }),
            "no/such.yaml: cannot be read: No such file or directory");
  const std::string folder = ::testing::TempDir();
  EXPECT_EQ(MessageOf([&] { LoadYaml(folder); }), folder + ": cannot be read: it is a directory");
}

TEST(YamlFields, FindReadsKeysThatNoStructDescribes) {
  const YamlNode root = ParseYaml("count: 2\nsweep:\n  water.milk_ml_m3: [1, 2]\n", "plan.yaml");
  OneOfEverything object;
  EXPECT_EQ(MessageOf([&] { ReadFields(root, &object, nullptr); }).substr(0, 32),
            "plan.yaml:2: sweep: unknown key;");
  ReadFields(root, &object, nullptr, {"sweep"});
  EXPECT_EQ(object.count, 2);
  const auto sweep = root.Find("sweep");
  ASSERT_TRUE(sweep.has_value());
  EXPECT_EQ(sweep->path, "sweep");
  EXPECT_EQ(sweep->Where(), "plan.yaml:2: ");
  EXPECT_EQ(sweep->Find("water.milk_ml_m3")->Elements().size(), 2u);
  EXPECT_FALSE(root.Find("absent").has_value());
}

TEST(YamlFields, EntriesAndElementsKnowWhereTheyAre) {
  const YamlNode root = ParseYaml("sweep:\n  a.b: [1, 2]\n  c:\n    - 3\n    - {d: 4}\n", "a.yaml");
  const auto entries = root.Find("sweep")->Entries();
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].first, "a.b");
  EXPECT_EQ(entries[0].second.path, "sweep.a.b");
  EXPECT_EQ(entries[0].second.OneLine(), "[1, 2]");
  const auto elements = entries[1].second.Elements();
  ASSERT_EQ(elements.size(), 2u);
  EXPECT_EQ(elements[0].Text(), "3");
  EXPECT_EQ(MessageOf([&] { elements[1].Fail("is wrong"); }), "a.yaml:5: sweep.c[1]: is wrong");
  EXPECT_FALSE(elements[1].Text().has_value());
  EXPECT_TRUE(elements[0].Elements().empty());
  EXPECT_EQ(MessageOf([&] { elements[0].Entries(); }),
            "a.yaml:4: sweep.c[0]: must be a group of keys");
}

TEST(YamlFields, APartOfADocumentKeepsItsPath) {
  const YamlNode root = ParseYaml("world:\n  medium:\n    milk: 1\n", "a.yaml");
  const auto medium = root.Find("world")->Find("medium");
  Water water;
  EXPECT_EQ(
      MessageOf([&] { ReadFields(*medium, &water, nullptr); }),
      "a.yaml:3: world.medium.milk: unknown key; did you mean milk_ml_m3? Allowed: milk_ml_m3, "
      "scatter_scale");
}

// ------------------------------------------------------------------------------------------ --set

TEST(YamlFieldsSet, SetsEveryKindOfField) {
  OneOfEverything o;
  for (const std::string assignment :
       {"enabled=false", "count=9", "seed=5", "baseline_m=0.2", "title=a = b", "lamp=off",
        "axis=[0, 1, 0]", "axis[2]=-0.5", "gains[1][0]=-4", "gains[0]=[7, 8, 9]", "limits_v.1=2",
        "distances_m=[1, 2, 3]", "distances_m[1]=5", "water.milk_ml_m3=20", "balls[1].radius_m=0.5",
        "balls.0.inside.milk_ml_m3=3", "balls[0].p_m[1]=6"})
    ApplySet(assignment, &o, nullptr);
  EXPECT_FALSE(o.enabled);
  EXPECT_EQ(o.count, 9);
  EXPECT_EQ(o.seed, 5);
  EXPECT_EQ(o.baseline_m, 0.2);
  EXPECT_EQ(o.title, "a = b");
  EXPECT_EQ(o.lamp, Lamp::kOff);
  EXPECT_EQ(o.axis, Eigen::Vector3d(0, 1, -0.5));
  EXPECT_EQ(o.gains(1, 0), -4);
  EXPECT_EQ(o.gains(1, 1), 5);
  EXPECT_EQ(o.gains(0, 2), 9);
  EXPECT_THAT(o.limits_v, ElementsAre(0.5, 2));
  EXPECT_THAT(o.distances_m, ElementsAre(1, 5, 3));
  EXPECT_EQ(o.water.milk_ml_m3, 20);
  EXPECT_EQ(o.balls[1].radius_m, 0.5);
  EXPECT_EQ(o.balls[0].inside.milk_ml_m3, 3);
  EXPECT_EQ(o.balls[0].p_m.y(), 6);
  EXPECT_EQ(o.balls[0].name, "red");
}

TEST(YamlFieldsSet, OneLineIsTheSameValueHoweverItWasWritten) {
  const YamlNode node = ParseYaml(
      "block:\n  - 0\n  - {b: [1, 2]}\n  - c:\n      d: text with  spaces\n      e:\n"
      "        - 3\nflow: [0, {b: [1, 2]}, {c: {d: text with  spaces, e: [3]}}]\nnumber: 7\n",
      "two.yaml");
  const std::string block = node.Find("block")->OneLine();
  EXPECT_EQ(block, node.Find("flow")->OneLine());
  EXPECT_EQ(block.find('\n'), std::string::npos);
  const YamlNode again = ParseYaml("again: " + block, "again.yaml");
  const std::vector<YamlNode> elements = again.Find("again")->Elements();
  ASSERT_EQ(elements.size(), 3u) << block;
  EXPECT_EQ(elements[2].Find("c")->Find("d")->Text(), "text with  spaces");
  EXPECT_EQ(node.Find("number")->OneLine(), "7");
  EXPECT_EQ(ParseYaml("nothing: {}\nempty: []\n", "x").Find("nothing")->OneLine(), "{}");
  EXPECT_EQ(ParseYaml("nothing: {}\nempty: []\n", "x").Find("empty")->OneLine(), "[]");
}

TEST(YamlFieldsSet, SetsWholeGroupsAndLists) {
  OneOfEverything o;
  ApplySet("water={milk_ml_m3: 7}", &o, nullptr);
  EXPECT_EQ(o.water.milk_ml_m3, 7);
  ApplySet("balls=[{name: only}]", &o, nullptr);
  ASSERT_EQ(o.balls.size(), 1);
  EXPECT_EQ(o.balls[0].name, "only");
}

TEST(YamlFieldsSet, SameErrorsWithItsPrefix) {
  EXPECT_EQ(SetError("baseline_m=-0.1"), "--set baseline_m = -0.1, must be in [0.01, 1]");
  EXPECT_EQ(SetError("baseline_m=120 mm"), "--set baseline_m = '120 mm', give a plain number");
  EXPECT_EQ(SetError("water.milk_ml_m4=1"),
            "--set water.milk_ml_m4: unknown key; did you mean milk_ml_m3?");
  EXPECT_EQ(SetError("milk_ml_m3=1"),
            "--set milk_ml_m3: unknown key; did you mean water.milk_ml_m3?");
  EXPECT_EQ(SetError("balls[0].radius=1"),
            "--set balls[0].radius: unknown key; did you mean radius_m?");
  EXPECT_EQ(SetError("water={milk_ml_m3: 1, milk_ml_m3: 2}"),
            "--set water.milk_ml_m3: duplicate key");
  EXPECT_EQ(SetError("baseline_m="), "--set baseline_m: has no value, must be a number");
  EXPECT_EQ(SetError("water=5"), "--set water = '5', must be a group of keys");
  EXPECT_THAT(SetError("axis=[1, 2"), HasSubstr("--set axis: not valid YAML: "));
}

// A shell takes the quotes of '' off.
TEST(YamlFieldsSet, TextMayBeEmpty) {
  for (const char* assignment : {"title=", "title=''"}) {
    OneOfEverything o;
    ApplySet(assignment, &o, nullptr);
    EXPECT_EQ(o.title, "");
  }
}

TEST(YamlFieldsSet, StrayTextIsNotIgnored) {
  EXPECT_EQ(SetError("axis=[1, 0, 0] 4"), "--set axis: one YAML document ends and more follows");
  EXPECT_EQ(SetError("gain=,5"), "--set gain: one YAML document ends and more follows");
}

TEST(YamlFieldsSet, PathsThatLeadNowhere) {
  EXPECT_EQ(SetError("count"), "--set count: must be KEY=VALUE");
  EXPECT_EQ(SetError(""), "--set must be KEY=VALUE");
  EXPECT_EQ(SetError("=1"), "--set is no key; write group.key=value");
  for (const std::string path :
       {".", "a.", ".a", "a..b", "balls[", "balls[]", "balls[x]", "balls[0", "balls[0]x", "[0]"})
    EXPECT_EQ(SetError(path + "=1"), "--set " + path + ": is no key; write group.key=value");
  EXPECT_EQ(SetError("count.x=1"), "--set count: has no key x: it is a whole number");
  EXPECT_EQ(SetError("lamp.x=1"), "--set lamp: has no key x: it is one of off, passive, active");
  EXPECT_EQ(SetError("balls[2].name=x"), "--set balls: has no element 2, it has 2");
  EXPECT_EQ(SetError("balls[99999999999999999999].name=x"),
            "--set balls: is a list of groups; write an element as balls[0]");
  EXPECT_EQ(SetError("balls.name=x"),
            "--set balls: is a list of groups; write an element as balls[0]");
  EXPECT_EQ(SetError("axis[3]=1"), "--set axis: has no element 3, it has 3");
  EXPECT_EQ(SetError("gains[2][0]=1"), "--set gains: has no element 2, it has 2");
  EXPECT_EQ(SetError("gains[1][3]=1"), "--set gains[1]: has no element 3, it has 3");
  EXPECT_EQ(SetError("distances_m[2]=1"), "--set distances_m: has no element 2, it has 2");
}

// ----------------------------------------------------------------------------------------- layers

TEST(YamlFieldsLayers, LaterLayersWin) {
  const TemporaryFile base("base.yaml", "count: 5\ngain: 2\nwater:\n  milk_ml_m3: 20\n");
  const TemporaryFile over("over.yaml", "gain: 3\nballs: [{name: one}]\n");
  const auto o =
      LoadLayers<OneOfEverything>({base.path(), over.path()}, {"gain=4", "balls[0].radius_m=0.1"});
  EXPECT_EQ(o.count, 5);
  EXPECT_EQ(o.gain, 4);
  EXPECT_EQ(o.water.milk_ml_m3, 20);
  EXPECT_EQ(o.baseline_m, 0.12);
  ASSERT_EQ(o.balls.size(), 1);
  EXPECT_EQ(o.balls[0].radius_m, 0.1);
}

TEST(YamlFieldsLayers, OriginsKnowTheLastPlace) {
  OneOfEverything o;
  Origins origins;
  ReadFields(ParseYaml("count: 5\nwater:\n  milk_ml_m3: 1\nballs:\n- name: x\n", "a.yaml"), &o,
             &origins);
  EXPECT_EQ(origins.at("count"), "a.yaml:1: ");
  EXPECT_EQ(origins.at("water"), "a.yaml:2: ");
  EXPECT_EQ(origins.at("water.milk_ml_m3"), "a.yaml:3: ");
  EXPECT_EQ(origins.at("balls[0].name"), "a.yaml:5: ");
  EXPECT_FALSE(origins.contains("gain"));
  ApplySet("count=6", &o, &origins);
  EXPECT_EQ(origins.at("count"), "--set ");
  ReadFields(ParseYaml("balls: []", "b.yaml"), &o, &origins);
  EXPECT_FALSE(origins.contains("balls[0].name"));  // went with the old list
  EXPECT_EQ(origins.at("balls"), "b.yaml:1: ");
}

TEST(YamlFieldsLayers, ChecksRunAfterTheLastLayerAndNameThePlace) {
  // gain alone would be wrong with the default baseline; the second layer makes it right
  const TemporaryFile first("first.yaml", "count: 2\ngain: 50\n");
  const TemporaryFile second("second.yaml", "baseline_m: 0.9\n");
  EXPECT_EQ(LoadLayers<OneOfEverything>({first.path(), second.path()}, {}).gain, 50);
  EXPECT_EQ(MessageOf([&] { LoadLayers<OneOfEverything>({first.path()}, {}); }),
            first.path() + ":2: gain: too large for the baseline");
  EXPECT_EQ(MessageOf([&] { LoadLayers<OneOfEverything>({}, {"gain=90"}); }),
            "--set gain: too large for the baseline");
}

TEST(YamlFieldsLayers, AnErrorOfAGroupNamesItsGroupOrNothing) {
  OneOfEverything o;
  Origins origins;
  ReadFields(ParseYaml("\nwater:\n  milk_ml_m3: 600\n  scatter_scale: 3\n", "a.yaml"), &o,
             &origins);
  EXPECT_EQ(MessageOf([&] { CheckSettings(o, origins); }),
            "a.yaml:2: water: too turbid to compute");
  EXPECT_EQ(MessageOf([&] { CheckSettings(o, {}); }), "water: too turbid to compute");
  // a default out of its range has no place; a value inside a group has the group's
  o.water.scatter_scale = -1;
  origins.erase("water.scatter_scale");
  EXPECT_EQ(MessageOf([&] { CheckSettings(o, origins); }),
            "a.yaml:2: water.scatter_scale: -1 must be > 0");
}

// ----------------------------------------------------------------------------------------- saving

TEST(YamlFieldsSave, WritesEveryFieldWithItsDescription) {
  OneOfEverything o;
  o.balls.resize(1);
  o.title = "two words";
  EXPECT_EQ(SaveYaml(o),
            R"(enabled: true  # whether it runs
count: 3  # how many
seed: 1  # the seed
baseline_m: 0.12  # distance of the cameras
gain: 1  # no unit
title: "two words"  # any text
lamp: active  # which marker
axis: [1, 0, 0]  # a direction
drag_newton_s_per_m: [1, 1, 1, 1, 1, 1]  # by axis
gains: [[1, 2, 3], [4, 5, 6]]  # two rows
limits_v: [0.5, 1.5]  # a pair
distances_m: [0.4, 0.6]  # any number of them
water:  # the medium
  milk_ml_m3: 10  # milk in the water
  scatter_scale: 1
balls:  # of the marker
  - name: red  # colour
    radius_m: 0.02  # radius
    p_m: [0, 0, 0.07]  # centre in the marker
    inside:  # what it is filled with
      milk_ml_m3: 10  # milk in the water
      scatter_scale: 1
nothing: {}
)");
}

TEST(YamlFieldsSave, LoadingWhatWasSavedGivesTheSameBits) {
  OneOfEverything plain, odd, empty;
  odd.enabled = false;
  odd.count = 100;
  odd.seed = std::numeric_limits<int64_t>::max();
  odd.baseline_m = 0.1 + 0.2;
  odd.gain = -0.0;
  odd.lamp = Lamp::kOff;  // "off" must not become false
  odd.axis = {-1, 1.0 / 3, std::numeric_limits<double>::denorm_min()};
  odd.drag_newton_s_per_m[3] = std::numeric_limits<double>::max();
  odd.gains << 1e-300, 1e300, 5e-324, 0.1, 1e21, 123456789012345680.0;
  odd.distances_m = {std::numeric_limits<double>::min(), 1e23};
  odd.balls.resize(3);
  odd.balls[2].name = "last";
  empty.distances_m.clear();
  empty.balls.clear();
  int compared = 0;
  for (const OneOfEverything& o : {plain, odd, empty}) {
    OneOfEverything loaded;
    loaded.count = 50;  // not by chance the same
    ReadFields(ParseYaml(SaveYaml(o), "saved.yaml"), &loaded, nullptr);
    EXPECT_EQ(Bits(loaded), Bits(o));
    ++compared;
  }
  EXPECT_EQ(compared, 3);
}

// To a reader of YAML 1.1, such as PyYAML, 2e-04 is a text.
TEST(YamlFieldsSave, AnExponentHasAPointBeforeIt) {
  OneOfEverything o;
  o.gain = 2e-4;
  o.distances_m = {1e30, 1.5e-9};
  const std::string saved = SaveYaml(o);
  EXPECT_THAT(saved, HasSubstr("gain: 2.0e-04 "));
  EXPECT_THAT(saved, HasSubstr("distances_m: [1.0e+30, 1.5e-09] "));
  EXPECT_EQ(Bits(Load(saved)), Bits(o));
}

TEST(YamlFieldsSave, AnyTextSurvives) {
  for (const std::string text : {"",
                                 " ",
                                 "plain",
                                 "two words",
                                 "a: b",
                                 "# no comment",
                                 "x # y",
                                 "- item",
                                 "true",
                                 "No",
                                 "~",
                                 "null",
                                 "12",
                                 "1e3",
                                 "0x10",
                                 "[a]",
                                 "{a}",
                                 "'",
                                 "\"",
                                 "back\\slash",
                                 "line\nbreak\r\ttab",
                                 "%",
                                 "@at",
                                 "`",
                                 "trailing ",
                                 "*a",
                                 "&a",
                                 "!t",
                                 "|",
                                 ">",
                                 "?",
                                 "...",
                                 "---",
                                 "\xc3\xbc\xe2\x82\xac",
                                 "a/b-c_d.e",
                                 "y",
                                 "<<",
                                 "="}) {
    OneOfEverything o;
    o.title = text;
    o.balls[0].name = text;
    const std::string saved = SaveYaml(o);
    EXPECT_EQ(Bits(Load(saved)), Bits(o)) << saved;
  }
}

// ------------------------------------------------------------------------------------------- keys

TEST(YamlFieldsKeys, ListsEveryKeyWithTypeDefaultRangeAndMeaning) {
  std::vector<std::string> lines;
  for (const KeyDoc& doc : ListKeys<OneOfEverything>())
    lines.push_back(doc.key + " | " + doc.type + " | " + doc.value + " | " + doc.range + " | " +
                    doc.doc);
  EXPECT_THAT(
      lines,
      ElementsAre("enabled | true or false | true |  | whether it runs",
                  "count | whole number | 3 | in [1, 100] | how many",
                  "seed | whole number | 1 | >= 0 | the seed",
                  "baseline_m | number | 0.12 | in [0.01, 1] | distance of the cameras",
                  "gain | number | 1 |  | no unit",  //
                  "title | text | first |  | any text",
                  "lamp | one of off, passive, active | active |  | which marker",
                  "axis | list of 3 numbers | [1, 0, 0] | in [-1, 1] | a direction",
                  "drag_newton_s_per_m | list of 6 numbers | [1, 1, 1, 1, 1, 1] | >= 0 | by axis",
                  "gains | list of 2 rows of 3 numbers | [[1, 2, 3], [4, 5, 6]] |  | two rows",
                  "limits_v | list of 2 numbers | [0.5, 1.5] | in [0, 2.5] | a pair",
                  "distances_m | list of numbers | [0.4, 0.6] | > 0 | any number of them",
                  "water | group of keys |  |  | the medium",
                  "water.milk_ml_m3 | number | 10 | >= 0 | milk in the water",
                  "water.scatter_scale | number | 1 | > 0 | ",
                  "balls | list of groups |  |  | of the marker",  //
                  "balls[].name | text | ball |  | colour",
                  "balls[].radius_m | number | 0.02 | in [0.001, 1] | radius",
                  "balls[].p_m | list of 3 numbers | [0, 0, 0.07] |  | centre in the marker",
                  "balls[].inside | group of keys |  |  | what it is filled with",
                  "balls[].inside.milk_ml_m3 | number | 10 | >= 0 | milk in the water",
                  "balls[].inside.scatter_scale | number | 1 | > 0 | ",
                  "nothing | group of keys | {} |  | "));
}

}  // namespace
}  // namespace turbidock::config
