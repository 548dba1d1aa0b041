// The same answer everywhere: digests of the physics and of the estimator on stored images, as they
// were committed (tests/data/golden/digests.txt), on this machine and on it as if it had no AVX2
// and no FMA. They may change only in a commit that says why: run this test with
// TURBIDOCK_UPDATE_GOLDEN=1, which writes the file, and commit it.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sim/base/digest.h"
#include "tests/support/program.h"

namespace turbidock::trial {
namespace {

using testing::ProgramEnd;
using testing::RunProgram;

const std::string kFile = TURBIDOCK_TEST_DATA "/golden/digests.txt";

std::map<std::string, std::string> Golden() {
  std::map<std::string, std::string> golden;
  std::ifstream file(kFile);
  for (std::string name, digest; file >> name >> digest;) golden[name] = digest;
  return golden;
}

void Expect(const std::string& name, const std::string& digest) {
  std::map<std::string, std::string> golden = Golden();
  if (std::getenv("TURBIDOCK_UPDATE_GOLDEN")) {
    golden[name] = digest;
    std::ofstream file(kFile);
    for (const auto& [key, value] : golden) file << key << " " << value << "\n";
  }
  EXPECT_EQ(golden[name], digest) << name;
}

// As the processor is, and without what the libraries choose their code by.
const std::vector<std::vector<std::string>> kProcessors = {
    {}, {"GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-AVX2_Usable,-FMA,-FMA_Usable,-AVX512F"}};

TEST(GoldenDigest, OfThePhysicsUnderEachLaw) {
  int compared = 0;
  for (const std::string scenario : {"sea_night_active", "paper_sea_night_active"})
    for (const auto& processor : kProcessors) {
      const ProgramEnd end =
          RunProgram({"run", scenario, "--seed", "3", "--quiet", "--json", "--set",
                      "estimator.pose_source=true_pose", "--set", "trial.duration_s=8"},
                     processor);
      ASSERT_EQ(end.exit_code, 0) << end.err;
      Expect("physics." + scenario, nlohmann::json::parse(end.out).at("digest"));
      ++compared;
    }
  EXPECT_EQ(compared, 4);
}

TEST(GoldenDigest, OfTheEstimatorOnStoredImages) {
  const std::string images = TURBIDOCK_TEST_DATA "/pathtraced/";
  int compared = 0;
  using Views = std::vector<std::pair<std::string, std::string>>;
  for (const auto& [view, preset] : Views{{"active_015ml_0500mm", "default"},
                                          {"active_060ml_0900mm", "default"},
                                          {"passive_005ml_0500mm", "default"},
                                          {"passive_005ml_0500mm", "published"}})
    for (const auto& processor : kProcessors) {
      const ProgramEnd end =
          RunProgram({"estimate", "--left", images + view + "_left.png", "--right",
                      images + view + "_right.png", "--set", "estimator.rm_ga.preset=" + preset,
                      "--frames", "10", "--quiet", "--json"},
                     processor);
      ASSERT_EQ(end.exit_code, 0) << end.err;
      const auto json = nlohmann::json::parse(end.out);
      Digest digest;
      for (const double x : json.at("position_m")) digest.Add(x);
      for (const double x : json.at("quaternion_wxyz")) digest.Add(x);
      digest.Add(json.at("fitness").get<double>());
      digest.Add(json.at("evaluations").get<int64_t>());
      Expect("estimate." + view + (preset == "default" ? "" : "." + preset), digest.Hex());
      ++compared;
    }
  EXPECT_EQ(compared, 8);
}

}  // namespace
}  // namespace turbidock::trial
