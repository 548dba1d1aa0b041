// The bench: its stages add up, its repeats are the same trial, and timing a trial changes nothing.

#include "experiments/studies/bench/bench.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "experiments/studies/bench/instructions.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/trial.h"
#include "tests/support/program.h"

namespace turbidock::bench {
namespace {

using testing::ProgramEnd;
using testing::RunProgram;

TEST(StageTimer, EveryLapCountsOnce) {
  StageTimer timer;
  Lap(&timer, LoopStage::kWater);
  Lap(&timer, LoopStage::kWater);
  Lap(&timer, LoopStage::kLog);
  const StageTimer::Seconds seconds = timer.Take();
  for (size_t k = 0; k < kLoopStages; ++k) {
    const bool lapped =
        k == static_cast<size_t>(LoopStage::kWater) || k == static_cast<size_t>(LoopStage::kLog);
    EXPECT_EQ(seconds[k] > 0, lapped) << k;
  }
  EXPECT_EQ(timer.Take(), StageTimer::Seconds{});
  Lap(nullptr, LoopStage::kWater);  // nobody wants to know
}

TEST(Bench, ATrialOfOneFrameIsRefused) {
  const ProgramEnd end = RunProgram({"bench", "pool_active", "--frames", "2", "--repeats", "1",
                                     "--set", "trial.duration_s=0.001"});
  EXPECT_EQ(end.exit_code, 2);
  EXPECT_EQ(end.out, "");
  EXPECT_THAT(end.err, ::testing::HasSubstr("ends after 1 frame; timing it takes 2 at least"));
}

TEST(Bench, TimesTheTrialItself) {
  const trial::Scenario scenario = trial::LoadScenario(
      "pool_passive",
      {"cameras.rig.width_px=160", "cameras.rig.height_px=120", "trial.duration_s=3"});
  std::vector<int> done;
  BenchOptions options;
  options.frames = 40;
  options.repeats = 2;
  options.on_repeat = [&](int now) { done.push_back(now); };
  const BenchResult result = RunBench(scenario, options);
  EXPECT_EQ(done, (std::vector{1, 2}));
  ASSERT_EQ(result.repeats.size(), 2u);
  const Times times = MedianTimes(result.repeats);
  EXPECT_EQ(times.frames, 40);
  EXPECT_LE(times.evaluations / 40, 540);  // 60 + 20 * 24, refinement included
  EXPECT_GE(times.evaluations / 40, 537);  // three refined poses at most

  for (size_t k = 0; k < kLoopStages; ++k) EXPECT_GT(times.stages_s[k], 0) << k;
  EXPECT_GT(times.bare_s, 0);
  EXPECT_NEAR(times.simulated_s, 40 / 30.0, 1e-9);

  // Without a stopwatch it is the same trial.
  trial::Scenario as_long = scenario;
  as_long.duration_s = 40 / 30.0;
  EXPECT_EQ(trial::RunTrial(as_long).digest, result.digest);
}

// By hand: of each block the repeat with the median time, of the trial the sum of its blocks.
TEST(Bench, ResultsAreMediansOfRepeatsAndSumsOfBlocks) {
  const auto block = [](int frames, double frame_s, double bare_s) {
    Times one{.frames = frames,
              .simulated_s = 0.05 * frames,
              .bare_s = bare_s * frames,
              .evaluations = 100.0 * frames};
    one.stages_s.fill(frame_s * frames / kLoopStages);
    return one;
  };
  const report::Json json =
      ResultJson({{.scenario = "made up",
                   .renderer = "none",
                   .repeats = {{block(30, 0.01, 0.01), block(10, 0.04, 0.01)},
                               {block(30, 0.02, 0.02), block(10, 0.03, 0.03)},
                               {block(30, 0.09, 0.03), block(10, 0.02, 0.02)}}}});
  EXPECT_EQ(json["frames"], 40);
  const double frame_ms = 1000 * (30 * 0.02 + 10 * 0.03) / 40;
  EXPECT_NEAR(json["frame_ms"], frame_ms, 1e-9);
  EXPECT_NEAR(json["bare_render_ms"], 20, 1e-9);
  EXPECT_NEAR(json["ratio_to_bare_render"], frame_ms / 20, 1e-9);
  EXPECT_NEAR(json["real_time_factor"], 50 / frame_ms, 1e-9);
  EXPECT_NEAR(json["evaluations_per_frame"], 100, 1e-9);
  EXPECT_NEAR(json["evaluations_per_s"], 1e5 * kLoopStages / frame_ms, 1e-6);
  EXPECT_EQ(json["scenarios"][0]["frame_ms"], json["frame_ms"]);

  // as fast as the slowest scenario
  EXPECT_EQ(ReportOf(json).verdict.word, "faster than real time");
  report::Json two = json;
  two["scenarios"].push_back(json["scenarios"][0]);
  two["scenarios"][1]["real_time_factor"] = 0.5;
  EXPECT_EQ(ReportOf(two).verdict.word, "slower than real time");
  EXPECT_THAT(ReportOf(two).verdict.reason,
              ::testing::HasSubstr("0.50 times real time in the slowest of 2"));
}

TEST(BenchCommand, PrintsTheContractsKeys) {
  const ProgramEnd end =
      RunProgram({"bench", "pool_active", "--set", "cameras.rig.width_px=160", "--set",
                  "cameras.rig.height_px=120", "--frames", "31", "--repeats", "1", "--json"});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  const auto json = nlohmann::json::parse(end.out);
  for (const char* key : {"frame_ms", "bare_render_ms", "ratio_to_bare_render", "real_time_factor",
                          "evaluations_per_s"})
    EXPECT_GT(json.at(key), 0.0) << key;
  double sum = 0;
  for (const double ms : json.at("stages_ms")) sum += ms;
  EXPECT_NEAR(sum, json.at("frame_ms"), 1e-9);
  EXPECT_EQ(json.at("stages_ms").size(), kLoopStages);
  EXPECT_GT(json.at("marker_seen_share"), 0.5);
  EXPECT_LE(json.at("marker_seen_share"), 1);
  EXPECT_EQ(json.at("scenarios").size(), 1u);
  EXPECT_EQ(json.at("scenarios")[0].at("frame_ms"), json.at("frame_ms"));
  EXPECT_EQ(json.at("kind"), "bench");
}

TEST(BenchCommand, BadInput) {
  EXPECT_EQ(RunProgram({"bench", "no_such_scenario"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"bench", "--frames", "1"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"bench", "--repeats", "0"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"bench", "--set", "no.such_key=1"}).exit_code, 2);
  EXPECT_THAT(RunProgram({"bench", "pool_active", "--instructions", "x.csv"}).err,
              ::testing::HasSubstr("excludes"));
  EXPECT_EQ(RunProgram({"bench", "--instructions", "no_such_table.csv"}).exit_code, 2);
}

// As callgrind writes it: names are given once, a call's line has what it costs with all it calls.
std::string CallgrindText() {
  std::string text = "events: Ir\nfn=(1) main\n0 5\n";
  int id = 10;
  for (const auto& [name, cost] : std::initializer_list<std::pair<const char*, int>>{
           {"turbidock::view::StereoRenderer::Render(mjData_ const&)", 100},
           {"turbidock::light::Water::Prepare(int)", 30},
           {"turbidock::light::Water::PaintRows(int)", 12},
           {"turbidock::camera::ImageSensor::DigitiseRegion(int)", 200},
           {"turbidock::vision::RmGa::Update(int)", 70},
           {"turbidock::control::Autopilot::Update(int)", 7},
           {"turbidock::vehicle::Plant::Step[abi:cxx11](int)", 8}})
    text += fmt::format("cfn=({}) {}\ncalls=2 0\n0 {}\n", id++, name, cost);
  // a function of a stage that calls itself under another name is counted once
  text += "fn=(10)\n0 1\ncfn=(10)\ncalls=1 0\n0 60\n";
  text += "fn=(14)\n0 1\ncfn=(20) turbidock::vision::HueLabeller::Label(int)\ncalls=1 0\n0 9\n";
  return text + "totals: 1000\n";
}

TEST(Instructions, AreCountedByStage) {
  const std::map<std::string, double> stages = CountStages(CallgrindText());
  const std::map<std::string, double> expected = {
      {"render", 100}, {"water", 42},  {"sensor", 200}, {"labels", 9},  {"estimate", 61},
      {"control", 7},  {"physics", 8}, {"rest", 573},   {"frame", 1000}};
  EXPECT_EQ(stages, expected);
  // of two frames, whose files stand one after the other, the sum
  for (const auto& [stage, number] : CountStages(CallgrindText() + CallgrindText()))
    EXPECT_EQ(number, 2 * expected.at(stage)) << stage;
  EXPECT_THROW(CountStages("totals: 1000\n"), ConfigError);
}

TEST(Instructions, MayGrowByFivePercentOfAStage) {
  const Instructions table = {{"whole", {{"sensor", 100}, {"control", 1}, {"frame", 1000}}}};
  const auto grown = [&](double sensor, double control) {
    return Grown({{"whole", {{"sensor", sensor}, {"control", control}, {"frame", 1000}}}}, table);
  };
  EXPECT_THAT(grown(104.9, 10), ::testing::IsEmpty());
  EXPECT_THAT(grown(105.1, 1), ::testing::ElementsAre("whole: sensor"));
  EXPECT_THAT(grown(10, 10.6), ::testing::ElementsAre("whole: control"));
}

Instructions Counted(double number) {
  Instructions now;
  for (const char* column : {"active, region", "active, whole", "passive, whole"})
    for (const char* stage : kCountedStages) now[column][stage] = number;
  return now;
}

TEST(Instructions, KeepWhatATableSaysOfItself) {
  const std::string path = ::testing::TempDir() + "instructions.csv";
  std::ofstream(path) << "# title: a table\n# date: 2001-01-01\n# machine: mine\n";
  WriteInstructions(path, Counted(2e6));
  EXPECT_EQ(ReadInstructions(path), Counted(2e6));
  const std::string text = system::ReadWhole(path);
  EXPECT_THAT(text, ::testing::StartsWith("# title: a table\n# machine: mine\n# date: 20"));
  EXPECT_THAT(text, ::testing::Not(::testing::HasSubstr("2001")));
}

// Nothing passes for being compared with a table of something else, or with none of a stage.
TEST(Instructions, AreReadFromSuchATableAlone) {
  const std::string path = ::testing::TempDir() + "instructions.csv";
  std::filesystem::remove(path);
  EXPECT_THROW(ReadInstructions(path), ConfigError);
  WriteInstructions(path, Counted(2e6));
  const std::string whole = system::ReadWhole(path);
  const auto error = [&](const std::string& from, const std::string& to) -> std::string {
    std::string text = whole;
    text.replace(text.find(from), from.size(), to);
    std::ofstream(path) << text;
    try {
      ReadInstructions(path);
    } catch (const ConfigError& what) {
      return what.what();
    }
    return "";
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(error("active, whole", "over run"),
              HasSubstr(":3: no column of such a table: over run"));
  EXPECT_THAT(error(",\"passive, whole\"", ""), HasSubstr(":3: its columns must be"));
  EXPECT_THAT(error("water,2.000", "water,nan"), HasSubstr(":5: no number of instructions: nan"));
  EXPECT_THAT(error("water,2.000", "water,-2"), HasSubstr("no number of instructions: -2"));
  EXPECT_THAT(error("water,", "fire,"), HasSubstr(":5: no stage: fire"));
  EXPECT_THAT(error("frame,2.000,2.000,2.000\n", ""), HasSubstr("has no row frame"));
  EXPECT_THAT(error("water,2.000,", "water,"), HasSubstr(":5: 3 cells, must be 4"));
  EXPECT_EQ(error("water,2.000,2.000,2.000\n", "water,2.000,2.000,2.000\r\n"), "");
}

}  // namespace
}  // namespace turbidock::bench
