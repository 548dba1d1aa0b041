#include "experiments/page/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>

#include "control/pid.h"
#include "experiments/batch/plan.h"
#include "experiments/batch/result_store.h"
#include "experiments/page/batch_page.h"
#include "experiments/page/report_page.h"
#include "experiments/page/trial_page.h"
#include "experiments/page/web_files.h"
#include "experiments/report/report_json.h"
#include "experiments/system/base64.h"
#include "experiments/trial/trial.h"
#include "sim/base/check.h"
#include "sim/vehicle/scene.h"
#include "tests/support/message_of.h"

namespace turbidock::page {
namespace {

namespace fs = std::filesystem;
using report::Json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MessageOf;
using ::testing::Not;

std::string Unzipped(std::string_view bytes) {
  z_stream stream{};
  EXPECT_EQ(inflateInit2(&stream, 16 + MAX_WBITS), Z_OK);
  std::string text(1 << 20, '\0'), in(bytes);
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(text.data());
  stream.avail_out = static_cast<uInt>(text.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  text.resize(stream.total_out);
  inflateEnd(&stream);
  return text;
}

int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++count;
  return count;
}

trial::Scenario WithoutCameras() {
  return trial::LoadScenario("sea_night_active",
                             {"estimator.pose_source=true_pose", "trial.duration_s=2"});
}

class PageFiles : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  void File(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  const fs::path folder_ =
      fs::temp_directory_path() / ("turbidock_page_" + std::to_string(getpid()));
};

TEST(Compress, GzipComesBackAndIsTheSameEachTime) {
  const std::string text = std::string(5000, 'a') + "\0<&\"" + std::string(3, '\0');
  EXPECT_EQ(Unzipped(Gzip(text)), text);
  EXPECT_EQ(Gzip(text), Gzip(text));
  EXPECT_LT(Gzip(text).size(), 100u);
  EXPECT_EQ(Unzipped(Gzip("")), "");
}

TEST(Page, TextInItIsNoMarkup) {
  Page page{.model = {{"kind", "study"}, {"title", "</title><script>alert(1)</script>"}}};
  page.parts["</script><b>"] = "{\"a\": \"</script>\"}";
  const std::string html = Html(page);
  EXPECT_THAT(html, Not(HasSubstr("alert(1)</script>")));
  EXPECT_THAT(html, Not(HasSubstr("<b>")));
  EXPECT_THAT(html, HasSubstr("&lt;/title&gt;&lt;script&gt;alert(1)"));
  // the model, the part and the page's own: nothing else is a script
  EXPECT_EQ(Count(html, "<script"), 3);
  EXPECT_EQ(Count(html, "</script>"), 3);
}

// Where no script may run, a page still says what it found.
TEST(Page, SaysItsAnswerWithoutAScript) {
  report::Table table({"<gain", "cost"});
  table.Row({"<i>kp</i>", "3.5"});
  const report::Report report{
      .kind = "study",
      .title = "a & b",
      .verdict = {"better", report::Tone::kGood, "By 3 of 4."},
      .facts = {{"trials", "40"}},
      .sections = {{.title = "Gains", .note = "On one scale.", .table = table}}};
  Page page = ReportPage(report::Document(report, Json::object()), "out");
  std::string html = Html(page);
  html = html.substr(html.find("<main id=\"plain\">"));
  html.resize(html.find("</main>"));
  for (const char* said :
       {"<h1>a &amp; b</h1>", "<p>better</p>", "<p>By 3 of 4.</p>", "<p>trials: 40</p>",
        "<h2>Gains</h2>", "<p>On one scale.</p>", "<tr><th>gain</th><th>cost</th></tr>",
        "<tr><td>&lt;i&gt;kp&lt;/i&gt;</td><td>3.5</td></tr>", "The plots need JavaScript"})
    EXPECT_THAT(html, HasSubstr(said));
}

TEST(Page, AsksForNothingElsewhere) {
  const std::string html = Html({.model = {{"kind", "trial"}, {"title", "t"}}, .has_3d = true});
  for (const char* address : {"http://", "https://", "src=", "@import", "url("})
    EXPECT_THAT(html, Not(HasSubstr(address)));
  // the modules, which are packed in it
  for (const WebFile& file : WebFiles())
    for (const char* address : {"http://", "https://", "@import", "url("})
      EXPECT_THAT(std::string(file.text), Not(HasSubstr(address))) << file.name;
  EXPECT_EQ(html, Html({.model = {{"kind", "trial"}, {"title", "t"}}, .has_3d = true}));
  // three.js comes along only where it is used
  EXPECT_THAT(html, HasSubstr("three.min.js"));
  EXPECT_THAT(Html({.model = {{"kind", "gate"}}}), Not(HasSubstr("data-name=\"three.min.js\"")));
}

TEST(Rounded, NumbersHaveSixDigitsAndWordsStay) {
  const Json json = {{"fitness", {0.123456789, std::nan("")}}, {"stage", {"docking"}}, {"n", 3}};
  EXPECT_EQ(Rounded(json).dump(), R"({"fitness":[0.123457,null],"stage":["docking"],"n":3})");
}

TEST(SceneModel, HasEveryGeomThatIsDrawnWhereItStands) {
  const trial::Scenario scenario = WithoutCameras();
  const vehicle::Scene scene = vehicle::LoadScene(trial::SceneFilesOf(scenario), scenario.rig);
  const Json model = SceneModel(scene);
  const Pose X_WM = scene.X_WM;
  size_t drawn = 0, balls = 0;
  for (int g = 0; g < scene.model->ngeom; ++g) drawn += scene.model->geom_group[g] != 3;
  EXPECT_EQ(model["geoms"].size(), drawn);
  for (const Json& geom : model["geoms"]) {
    const bool on_vehicle = geom["part"] == "hull" || geom["part"] == "pole";
    EXPECT_EQ(geom["fixed_to"], on_vehicle ? "vehicle" : "world");
    for (const vehicle::BallInScene& ball : scene.balls) {
      if (geom["name"] != "ball_" + ball.name) continue;
      ++balls;
      const Eigen::Vector3d p_WQ = X_WM * ball.p_MQ;
      for (int i = 0; i < 3; ++i)
        EXPECT_NEAR(geom["pose"][static_cast<size_t>(i)].get<double>(), p_WQ(i), 1e-5);
    }
    // the pole's tip, 0.5 m ahead in the vehicle, is the capsule's end
    if (geom["name"] == "pole") {
      EXPECT_NEAR(geom["pose"][0].get<double>() + geom["size_m"][1].get<double>() +
                      geom["size_m"][0].get<double>(),
                  0.5, 1e-5);
    }
  }
  EXPECT_EQ(balls, scene.balls.size());
  EXPECT_FALSE(model["meshes"].empty());
}

// What moves with a station is told in the marker's frame, which the page moves.
TEST(SceneModel, AStationOnItsMooringMovesWithTheMarker) {
  trial::Scenario scenario =
      trial::LoadScenario("sea_moored_active", {"estimator.pose_source=true_pose"});
  const vehicle::Scene scene = vehicle::LoadScene(trial::SceneFilesOf(scenario), scenario.rig);
  const Json model = SceneModel(scene);
  size_t balls = 0, plates = 0;
  for (const Json& geom : model["geoms"]) {
    if (geom["part"] == "hull" || geom["part"] == "pole") {
      EXPECT_EQ(geom["fixed_to"], "vehicle");
    }
    plates += geom["name"] == "station_plate" && geom["fixed_to"] == "moored_body";
    for (const vehicle::BallInScene& ball : scene.balls) {
      if (geom["name"] != "ball_" + ball.name) continue;
      ++balls;
      EXPECT_EQ(geom["fixed_to"], "moored_body");
      for (int i = 0; i < 3; ++i)
        EXPECT_NEAR(geom["pose"][static_cast<size_t>(i)].get<double>(), ball.p_MQ(i), 1e-5);
    }
  }
  EXPECT_EQ(balls, scene.balls.size());
  EXPECT_EQ(plates, 1u);
}

TEST_F(PageFiles, ATrialsFolderBecomesAPage) {
  const trial::Scenario scenario = WithoutCameras();
  fs::create_directories(folder_);
  const trial::TrialResult result = trial::RunTrial(scenario);
  trial::WriteRecords(folder_.string(), scenario, result);
  File("cameras/000030_left.jpg", "left");
  File("cameras/000030_right.jpg", "right");
  File("cameras/000060_left.jpg", "alone");
  File("video.mp4", "film");
  const Page page = TrialPage(folder_.string());
  EXPECT_EQ(page.model["verdict"]["word"], report::Words(NameOf(result.outcome)));
  EXPECT_THAT(page.model["series"].get<std::string>(),
              ::testing::StartsWith(system::Base64("{\"rows")));
  ASSERT_EQ(page.model["frames"].size(), 1u);
  EXPECT_EQ(page.model["frames"][0]["time_s"], 1.0);
  EXPECT_EQ(page.model["frames"][0]["right"], system::Base64("right"));
  EXPECT_EQ(page.files.at("video"), "film");
  EXPECT_TRUE(page.has_3d);
  EXPECT_THAT(Html(page), HasSubstr(result.digest)) << "also where no script may run";
  EXPECT_THAT(Html(page), HasSubstr("<pre>turbidock run "));
}

TEST_F(PageFiles, TrialsBesideAReportAreLinksByTheirFoldersNames) {
  const trial::Scenario scenario = WithoutCameras();
  const trial::TrialResult result = trial::RunTrial(scenario);
  fs::create_directories(folder_ / "failures/calm_7");
  trial::WriteRecords(Path("failures/calm_7"), scenario, result);
  File("failures/damaged_8/result.json", "{}");
  File("failures/notes.txt", "no trial");
  fs::copy(folder_ / "failures/calm_7", folder_ / "failures/of_an_earlier_run",
           fs::copy_options::recursive);
  report::Table seeds({"<seed"});
  for (const char* name : {"calm_7", "damaged_8"})
    seeds.Row({report::Cell(name, report::Tone::kBad, name)});
  const report::Report night{
      .kind = "gate", .title = "night", .sections = {{.title = "Seeds", .table = seeds}}};
  const Link again{.title = "again",
                   .trials = {{.title = "fails now", .outcome = "timeout", .reason = ""}}};
  Json document = report::Document(night, {{"verdict", "fail"}});
  document["links"] = {{"calm_7", again}, {"damaged_8", again}};
  Page page = ReportPage(document, "summary.json");
  AddTrialsIn(Path("failures"), {}, &page);
  ASSERT_EQ(page.model["links"].size(), 2u);
  EXPECT_EQ(page.model["links"]["damaged_8"]["title"], "again") << "as the document has it";
  const Json& trial = page.model["links"]["calm_7"]["trials"][0];
  EXPECT_EQ(trial["outcome"], report::Words(NameOf(result.outcome)));
  EXPECT_EQ(trial["commands"].size(), 1u);
  EXPECT_EQ(page.parts.size(), 1u) << "what no cell opens stays out";
  const Json part = report::ParseJson(page.parts.at(trial["model"]), "part");
  EXPECT_EQ(part["series"], page::TrialPage(Path("failures/calm_7")).model["series"]);
  EXPECT_TRUE(page.has_3d);
  ASSERT_EQ(page.model["missing"].size(), 1u);
  EXPECT_THAT(page.model["missing"][0].get<std::string>(), HasSubstr("damaged_8: is no trial's"));
  AddTrialsIn(Path("none"), {}, &page);
  EXPECT_EQ(page.model["links"].size(), 2u);
  document["links"] = {{"calm_7", 3}};
  EXPECT_THAT(MessageOf([&] { ReportPage(document, "summary.json"); }),
              HasSubstr("summary.json: links: "));
}

TEST_F(PageFiles, AFolderThatIsNoTrialIsNamed) {
  EXPECT_THAT(MessageOf([&] { TrialPage(Path("none")); }), HasSubstr("none: no such folder"));
  File("result.json", "{}");
  EXPECT_THAT(MessageOf([&] { TrialPage(folder_.string()); }),
              HasSubstr("is no trial's folder: it has no resolved.yaml"));
}

TEST_F(PageFiles, AModelThatIsGoneLeavesAPageWithoutReplay) {
  trial::Scenario scenario = WithoutCameras();
  scenario.model = Path("gone.xml");
  const Json model = TrialModel(scenario);
  EXPECT_TRUE(model["scene"].is_null());
  ASSERT_EQ(model["missing"].size(), 1u);
  EXPECT_THAT(model["missing"][0].get<std::string>(), HasSubstr("No 3D replay: "));
}

TEST_F(PageFiles, ABatchWithoutTrialsSaysSo) {
  const batch::Plan plan(
      "schema_version: 1\ndescription: none yet\nscenario: sea_night_active\nseeds: 2\n", "plan");
  const batch::ResultStore store =
      batch::ResultStore::Write(Path("b.db"), batch::HeaderOf(plan, batch::Shard{}));
  const Page page = BatchPage(store, Path("b.db"));
  EXPECT_EQ(page.model["rows"], 0);
  EXPECT_EQ(page.model["title"], "none yet");
  EXPECT_EQ(page.model["verdict"]["word"], "running") << "by this test";
  EXPECT_THAT(page.model["missing"].dump(), HasSubstr("No trials: none was stored yet"));
  EXPECT_FALSE(page.has_3d);
}

TEST_F(PageFiles, ABatchHasItsTrialsAndTheirSeriesFailuresFirst) {
  const batch::Plan plan(
      "schema_version: 1\ndescription: '<b>two</b>'\nscenario: sea_night_active\nseeds: 2\n"
      "series_every_frames: 1\ngrid: {control.use: [pid, lqg]}\n",
      "plan");
  batch::ResultStore store =
      batch::ResultStore::Write(Path("b.db"), batch::HeaderOf(plan, batch::Shard{}));
  const trial::TrialResult result = trial::RunTrial(WithoutCameras());
  for (int64_t i = 0; i < 4; ++i) {
    batch::StoredTrial trial;
    trial.trial = i;
    trial.cell = i / 2;
    trial.sample = i % 2;
    trial.parameters = plan.Trial(i).parameters;
    trial.record = result;
    trial.record.seed = 9223372036854775807;
    trial.record.outcome = i == 2 ? trial::Outcome::kTimeout : trial::Outcome::kSuccess;
    trial.record.failure = i == 2 ? trial::Failure::kTimeout : trial::Failure::kNone;
    if (i > 0) trial.series = trial::Series::Of(result.log);
    store.Add(trial);
  }
  EXPECT_THAT(store.TrialsWithSeries(), ElementsAre(1, 2, 3));
  EXPECT_EQ(store.SeriesOf(1).Csv(), trial::Series::Of(result.log).Csv());
  const Page page = BatchPage(store, "b.db");
  EXPECT_EQ(page.model["columns"]["seed"][0], "9223372036854775807");
  EXPECT_EQ(page.model["columns"]["failure"].dump(), "[\"none\",\"none\",\"timeout\",\"none\"]");
  EXPECT_EQ(page.model["parameters"]["control.use"].dump(), "[\"pid\",\"pid\",\"lqg\",\"lqg\"]");
  EXPECT_EQ(page.model["series_trials"].dump(), "[2,1,3]");
  EXPECT_TRUE(page.has_3d);
  // the report beside them: by the grid
  EXPECT_EQ(page.model["facts"][1]["label"], "success");
  EXPECT_EQ(page.model["sections"][0]["table"]["rows"].size(), 2u);
  // no room: the series of none
  const Page small = BatchPage(store, "b.db", {.series_bytes = 10});
  EXPECT_TRUE(small.parts.empty());
  EXPECT_EQ(small.model["series_stored"], 3);
}

// Its report is written anew while it goes on; its trials are a page of their own.
TEST_F(PageFiles, AStudysFolderIsItsReportBesideItsTrials) {
  EXPECT_EQ(TrialsOfStudy(Path("")), std::nullopt);
  const batch::ResultStore store =
      batch::ResultStore::Write(Path("evaluations.sqlite"), {.kind = "tune",
                                                             .plan = "description: sway",
                                                             .build = "none",
                                                             .shard = {},
                                                             .trials = 0,
                                                             .keys = {"phase", "lqg.a"}});
  EXPECT_EQ(TrialsOfStudy(Path("")), Path("evaluations.sqlite"));
  EXPECT_EQ(BatchPage(store, "e.sqlite").model["title"], "sway");
  File("report.json", report::JsonText(report::Document({.kind = "tuning", .title = "sway so far"},
                                                        Json::object())));
  const Json model = ResultPage(Path("")).model;
  EXPECT_EQ(model["kind"], "report");
  EXPECT_EQ(model["kind_title"], "tuning");
  EXPECT_EQ(model["title"], "sway so far");
}

TEST_F(PageFiles, ADocumentIsShownByItselfOrInItsFolder) {
  const std::string text =
      report::JsonText(report::Document({.kind = "gate", .title = "night"}, {{"verdict", "fail"}}));
  File("x.json", text);
  EXPECT_EQ(ResultPage(Path("x.json")).model["title"], "night");
  File("study/report.json", text);
  EXPECT_EQ(ResultPage(Path("study")).model["kind"], "report");
  File("trial.json", R"({"outcome": "success"})");
  EXPECT_THAT(MessageOf([&] { ResultPage(Path("trial.json")); }),
              HasSubstr("trial.json: is one trial's result; give the folder that it is in"));
  File("list.json", "[1]");
  EXPECT_THAT(MessageOf([&] { ResultPage(Path("list.json")); }), HasSubstr("is no result"));
  EXPECT_THAT(MessageOf([&] { ResultPage(Path("none")); }), HasSubstr("none"));
}

}  // namespace
}  // namespace turbidock::page
