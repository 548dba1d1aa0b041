// Keys in dots: fields that are in groups, whatever struct their members are in.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "tests/support/message_of.h"

namespace turbidock::config {
namespace {

using ::testing::ElementsAre;
using testing::MessageOf;

struct Lamp {
  double power_w = 1;

  static void Fields(auto& self, auto&& field) {
    field("power_w", self.power_w, InRange(0, 9), "power of the lamp");
  }
};

// A model that sets its power, and whose fields are listed otherwise than its groups.
struct Ship {
  std::string name;
  Lamp lamp;
  int64_t crew = 2;
  std::string model;

  static constexpr std::array<std::pair<const char*, const char*>, 2> kGroups = {
      {{"deck", "what is on deck"}, {"lamp", "the lamp"}}};
  static void Fields(auto& self, auto&& field) {
    field("lamp.model", self.model, Finite(), "maker's name of the lamp");
    field("lamp", self.lamp, Finite(), "");
    field("deck.people.crew", self.crew, AtLeast(1), "number of people");
    field("name", self.name, Finite(), "name of the ship");
  }
  static constexpr std::array kPresets = {"lamp.model"};
  void Given(const std::string& key) {
    if (key == "lamp.model") lamp.power_w = model == "large" ? 8 : 2;
  }
};

Ship Read(const std::string& yaml, const std::vector<std::string>& assignments = {}) {
  std::vector<Assignment> layers = {{"", ParseYaml(yaml, "ship.yaml")}};
  for (const std::string& text : assignments) layers.push_back(ParseAssignment(text));
  Ship ship;
  ReadLayers(layers, &ship);
  return ship;
}

TEST(Groups, AreListedInTheirOrderAfterWhatIsInNone) {
  std::vector<std::string> lines;
  for (const KeyDoc& doc : ListKeys<Ship>()) lines.push_back(doc.key + ": " + doc.doc);
  EXPECT_THAT(lines, ElementsAre("name: name of the ship", "deck: what is on deck",
                                 "deck.people: ", "deck.people.crew: number of people",
                                 "lamp: the lamp", "lamp.model: maker's name of the lamp",
                                 "lamp.power_w: power of the lamp"));
}

TEST(Groups, AreReadSetSavedAndChecked) {
  const Ship ship = Read("deck: {people: {crew: 3}}\nlamp: {power_w: 4}\n", {"name=Rana"});
  EXPECT_EQ(ship.crew, 3);
  EXPECT_EQ(ship.lamp.power_w, 4);
  EXPECT_EQ(ValueOf(ship, "deck.people.crew"), "3");
  EXPECT_EQ(SaveYaml(Read(SaveYaml(ship))), SaveYaml(ship));
  EXPECT_EQ(Read("name: A\n", {"deck.people.crew=5"}).crew, 5);
  EXPECT_EQ(MessageOf([] { Read("deck:\n  people:\n    crew: 0\n"); }),
            "ship.yaml:3: deck.people.crew = 0, must be >= 1");
  EXPECT_EQ(MessageOf([] { Read("crew: 3\n"); }),
            "ship.yaml:1: crew: unknown key; did you mean deck.people.crew?");
  Ship wrong;
  wrong.lamp.power_w = 10;
  EXPECT_EQ(MessageOf([&] { CheckFields(wrong, ""); }), "lamp.power_w: 10 must be in [0, 9]");
}

// Also where the group is set as a whole.
TEST(Groups, HaveTheirPresetsReadFirst) {
  const std::string group = "{power_w: 5, model: large}";
  for (const Ship& ship : {Read("lamp: " + group + "\n"), Read("name: A\n", {"lamp=" + group})}) {
    EXPECT_EQ(ship.model, "large");
    EXPECT_EQ(ship.lamp.power_w, 5);
  }
  EXPECT_EQ(Read("name: A\n", {"lamp={power_w: 5}", "lamp.model=large"}).lamp.power_w, 8);
}

}  // namespace
}  // namespace turbidock::config
