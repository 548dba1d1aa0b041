// A plug-in that throws, gives NaN or never returns, in worker processes: an outcome with a log,
// and the other trials go on.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <map>

#include "experiments/batch/job_pool.h"
#include "experiments/batch/runner.h"
#include "experiments/trial/plugin_of.h"
#include "experiments/trial/scenario.h"

namespace turbidock::batch {
namespace {

using ::testing::HasSubstr;

class OddController final : public control::Controller {
 public:
  struct Params {
    std::string does = "nothing";
    static void Fields(auto& self, auto&& field) {
      field("does", self.does, Finite(), "what it does instead of steering");
    }
  };
  OddController(const Params& params, const ClockParams&) : params_(params) {}
  void Observe(const control::Observation&) override {}
  control::Axes Demand(const control::Reference&) override {
    if (params_.does == "throw") throw ConfigError("gain = -1, must be >= 0");
    if (params_.does == "hang")
      for (;;) pause();
    return {0, 0, 0, params_.does == "nan" ? std::nan("") : 0};
  }
  void OnCommandApplied(int64_t, const control::Axes&) override {}

 private:
  Params params_;
};

TEST(PluginInWorker, ItsFailureIsTheTrialsOwn) {
  trial::Plugins plugins;
  plugins.AddController<OddController>("odd");
  const std::vector<std::string> does = {"nothing", "throw", "nan", "hang", "nothing"};
  const auto pool = MakePool({.workers = 1}, /*time_limit_s=*/4, TrialWork(plugins));
  for (size_t i = 0; i < does.size(); ++i)
    pool->Submit(TrialJob(
        static_cast<int64_t>(i),
        trial::LoadScenario("pool_active",
                            {"estimator.pose_source=true_pose", "control.use=odd",
                             "control.odd.does=" + does[i], "trial.duration_s=3", "trial.seed=7"},
                            "", plugins)));
  std::map<int64_t, trial::TrialRecord> records;
  while (pool->pending() > 0)
    if (const auto ended = pool->Next(10))
      records[ended->id] = FinishedTrialOf(*ended, {.seed = 7, .parameters = {}}).record;
  ASSERT_EQ(records.size(), does.size());
  EXPECT_TRUE(records[0].ended());
  // also what our own code would take for bad input, which ends a batch
  EXPECT_EQ(records[1].outcome, trial::Outcome::kCrashed);
  EXPECT_THAT(records[1].printed, HasSubstr("controller odd, Demand at frame"));
  EXPECT_THAT(records[1].printed, HasSubstr("gain = -1, must be >= 0"));
  EXPECT_EQ(records[2].outcome, trial::Outcome::kCrashed);
  EXPECT_THAT(records[2].printed, HasSubstr("not finite"));
  EXPECT_EQ(records[3].outcome, trial::Outcome::kHung);
  EXPECT_EQ(records[4].digest, records[0].digest);
}

}  // namespace
}  // namespace turbidock::batch
