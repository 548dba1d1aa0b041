// --set, layers of files, saving, the table of keys.

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
