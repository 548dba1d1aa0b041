// The results file: what is stored comes back, and nothing that does not belong gets in.

#include <SQLiteCpp/SQLiteCpp.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "experiments/batch/job_pool.h"
#include "experiments/batch/result_store.h"
#include "experiments/batch/runner.h"
#include "experiments/batch/summary.h"
#include "experiments/system/build_info.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/trial.h"
#include "tests/support/message_of.h"
#include "tests/support/own_folder.h"
#include "tests/support/stored_trials.h"

namespace turbidock::batch {
namespace {

namespace fs = std::filesystem;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

StoreHeader Header() {
  return {.plan = "seeds: 10\nset: a\n",
          .build = "1.0 f00",
          .shard = {},
          .trials = 10,
          .keys = {"water.milk_ml_m3", "sea.state"}};
}

StoredTrial Trial(int64_t trial, const std::string& milk, trial::Failure failure) {
  StoredTrial stored{
      trial, trial / 2, trial % 2, {{"water.milk_ml_m3", milk}, {"sea.state", "calm"}}, {}};
  trial::TrialRecord& r = stored.record;
  r.seed = 0x7fffffffffffffff - trial;  // more digits than a double has
  testing::End(&r, failure);
  r.reason = "said \"why\", and\nhow";
  r.time_s = 1.0 / 3 + static_cast<double>(trial);
  r.digest = "d" + std::to_string(trial);
  r.insertion_time_s = -0.0;
  r.first_dock_contact = trial::Contact{2.5, 1.0 / 7};
  r.stage_time_s = {{control::Stage::kDocking, 0.1}};
  r.wall_time_s = 0.1;
  r.cpu_time_s = 0.2;
  r.rss_bytes = 1 << 30;
  return stored;
}

class Store : public testing::OwnFolder {
 protected:
  // What opening for writing says.
  static std::string Refusal(const std::string& file, const StoreHeader& header) {
    return testing::MessageOf([&] { ResultStore::Write(file, header); });
  }
};

// The columns of a vehicle's own thrusters are added as it comes, also by a merge, and are no other
// trial's.
TEST_F(Store, KeepsTheSeriesOfVehiclesWithOtherThrusters) {
  const auto series = [](const std::vector<std::string>& thrusters) {
    trial::TrialLog log{.thrusters = thrusters};
    log.frames.resize(2);
    log.frames[1].frame = 1;
    for (trial::FrameRecord& frame : log.frames)
      for (size_t i = 0; i < thrusters.size(); ++i)
        frame.command.volts.push_back(1 + static_cast<double>(i));
    return trial::Series::Of(log);
  };
  StoredTrial published = Trial(1, "7", trial::Failure::kNone);
  published.series = series({"surge_left", "surge_right", "sway", "heave"});
  StoredTrial other = Trial(2, "8", trial::Failure::kNone);
  other.series = series({"port", "starboard"});
  {
    ResultStore store = ResultStore::Write(File("a.db"), Header());
    store.Add(published);
    ResultStore part = ResultStore::Write(File("b.db"), Header());
    part.Add(other);
  }
  ResultStore::Write(File("a.db"), Header()).Merge(File("b.db"));
  const ResultStore store = ResultStore::Read(File("a.db"));
  EXPECT_EQ(store.SeriesOf(1).Csv(), published.series.Csv());
  EXPECT_EQ(store.SeriesOf(2).Csv(), other.series.Csv());
}

TEST_F(Store, GivesBackWhatItWasGiven) {
  const std::string file = File("a.db");
  StoredTrial odd{4, 2, 0, {{"water.milk_ml_m3", "2.5e-3"}, {"sea.state", "calm"}}, {}};
  odd.record.outcome = trial::Outcome::kCrashed;
  odd.record.failure = trial::Failure::kCrashed;
  odd.record.printed = "core dumped";
  trial::TrialLog log;
  log.frames.resize(2);
  log.frames[1].frame = 30;
  log.frames[1].time_s = 1.0 / 3;
  log.frames[1].fitness = -0.0;
  StoredTrial with_series = Trial(1, "7", trial::Failure::kNone);
  with_series.series = trial::Series::Of(log);
  {
    ResultStore store = ResultStore::Write(file, Header());
    store.Add(odd);
    store.Add(with_series);
  }
  const ResultStore store = ResultStore::Read(file);
  EXPECT_EQ(store.header().keys, Header().keys);
  EXPECT_EQ(store.header().plan, Header().plan);
  EXPECT_EQ(store.header().trials, 10);
  EXPECT_EQ(store.Done(), (std::vector<int64_t>{1, 4}));
  EXPECT_EQ(store.Successes(), (std::map<int64_t, bool>{{1, true}, {4, false}}));
  EXPECT_EQ(store.SeriesOf(1).Csv(), with_series.series.Csv());
  EXPECT_EQ(store.SeriesOf(4).rows(), 0u);
  odd.parameters[0].value = "0.0025";
  const auto trials = store.Trials();
  ASSERT_EQ(trials.size(), 2u);
  EXPECT_TRUE(trials[0].record == with_series.record);
  EXPECT_TRUE(trials[1].record == odd.record);
  EXPECT_EQ(trials[1].parameters, odd.parameters);
  EXPECT_EQ(trials[1].cell, 2);
  EXPECT_THROW(store.Trial(2), ConfigError);
}

TEST_F(Store, RefusesWhatWasBegunAsSomethingElse) {
  const std::string file = File("a.db");
  ResultStore::Write(file, Header()).Add(Trial(1, "7", trial::Failure::kNone));
  StoreHeader other = Header();
  other.plan = "seeds: 10\nset: b\n";
  EXPECT_THAT(Refusal(file, other), HasSubstr("the plans differ: set: a then, b now"));
  other = Header();
  other.build = "1.0 f01";
  EXPECT_THAT(Refusal(file, other), HasSubstr("the builds differ: 1.0 f00 and 1.0 f01"));
  other = Header();
  other.shard = {1, 2};
  EXPECT_THAT(Refusal(file, other), HasSubstr("the file has shard 1/1, this is shard 1/2"));
  other = Header();
  other.kind = "tune";
  EXPECT_THAT(Refusal(file, other), HasSubstr("one was written by batch, the other by tune"));
  EXPECT_EQ(Refusal(file, Header()), "no error");
  EXPECT_EQ(ResultStore::Read(file).Done().size(), 1u);
}

TEST_F(Store, KeepsOtherWritersOutAndReadersIn) {
  const std::string file = File("a.db");
  {
    ResultStore store = ResultStore::Write(file, Header());
    store.Add(Trial(1, "7", trial::Failure::kNone));
    EXPECT_TRUE(IsLocked(file));
    EXPECT_THAT(Refusal(file, Header()), HasSubstr("another run is writing to this file"));
    EXPECT_EQ(ResultStore::Read(file).Done().size(), 1u);
  }
  EXPECT_FALSE(IsLocked(file));
  EXPECT_EQ(Refusal(file, Header()), "no error");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);  // no lock or journal is left
}

TEST_F(Store, SaysWhatIsNoResultFileOrADamagedOne) {
  std::ofstream(File("text.db")) << std::string(5000, 'x');
  EXPECT_THAT(Refusal(File("text.db"), Header()), HasSubstr("is no result file"));
  EXPECT_THAT(Refusal("/proc/a.db", Header()), HasSubstr("cannot be written"));
  EXPECT_THROW(ResultStore::Read(File("none.db")), ConfigError);
  ResultStore::Write(File("cut.db"), Header()).Add(Trial(1, "7", trial::Failure::kNone));
  fs::resize_file(File("cut.db"), 8192);
  EXPECT_THAT(Refusal(File("cut.db"), Header()), HasSubstr("is damaged"));
  EXPECT_EQ(fs::file_size(File("cut.db")), 8192u);  // and is left as it was
}

// A file may come from anywhere.
TEST_F(Store, RefusesTablesThatAreNotItsOwn) {
  struct Case {
    const char* sql;
    const char* said;
  };
  const Case cases[] = {
      {"DROP TABLE meta", "no such table: meta"},
      {"DROP VIEW results; DROP TABLE trials; CREATE VIEW trials AS SELECT 1 AS trial",
       "it has a view trials"},
      {"DROP VIEW results; DROP TABLE trials; CREATE VIRTUAL TABLE trials USING rtree(a, b, c)",
       "it has a table trials"},
      {"CREATE TRIGGER t AFTER INSERT ON trials BEGIN DELETE FROM meta; END", "it has a trigger t"},
      {"DROP VIEW results; ALTER TABLE trials DROP COLUMN digest", "no such column: .?digest"},
      {"DROP VIEW results; ALTER TABLE trials RENAME COLUMN cell TO sell",
       "no such column: .?cell"},
      {"DROP VIEW results; ALTER TABLE trials DROP COLUMN jam_time_s",
       "no such column: .?jam_time_s"},
  };
  for (const Case& c : cases) {
    const std::string file = File("a.db");
    fs::remove(file);
    ResultStore::Write(file, Header()).Add(Trial(1, "7", trial::Failure::kNone));
    SQLite::Database(file, SQLite::OPEN_READWRITE).exec(c.sql);
    const std::string said = testing::MessageOf([&] {
      const ResultStore store = ResultStore::Read(file);
      store.Trials();
      store.SeriesOf(1);
    });
    EXPECT_THAT(said, HasSubstr(file + ": is no result file of this program")) << c.sql;
    EXPECT_THAT(said, ContainsRegex(c.said)) << c.sql;
  }
}

// Of a program before or after this one.
TEST_F(Store, RefusesAnotherVersionOfTheSchema) {
  const std::string file = File("a.db");
  ResultStore::Write(file, Header());
  SQLite::Database(file, SQLite::OPEN_READWRITE).exec("PRAGMA user_version = 2");
  EXPECT_EQ(Refusal(file, Header()), file + ": has schema version 2, this program reads 8");
}

TEST_F(Store, RefusesSeriesThatCannotBe) {
  const std::string file = File("a.db");
  trial::TrialLog log;
  log.frames.resize(2);
  log.frames[1].frame = 1;
  StoredTrial stored = Trial(1, "7", trial::Failure::kNone);
  stored.series = trial::Series::Of(log);
  ResultStore::Write(file, Header()).Add(stored);
  const auto said_after = [&](const std::string& sql) -> std::string {
    SQLite::Database(file, SQLite::OPEN_READWRITE).exec(sql);
    return testing::MessageOf([&] { ResultStore::Read(file).SeriesOf(1); });
  };
  EXPECT_EQ(said_after("VACUUM"), "no error");
  EXPECT_EQ(ResultStore::Read(file).SeriesOf(1).Csv(), stored.series.Csv());
  for (const auto& [bytes, said] :
       {std::pair{"substr(bytes, 1, length(bytes) - 1)", "is not this program's"},
        {"''", "a series: is no JSON"},
        {"'{}'", "series of trial 1: a series: "},
        {"'{\"rows\": 1, \"columns\": [[\"lunch\", \"int\"]]}'", "no log has a column lunch"},
        {"x'00ff'", "a series: is no JSON"}})
    EXPECT_THAT(said_after(fmt::format("UPDATE series SET bytes = {}", bytes)), HasSubstr(said))
        << bytes;
  EXPECT_THAT(said_after("DROP TABLE series"), HasSubstr("no such table: series"));
}

TEST_F(Store, RefusesValuesThatCannotBe) {
  struct Case {
    std::string sql;
    const char* said;
  };
  // With the hash that belongs to it.
  const auto plan = [](const std::string& text) {
    return fmt::format(
        "UPDATE meta SET value = '{}' WHERE key = 'plan'; "
        "UPDATE meta SET value = '{}' WHERE key = 'plan_hash'",
        text, DigestOf(text));
  };
  const Case cases[] = {
      {"UPDATE meta SET value = 'many' WHERE key = 'trials'", "its number of trials is 'many'"},
      {"UPDATE meta SET value = '9000000000000000000' WHERE key = 'trials'",
       "its number of trials is"},
      {"UPDATE meta SET value = '3' WHERE key = 'shard'", "--shard 3: must be I/N"},
      {"DELETE FROM meta WHERE key = 'build'", "it has no build"},
      {"UPDATE meta SET value = x'ff00' WHERE key = 'plan'", "plan is no text"},
      {plan("seeds: 3"), "its plan's seeds, precision and strata do not go together"},
      {"UPDATE meta SET value = 'seeds: 10' WHERE key = 'plan'", "its plan is not the one"},
      {plan("seeds: 10\nprecision: 0.1"), "its plan's seeds, precision"},
      {plan("seeds: 10\nstrata: 3"), "plan:2: strata: must be a group of keys"},
      {plan("seeds: 20"), "its plan's seeds, precision and strata do not go together"},
      {"UPDATE meta SET value = '15' WHERE key = 'trials'",
       "its plan's seeds, precision and strata do not go together"},
      {"UPDATE trials SET time_s = 'soon'", "trial 1: time_s: 'soon' is no number"},
      {"UPDATE trials SET docked = 7", "trial 1: docked: is out of range"},
      {"UPDATE trials SET returns_to_servoing = 1e300",
       "trial 1: returns_to_servoing: is out of range"},
      {"UPDATE trials SET outcome = 'well'", "trial 1: outcome: 'well' is no word of this program"},
      {"UPDATE trials SET trial = 77", "trial 77 is none of its plan's"},
      {"UPDATE trials SET cell = 'x'", "trial 1 is none of its plan's"},
      {"UPDATE meta SET value = '1/3' WHERE key = 'shard'",
       "trial 1 is none of its plan's and shard's"},
  };
  for (const Case& c : cases) {
    const std::string file = File("a.db");
    fs::remove(file);
    ResultStore::Write(file, Header()).Add(Trial(1, "7", trial::Failure::kNone));
    SQLite::Database(file, SQLite::OPEN_READWRITE).exec(c.sql);
    EXPECT_THAT(testing::MessageOf([&] { ResultStore::Read(file).Trials(); }),
                HasSubstr(std::string("is damaged (") + c.said))
        << c.sql;
  }
}

TEST_F(Store, ReadingChangesNothing) {
  const std::string file = File("a.db");
  ResultStore::Write(file, Header()).Add(Trial(1, "7", trial::Failure::kNone));
  fs::permissions(file, fs::perms::owner_read);
  const auto before = fs::last_write_time(file);
  EXPECT_EQ(ResultStore::Read(file).Trials().size(), 1u);
  EXPECT_EQ(fs::last_write_time(file), before);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

TEST_F(Store, OneLockForAllNamesOfAFile) {
  const std::string file = File("a.db"), link = File("link.db");
  const ResultStore store = ResultStore::Write(file, Header());
  fs::create_symlink("a.db", link);
  EXPECT_TRUE(IsLocked(link));
  EXPECT_THAT(Refusal(link, Header()), HasSubstr("another run"));
}

// A number is one in the file too, and text is text, whatever it looks like.
TEST_F(Store, KeepsTheTypeOfAParameter) {
  const std::string file = File("a.db");
  StoreHeader header = Header();
  header.keys = {"water.milk_ml_m3", "description"};
  {
    ResultStore store = ResultStore::Write(file, header);
    StoredTrial trial = Trial(1, "1e2", trial::Failure::kNone);
    trial.parameters = {{"water.milk_ml_m3", "1e2"}, {"description", "1e5"}};
    store.Add(trial);
    trial.trial = 2;
    trial.parameters = {{"water.milk_ml_m3", "nan"}, {"description", "nan"}};
    store.Add(trial);
    trial.trial = 3;
    trial.parameters = {{"water.milk_ml_m3", "7"}, {"description", "7"}};
    store.Add(trial);
  }
  SQLite::Database db(file);
  EXPECT_EQ(
      db.execAndGet("SELECT group_concat(typeof(\"water.milk_ml_m3\")) FROM trials").getString(),
      "real,text,integer");
  const std::vector<StoredTrial> trials = ResultStore::Read(file).Trials();
  EXPECT_EQ(trials[0].parameters[0].value, "100");
  EXPECT_EQ(trials[0].parameters[1].value, "1e5");
  EXPECT_EQ(trials[1].parameters[0].value, "nan");
  EXPECT_EQ(trials[1].parameters[1].value, "nan");
}

TEST_F(Store, MergesWhatBelongsTogether) {
  StoreHeader first = Header(), second = Header();
  first.shard = {1, 2};
  second.shard = {2, 2};
  ResultStore::Write(File("1.db"), first).Add(Trial(2, "8", trial::Failure::kTimeout));
  ResultStore::Write(File("2.db"), second).Add(Trial(1, "7", trial::Failure::kNone));
  ResultStore merged = ResultStore::Write(File("m.db"), Header());
  merged.Merge(File("1.db"));
  merged.Merge(File("2.db"));
  merged.Merge(File("2.db"));
  EXPECT_EQ(merged.Done(), (std::vector<int64_t>{1, 2}));

  StoredTrial changed = Trial(2, "8", trial::Failure::kTimeout);
  changed.record.digest = "other";
  ResultStore::Write(File("3.db"), first).Add(changed);
  EXPECT_THROW(merged.Merge(File("3.db")), MismatchError);
  StoreHeader other_build = Header();
  other_build.build = "1.0 f01";
  ResultStore::Write(File("4.db"), other_build).Add(Trial(3, "8", trial::Failure::kNone));
  EXPECT_THROW(merged.Merge(File("4.db")), MismatchError);
  EXPECT_EQ(merged.Done().size(), 2u);
}

// A worker's record is that of the same trial in this process, but for what differs from run to
// run.
TEST_F(Store, AWorkerReturnsTheRecord) {
  const trial::Scenario scenario = trial::LoadScenario(
      "pool_active", {"estimator.pose_source=true_pose", "trial.duration_s=2", "trial.seed=5"});
  const auto pool = MakePool({.workers = 1}, /*time_limit_s=*/60, TrialWork());
  pool->Submit(TrialJob(17, scenario, /*series_every_frames=*/30));
  std::optional<JobResult> ended;
  while (!ended) ended = pool->Next(/*timeout_s=*/10);
  EXPECT_EQ(ended->id, 17);
  const StoredTrial trial = FinishedTrialOf(*ended, {.seed = scenario.seed, .parameters = {}});
  const trial::TrialResult result = trial::RunTrial(scenario);
  EXPECT_EQ(trial.series.rows(), 2u);
  EXPECT_EQ(trial.series.Csv(), trial::Series::Of(result.log, 30).Csv());
  const std::vector<trial::Cell> there = trial::CellsOf(trial.record),
                                 here = trial::CellsOf(result);
  size_t compared = 0;
  for (size_t i = 0; i < here.size(); ++i) {
    const trial::Column& column = trial::Columns()[i];
    if (column.storage == trial::Storage::kRun) continue;
    EXPECT_TRUE(there[i] == here[i]) << column.name;
    ++compared;
  }
  EXPECT_EQ(compared, here.size() - 5);
  EXPECT_GT(trial.record.rss_bytes, 0);
}

TEST_F(Store, AsCsvItHasOneRowATrial) {
  ResultStore store = ResultStore::Write(File("a.db"), Header());
  EXPECT_EQ(store.Csv(), "");
  store.Add(Trial(2, "[0, 1]", trial::Failure::kTimeout));
  store.Add(Trial(1, "7", trial::Failure::kNone));
  const std::string csv = store.Csv();
  EXPECT_THAT(csv, ::testing::StartsWith("trial,cell,sample,water.milk_ml_m3,sea.state,outcome,"
                                         "failure,reason,docked,inserted,time_s,"));
  EXPECT_THAT(csv, HasSubstr("\n1,0,1,7,calm,success,none,\"said \"\"why\"\", and\nhow\",1,1,1.3"));
  EXPECT_THAT(csv, HasSubstr(",9223372036854775806,d1\n2,1,0,\"[0, 1]\",calm,timeout,timeout,"));
  EXPECT_THAT(csv, Not(HasSubstr("wall_time_s")));
  EXPECT_THAT(store.Csv(/*timing=*/true), HasSubstr(",wall_time_s,cpu_time_s,rss_bytes,log"));
}

TEST_F(Store, SummarisesByAnyKey) {
  std::vector<StoredTrial> trials;
  for (int64_t i = 0; i < 30; ++i) {
    trials.push_back(Trial(i, i < 10 ? "9" : "10",
                           i % 3 == 0 ? trial::Failure::kFalseLock : trial::Failure::kNone));
    trials.back().record.false_confidence_s = static_cast<double>(i);
  }
  const auto groups = Summarise(trials, {"water.milk_ml_m3"});
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(groups[0].group[0], "9");  // as numbers, not as words
  EXPECT_EQ(groups[0].trials, 10);
  EXPECT_EQ(groups[0].successes, 6);
  EXPECT_EQ(groups[1].failures.at("false_lock"), 6);
  EXPECT_NEAR(*groups[0].time_to_dock_s.median, 1.0 / 3 + 4.5, 1e-9);  // of 1, 2, 4, 5, 7, 8
  EXPECT_NEAR(groups[0].false_confidence_s.value_or(0), 4.5, 1e-9);    // of 0 to 9
  EXPECT_EQ(groups[1].wilson.low, statistics::WilsonInterval(14, 20).low);
  EXPECT_EQ(Summarise(trials, {})[0].trials, 30);
  EXPECT_EQ(Summarise(trials, {"failure", "sea.state"}).size(), 2u);
  EXPECT_THROW(Summarise(trials, {"nonsense"}), ConfigError);
  const std::vector<std::string> keys = {"water.milk_ml_m3"};
  const auto table = [&](const std::optional<double>& precision) {
    const report::Section section = GroupSection(keys, groups, precision);
    return section.note + "\n" + section.table->Text();
  };
  EXPECT_THAT(table({}), HasSubstr("6 false lock"));

  // Wilson's half widths: 0.260 of 6 in 10, 0.187 of 14 in 20.
  EXPECT_THAT(table({}), Not(HasSubstr("half width")));
  const std::string with_precision = table(0.2);
  EXPECT_THAT(with_precision, HasSubstr("26.0 not reached"));
  EXPECT_THAT(with_precision, HasSubstr("18.7  "));
  EXPECT_THAT(with_precision, HasSubstr("to be at most 20 %"));
  EXPECT_EQ(GroupsJson(keys, groups)[1]["group"]["water.milk_ml_m3"], "10");
}

}  // namespace
}  // namespace turbidock::batch
