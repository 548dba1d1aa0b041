// Keys that stand for others: they set them where they are given, and what is given later counts.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "tests/support/message_of.h"

namespace turbidock::config {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MessageOf;

enum class Size { kSmall, kLarge };
constexpr auto Names(Size) {
  return EnumList<Size>({{Size::kSmall, "small"}, {Size::kLarge, "large"}});
}

struct Box {
  Size preset = Size::kSmall;
  double length_m = 1, width_m = 1;

  static constexpr std::array kPresets = {"preset"};
  void Given(const std::string& key) {
    if (key == "preset") length_m = preset == Size::kLarge ? 9 : 1;
  }
  static void Fields(auto& self, auto&& field) {
    field("length_m", self.length_m, Above(0), "");
    field("width_m", self.width_m, Above(0), "");
    field("preset", self.preset, Range{}, "");
  }
};

// A preset of the whole for a key inside a group, and one inside a group for others.
struct Store {
  Box box;
  std::vector<Box> boxes;
  InputFile list;
  bool is_full = false;

  static constexpr std::array kPresets = {"is_full"};
  std::vector<std::string> told;
  void Given(const std::string& key) {
    told.push_back(key);
    if (key == "is_full") box.width_m = is_full ? 5 : 2;
    if (key == "box.length_m" && box.length_m > 100) throw ConfigError("box.length_m", "no room");
  }
  static void Fields(auto& self, auto&& field) {
    field("box", self.box, Range{}, "");
    field("boxes", self.boxes, Range{}, "");
    field("list", self.list, Range{}, "");
    field("is_full", self.is_full, Range{}, "");
  }
};

Store Read(const std::string& text, const std::vector<std::string>& assignments = {},
           GivenKeys* given = nullptr) {
  Store store;
  std::vector<Assignment> layers = {{"", ParseYaml(text, "s.yaml")}};
  for (const std::string& each : assignments) layers.push_back(ParseAssignment(each));
  ReadLayers(layers, &store, given);
  return store;
}

TEST(Presets, ComeBeforeTheOtherKeysOfTheirFile) {
  const Store store = Read("box: {length_m: 3, width_m: 4, preset: large}\nis_full: true\n");
  EXPECT_EQ(store.box.preset, Size::kLarge);
  EXPECT_EQ(store.box.length_m, 3);
  EXPECT_EQ(store.box.width_m, 4);
  EXPECT_EQ(Read("box: {preset: large}").box.length_m, 9);
  EXPECT_EQ(Read("is_full: true").box.width_m, 5);
}

TEST(Presets, SetTheirKeysWhereTheyAreGiven) {
  const std::string file = "box: {length_m: 3, width_m: 4}\n";
  EXPECT_EQ(Read(file, {"box.preset=large"}).box.length_m, 9);
  EXPECT_EQ(Read(file, {"box.preset=large"}).box.width_m, 4);  // none of its keys
  EXPECT_EQ(Read(file, {"box.preset=large", "box.length_m=7"}).box.length_m, 7);
  EXPECT_EQ(Read(file, {"box.length_m=7", "box.preset=large"}).box.length_m, 9);
  EXPECT_EQ(Read(file, {"box={length_m: 7, preset: large}"}).box.length_m, 7);
  EXPECT_EQ(Read(file, {"is_full=true"}).box.width_m, 5);
  EXPECT_EQ(Read("boxes: [{length_m: 2, preset: large}, {preset: large}]").boxes[0].length_m, 2);
  EXPECT_EQ(Read("boxes: [{}]", {"boxes[0].preset=large"}).boxes[0].length_m, 9);
}

TEST(Presets, SayOnceWhichValuesTheyUndo) {
  GivenKeys given;
  Read("box: {length_m: 3}", {"box.length_m=7", "box.width_m=7", "box.preset=large"}, &given);
  EXPECT_THAT(given.remarks,
              ElementsAre("box.preset = large also sets what was given before: box.length_m (7)"));
  GivenKeys of_a_file;
  Read("{box: {length_m: 3, width_m: 7}}", {"box={preset: large, width_m: 7}", "is_full=true"},
       &of_a_file);
  EXPECT_THAT(of_a_file.remarks,
              ElementsAre("box.preset = large also sets what was given before: box.length_m (3)",
                          "is_full = true also sets what was given before: box.width_m (7)"));
  GivenKeys none;
  Read("box: {length_m: 3}", {"box.preset=large", "box.length_m=7"}, &none);
  EXPECT_THAT(none.remarks, ElementsAre());
}

TEST(Presets, AGroupIsToldOfEveryKeyInIt) {
  EXPECT_THAT(Read("{}", {"box.length_m=2", "is_full=true"}).told,
              ElementsAre("box.length_m", "is_full"));
  EXPECT_THAT(Read("box: {length_m: 2}").told, ElementsAre("box.length_m", "box"));
  EXPECT_EQ(MessageOf([] { Read("box:\n  length_m: 200\n"); }), "s.yaml:2: box.length_m: no room");
}

TEST(Presets, StandForNothingInWhatIsResolved) {
  Store store;
  ReadResolved(ParseYaml("box: {preset: large}\nlist: gone/away.csv\n", "r.yaml"), &store);
  EXPECT_EQ(store.box.length_m, 1);
  EXPECT_EQ(store.list.path, "gone/away.csv");
  EXPECT_THAT(PresetsOf(store), ElementsAre("is_full", "box.preset"));
}

TEST(InputFiles, AreBesideWhatNamesThem) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / "turbidock_input_files";
  fs::create_directories(folder / "sub");
  for (const char* name : {"a.csv", "sub/a.csv"}) std::ofstream(folder / name) << "x\n";
  const auto read = [&](const std::string& name, const std::string& file) {
    Store store;
    ReadLayers({{"list", ParseYamlValue(name, {nullptr, file, "list"})}}, &store);
    return store.list.path;
  };
  const std::string plan = (folder / "plan.yaml").string();
  EXPECT_EQ(read("a.csv", plan), (folder / "a.csv").string());
  EXPECT_EQ(read("sub/../sub/a.csv", plan), (folder / "sub/a.csv").string());
  EXPECT_EQ(read((folder / "a.csv").string(), kFromSet), (folder / "a.csv").string());
  EXPECT_EQ(read("station.xml", plan), "station.xml");  // a bundled model
  EXPECT_EQ(read("''", plan), "");
  EXPECT_THAT(MessageOf([&] { read("b.csv", plan); }),
              HasSubstr("plan.yaml:1: list = 'b.csv', is no file"));
  EXPECT_THAT(MessageOf([&] { read("a.csv", kFromSet); }),
              HasSubstr("--set list = 'a.csv', is no file"));
  fs::remove_all(folder);
  EXPECT_THAT(FilesNamedIn(Read("list: ''")), ElementsAre());
}

}  // namespace
}  // namespace turbidock::config
