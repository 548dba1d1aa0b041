// Strict YAML: every kind of bad input with its exact message.

#include "tests/config/yaml_samples.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "tests/support/message_of.h"

namespace turbidock::config {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MessageOf;

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

}  // namespace
}  // namespace turbidock::config
