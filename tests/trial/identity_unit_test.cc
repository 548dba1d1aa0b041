// What a trial's identity depends on beyond keys: places and contents of its files.

#include "experiments/trial/identity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "experiments/trial/scenario.h"
#include "tests/support/message_of.h"

namespace turbidock::trial {
namespace {

std::string IdentityWith(const std::vector<ModelFile>& files) {
  Scenario scenario = LoadScenario("pool_active", {});
  scenario.model_files = files;
  return IdentityOf(scenario, "program", "renderer");
}

TEST(Identity, OwnFilesOfOneNameAreApartByTheirPlaces) {
  const std::string identity =
      IdentityWith({{"/x/a/m.stl", "1"}, {"/x/b/m.stl", "2"}, {"/x/scene.xml", "3"}});
  EXPECT_NE(IdentityWith({{"/x/a/m.stl", "2"}, {"/x/b/m.stl", "1"}, {"/x/scene.xml", "3"}}),
            identity);
  EXPECT_EQ(IdentityWith({{"/y/z/a/m.stl", "1"}, {"/y/z/b/m.stl", "2"}, {"/y/z/scene.xml", "3"}}),
            identity)
      << "the folder of all may be anywhere";
}

TEST(RequireSameFiles, OneThatHasAppearedIsNamed) {
  Scenario scenario = LoadScenario("pool_active", {});
  scenario.model_files = ModelFilesOf(scenario);
  EXPECT_EQ(testing::MessageOf([&] { RequireSameFiles(scenario); }), "no error");
  const std::string name = scenario.model_files.back().file;
  scenario.model_files.pop_back();
  EXPECT_THAT(testing::MessageOf([&] { RequireSameFiles(scenario); }),
              ::testing::HasSubstr(name + " was not there when the trials were begun"));
}

}  // namespace
}  // namespace turbidock::trial
