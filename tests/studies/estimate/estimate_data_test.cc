// `turbidock estimate` as a user runs it: path-traced pairs with known poses, recorded sequences,
// calibrations of OpenCV's, markers of one's own, and what is said of bad input.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "experiments/config/rig_file.h"
#include "experiments/media/canvas.h"
#include "experiments/media/image_source.h"
#include "experiments/media/mp4_writer.h"
#include "experiments/media/png.h"
#include "experiments/studies/estimate/estimate.h"
#include "sim/base/units.h"
#include "tests/support/own_folder.h"
#include "tests/support/paint_marker.h"
#include "tests/support/program.h"

namespace turbidock::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

Pose PoseOf(const Json& json) {
  const std::vector<double> p = json.at("position_m"), q = json.at("quaternion_wxyz");
  return {Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized(), {p[0], p[1], p[2]}};
}

class Estimate : public OwnFolder {
 public:
  // A painted pair as left.png and right.png.
  void WritePair(const vision::MarkerParams& marker, const StereoRig& rig, const Pose& X_HM,
                 const std::string& suffix = "") const {
    const StereoImage seen = PaintMarker(marker, rig, X_HM, {}, nullptr);
    media::WritePng(File("left" + suffix + ".png"), seen.left);
    media::WritePng(File("right" + suffix + ".png"), seen.right);
  }
  Json Run(const std::vector<std::string>& more) const {
    std::vector<std::string> arguments = {"estimate", "--json", "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramEnd end = RunProgram(arguments);
    EXPECT_EQ(end.exit_code, 0) << end.err;
    return Json::parse(end.out, nullptr, /*allow_exceptions=*/false);
  }
  void ExpectBadInput(const std::vector<std::string>& more,
                      const std::vector<std::string>& said) const {
    std::vector<std::string> arguments = {"estimate", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramEnd end = RunProgram(arguments);
    EXPECT_EQ(end.exit_code, 2) << end.err;
    EXPECT_EQ(end.out, "");
    for (const std::string& words : said) EXPECT_THAT(end.err, HasSubstr(words));
  }
};

const Pose kPose = Pose::FromVectorPart({0.6, 0.02, -0.03}, {0.01, -0.02, 0.05});

TEST_F(Estimate, PathTracedPairs) {
  const std::string data = std::string(TURBIDOCK_TEST_DATA) + "/pathtraced/";
  int pairs = 0;
  for (const char* list : {"active_21.json", "passive_22.json"}) {
    std::ifstream stream(data + list);
    for (const Json& entry : Json::parse(stream)) {
      const Json result = Run({"--left", data + entry.at("left").get<std::string>(), "--right",
                               data + entry.at("right").get<std::string>(), "--seed", "5"});
      const Pose truth = PoseOf(entry), found = PoseOf(result);
      EXPECT_LT((found.p - truth.p).norm(), 0.0025) << entry.at("name");
      EXPECT_LT(units::DegFromRad(AngleBetween(found.q, truth.q)), 0.5) << entry.at("name");
      EXPECT_EQ(result.at("frames"), 30);
      EXPECT_LE(result.at("evaluations"), 30 * 540);
      EXPECT_EQ(result.at("detected"), true);
      EXPECT_GT(result.at("fitness"), 0.7);
      EXPECT_EQ(result.at("ball_fitness").size(), 3u);
      ASSERT_EQ(result.at("ball_support").size(), 3u);
      for (const Json& support : result.at("ball_support")) EXPECT_GT(support, 0.7);
      EXPECT_EQ(result.at("records").size(), 30u);
      EXPECT_TRUE(result.at("second").is_null());
      ++pairs;
    }
  }
  EXPECT_EQ(pairs, 8);
}

TEST(EstimateAnswer, OfEqualImagesIsRefined) {
  PoseEstimate refined, bare, lost;
  refined.detected = bare.detected = true;
  refined.covariance = PoseCovariance::Identity();
  EXPECT_TRUE(estimate::TellsLess(bare, refined));
  EXPECT_FALSE(estimate::TellsLess(refined, refined));
  EXPECT_FALSE(estimate::TellsLess(refined, bare));
  EXPECT_FALSE(estimate::TellsLess(bare, bare));
  EXPECT_FALSE(estimate::TellsLess(lost, refined)) << "a marker that is lost again was none";
  EXPECT_FALSE(estimate::TellsLess(bare, lost));
}

TEST(EstimateReport, StatesNoDeviationsOfAGuess) {
  estimate::EstimateSummary summary;
  summary.last.covariance = PoseCovariance::Identity();
  const auto text = [&](bool detected) {
    summary.last.detected = detected;
    return report::Text(estimate::ReportOf(summary, {}));
  };
  EXPECT_THAT(text(true), HasSubstr("standard deviations"));
  EXPECT_THAT(text(false), AllOf(HasSubstr("a guess"), Not(HasSubstr("standard deviations"))));
}

TEST_F(Estimate, ADarkBallLeavesTwoAnswers) {
  vision::MarkerParams lit;
  lit.balls.erase(lit.balls.begin());
  WritePair(lit, RigParams{}.MakeRig(), kPose);
  const Json result = Run({"--left", File("left.png"), "--right", File("right.png")});
  EXPECT_EQ(result.at("detected"), false);
  const Json& second = result.at("second");
  ASSERT_TRUE(second.is_object());
  EXPECT_GT(second.at("weight"), 0.05);
  EXPECT_LE(second.at("weight"), 0.5);
  const Pose first = PoseOf(result), other = PoseOf(second);
  EXPECT_GT(AngleBetween(first.q, other.q), units::RadFromDeg(3));
  EXPECT_THAT(result["report"]["missing"].dump(), HasSubstr("Another pose fits the images"));
}

TEST_F(Estimate, ASequenceGivesARecordAFrameAndAnOverlay) {
  const StereoRig rig = RigParams{}.MakeRig();
  for (int frame = 1; frame <= 12; ++frame) {
    Pose X_HM = kPose;
    X_HM.p.y() += 0.004 * frame;
    WritePair({}, rig, X_HM, "_" + std::to_string(100 + frame));
  }
  const Json result = Run({"--left", File("left_*.png"), "--right", File("right_*.png"), "--set",
                           "marker.box_m=[0,0,0]", "--overlay", File("overlay.mp4")});
  ASSERT_EQ(result.at("records").size(), 12u);
  EXPECT_EQ(result.at("complete"), true);
  for (int frame = 8; frame < 12; ++frame)
    EXPECT_NEAR(PoseOf(result["records"][frame]).p.y(), 0.02 + 0.004 * (frame + 1), 0.002);
  EXPECT_EQ(result.at("kind"), "estimate");
  EXPECT_EQ(result["report"]["sections"][0]["panels"].size(), 4u);  // x, y, z, F
  // The overlay is a video of as many frames, and can be read as one.
  const auto video = media::OpenImages(File("overlay.mp4"));
  Image3u8 image;
  int frames = 0;
  while (video->Next(&image)) ++frames;
  EXPECT_EQ(frames, 12);
  EXPECT_EQ(image.width(), 1280);
  // Numbered files, not more of them than asked for.
  for (int frame = 0; frame < 5; ++frame) WritePair({}, rig, kPose, "-0" + std::to_string(frame));
  EXPECT_EQ(Run({"--left", File("left-*.png"), "--right", File("right-*.png")})["frames"], 5);
  EXPECT_EQ(Run({"--left", File("left-*.png"), "--right", File("right-*.png"), "--frames",
                 "3"})["frames"],
            3);
}

// Files of two moments are no pair, however many there are.
TEST_F(Estimate, AMissingFileIsNoticed) {
  const StereoRig rig = RigParams{}.MakeRig();
  for (const char* moment : {"_0001", "_0002", "_0003"}) WritePair({}, rig, kPose, moment);
  for (const char* side : {"left", "right"}) {
    std::filesystem::create_directories(folder_ / side);
    for (const char* moment : {"_0001", "_0002", "_0003"})
      std::filesystem::copy_file(File(std::string(side) + moment + ".png"),
                                 folder_ / side / (moment + std::string(".png")));
  }
  const auto refused = [&](const std::string& left, const std::string& right,
                           const std::vector<std::string>& said) {
    ExpectBadInput({"--left", File(left), "--right", File(right)}, said);
  };
  EXPECT_EQ(Run({"--left", File("left_*.png"), "--right", File("right_*.png")})["frames"], 3);
  EXPECT_EQ(Run({"--left", File("left"), "--right", File("right")})["frames"], 3);
  refused("left_*.png", "left_*.png", {"left_0001.png: is given for both sides"});
  std::filesystem::create_symlink(File("left_0002.png"), File("same.png"));
  refused("left_0002.png", "same.png", {"left_0002.png: is given for both sides"});

  std::filesystem::remove(File("right_0001.png"));
  const std::vector<std::string> first = {"left_0001.png and ", "right_0002.png are no pair"};
  refused("left_*.png", "right_*.png", first);
  std::filesystem::remove(folder_ / "left/_0002.png");
  refused("left", "right", {"left/_0003.png and ", "right/_0002.png are no pair"});
  // names that have nothing to do with each other are pairs in their order
  EXPECT_EQ(Run({"--left", File("left_*.png"), "--right", File("right")})["frames"], 3);
}

TEST_F(Estimate, AVideoThatEndsEarlyGivesWhatThereIsAndSaysSo) {
  const StereoImage seen = PaintMarker({}, RigParams{}.MakeRig(), kPose, {}, nullptr);
  for (const auto& [name, frames] : {std::pair{"left.mp4", 9}, {"right.mp4", 6}}) {
    media::Mp4Writer video(File(name), 640, 480, 30);
    media::Canvas canvas(640, 480);
    canvas.DrawImage(name[0] == 'l' ? seen.left : seen.right, canvas.area());
    for (int frame = 0; frame < frames; ++frame) video.Add(canvas);
    video.Finish();
  }
  const Json result = Run(
      {"--left", File("left.mp4"), "--right", File("right.mp4"), "--set", "marker.box_m=[0,0,0]"});
  EXPECT_EQ(result.at("frames"), 6);
  EXPECT_EQ(result.at("complete"), false);
  EXPECT_THAT(result.at("incomplete_reason").get<std::string>(),
              HasSubstr("right.mp4 ends after 6 frames"));
  // Compression halves the resolution of colour.
  EXPECT_LT((PoseOf(result).p - kPose.p).norm(), 0.02);
}

// A rig whose cameras differ, are turned against each other and have lenses.
std::string CalibrationText(const std::string& T) {
  const double a = 0.06;
  const auto matrix = [](int rows, int cols, const std::string& values) {
    return " !!opencv-matrix\n   rows: " + std::to_string(rows) +
           "\n   cols: " + std::to_string(cols) + "\n   dt: d\n   data: [ " + values + " ]\n";
  };
  return "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\nM1:" +
         matrix(3, 3, "560., 0., 322., 0., 558., 236., 0., 0., 1.") +
         "D1:" + matrix(1, 5, "-0.1, 0.02, 0.001, -0.001, 0.") +
         "M2:" + matrix(3, 3, "550., 0., 318., 0., 552., 242., 0., 0., 1.") +
         "D2:" + matrix(1, 5, "-0.08, 0.01, 0., 0.002, 0.") + "R:" +
         matrix(3, 3,
                std::to_string(std::cos(a)) + ", 0., " + std::to_string(std::sin(a)) +
                    ", 0., 1., 0., " + std::to_string(-std::sin(a)) + ", 0., " +
                    std::to_string(std::cos(a))) +
         "T:" + matrix(3, 1, T);
}

// What a camera with that lens sees of an undistorted image.
Image3u8 ThroughLens(const Image3u8& plain, const CameraIntrinsics& camera,
                     const vision::LensDistortion& lens) {
  Image3u8 seen(plain.width(), plain.height());
  for (int v = 0; v < plain.height(); ++v)
    for (int u = 0; u < plain.width(); ++u) {
      const Eigen::Vector2d through = camera.RayAt(u, v).head<2>();
      Eigen::Vector2d ray = through;
      for (int i = 0; i < 15; ++i) ray += through - lens.Apply(ray);
      const Eigen::Vector2d at = camera.Project({ray.x(), ray.y(), 1});
      const int column = static_cast<int>(at.x()), row = static_cast<int>(at.y());
      if (at.x() < 0 || at.y() < 0 || column + 1 >= plain.width() || row + 1 >= plain.height())
        continue;
      const double fu = at.x() - column, fv = at.y() - row;
      for (int k = 0; k < 3; ++k)
        seen.at(u, v)[k] = static_cast<uint8_t>(std::lround(
            (1 - fv) * ((1 - fu) * plain.at(column, row)[k] + fu * plain.at(column + 1, row)[k]) +
            fv *
                ((1 - fu) * plain.at(column, row + 1)[k] + fu * plain.at(column + 1, row + 1)[k])));
    }
  return seen;
}

TEST_F(Estimate, HonoursAnOpenCvCalibration) {
  const std::string file = File("stereo.yml", CalibrationText("-0.15, 0.002, 0.004"));
  const config::RigFromFile rig = config::LoadRig({file}, 640, 480);
  // The head is midway, y points to the left camera, x ahead.
  EXPECT_NEAR((rig.rig.left.X_HC.p + rig.rig.right.X_HC.p).norm(), 0, 1e-12);
  EXPECT_NEAR(rig.rig.left.X_HC.p.y(), 0.5 * std::hypot(0.15, 0.002, 0.004),
              1e-6);  // R has six digits
  EXPECT_NEAR(rig.rig.left.X_HC.p.x(), 0, 1e-12);
  // A point seen from both cameras is related by R and T.
  const Eigen::Vector3d p_L(0.1, -0.2, 0.9),
      p_R = rig.rig.right.X_HC.Inverse() * (rig.rig.left.X_HC * p_L);
  Eigen::Matrix3d R;
  R << std::cos(0.06), 0, std::sin(0.06), 0, 1, 0, -std::sin(0.06), 0, std::cos(0.06);
  EXPECT_LT((R * p_L + Eigen::Vector3d(-0.15, 0.002, 0.004) - p_R).norm(), 1e-5);

  vision::MarkerParams marker;
  const StereoImage plain = PaintMarker(marker, rig.rig, kPose, {}, nullptr);
  media::WritePng(File("left.png"), ThroughLens(plain.left, rig.rig.left, rig.distortion.left));
  media::WritePng(File("right.png"), ThroughLens(plain.right, rig.rig.right, rig.distortion.right));
  const Json result = Run({"--left", File("left.png"), "--right", File("right.png"), "--rig", file,
                           "--set", "marker.box_m=[0,0,0]"});
  EXPECT_LT((PoseOf(result).p - kPose.p).norm(), 0.003);
  EXPECT_LT(units::DegFromRad(AngleBetween(PoseOf(result).q, kPose.q)), 1);
}

// Whatever the form of images and calibration: the pose is the same, to three of its own standard
// deviations.
void ExpectAsSure(const Json& found, const Pose& truth) {
  ASSERT_EQ(found.at("detected"), true);
  const std::vector<double> deviation_m = found.at("position_deviation_m");
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(PoseOf(found).p(i), truth.p(i), 3 * deviation_m[static_cast<size_t>(i)]);
}

TEST_F(Estimate, AFisheyeIsUndistorted) {
  const std::string data = std::string(TURBIDOCK_TEST_DATA) + "/pathtraced/active_015ml_0500mm_";
  const Pose truth = PoseOf(Run({"--left", data + "left.png", "--right", data + "right.png"}));
  const std::string matrix =
                        "[554.25625842204074, 0, 319.5, 0, 554.25625842204074, 239.5, 0, 0, 1]",
                    lens = "[-0.002178, 0.0378, -0.0358, 0.005763]";
  const std::string file =
      File("fisheye.yml", "imageSize: [640, 480]\ndistortion_model: equidistant\nK1: " + matrix +
                              "\nD1: " + lens + "\nK2: " + matrix + "\nD2: " + lens +
                              "\nR: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nT: [-0.12, 0, 0]\n");
  const config::RigFromFile rig = config::LoadRig({file}, 640, 480);
  for (const Side side : kSides) {
    const std::string name = side == Side::kLeft ? "left.png" : "right.png";
    media::WritePng(File(name),
                    ThroughLens(media::ReadPng(data + name), rig.rig[side], rig.distortion[side]));
  }
  ExpectAsSure(Run({"--left", File("left.png"), "--right", File("right.png"), "--rig", file}),
               truth);
}

// Right cameras below, above, askew and upside down: H is level with the left image, or along the
// baseline.
TEST_F(Estimate, AnyBaselineHasItsTrueGeometry) {
  const std::string matrix = "[554.25, 0, 319.5, 0, 554.25, 239.5, 0, 0, 1]\n";
  for (const auto& [R, T] : {std::pair{"1, 0, 0, 0, 1, 0, 0, 0, 1", "-0.0006, -0.12, 0"},
                             {"1, 0, 0, 0, 1, 0, 0, 0, 1", "0.0006, -0.12, 0"},
                             {"1, 0, 0, 0, 1, 0, 0, 0, 1", "0, 0.12, 0"},
                             {"1, 0, 0, 0, 1, 0, 0, 0, 1", "-0.08, -0.09, 0"},
                             {"-1, 0, 0, 0, -1, 0, 0, 0, 1", "0.12, 0, 0"}}) {
    SCOPED_TRACE(std::string(R) + "; " + T);
    const std::string file =
        File("askew.yml", "imageSize: [640, 480]\nK1: " + matrix + "K2: " + matrix +
                              "D1: [0, 0, 0, 0, 0]\nD2: [0, 0, 0, 0, 0]\nR: [" + R + "]\nT: [" + T +
                              "]\n");
    WritePair({}, config::LoadRig({file}, 640, 480).rig, kPose);
    const Json found = Run({"--left", File("left.png"), "--right", File("right.png"), "--rig", file,
                            "--set", "marker.box_m=[0,0,0]"});
    EXPECT_EQ(found.at("detected"), true);
    EXPECT_LT((PoseOf(found).p - kPose.p).norm(), 0.003);
    EXPECT_NEAR(found.at("baseline_m").get<double>(), 0.12, 0.001);
  }
}

TEST_F(Estimate, SaysWhatIsWrongWithTheImages) {
  Image3u8 grey(640, 480, 100), dark(640, 480, 3), white(640, 480, 255);
  *dark.data() = 30;
  const auto notes_of = [&](const Image3u8& image) {
    media::WritePng(File("left.png"), image);
    media::WritePng(File("right.png"), image);
    return Run({"--left", File("left.png"), "--right", File("right.png"), "--frames", "1"})["notes"]
        .dump();
  };
  EXPECT_THAT(notes_of(grey), HasSubstr("right.png: is grey"));
  EXPECT_THAT(notes_of(dark), HasSubstr("left.png: the brightest value is 30 of 255"));
  EXPECT_THAT(notes_of(white), HasSubstr("left.png: 100 % of it is white"));
  WritePair({}, RigParams{}.MakeRig(), kPose);
  EXPECT_EQ(
      Run({"--left", File("left.png"), "--right", File("right.png"), "--frames", "1"})["notes"]
          .dump(),
      "[]");
}

// Finds a marker of those balls, painted in plain colours, by its file alone.
struct OwnBall {
  Eigen::Vector3d p_MQ_m;
  double radius_m = 0.02, hue_deg = 0;
};

void ExpectFoundByFileAlone(const Estimate& test, const std::vector<OwnBall>& balls,
                            const Pose& X_HM) {
  SCOPED_TRACE(balls.size());
  std::string text = "balls:\n";
  vision::MarkerParams marker;
  marker.balls.clear();
  for (const OwnBall& ball : balls) {
    const std::string name = "ball" + std::to_string(marker.balls.size());
    const double hue_rad = units::RadFromDeg(ball.hue_deg);
    marker.balls.push_back({name, ball.p_MQ_m, ball.radius_m, hue_rad, {1, 1, 1}});
    text += "  - {name: " + name + ", p_MQ_m: [" + std::to_string(ball.p_MQ_m.x()) + ", " +
            std::to_string(ball.p_MQ_m.y()) + ", " + std::to_string(ball.p_MQ_m.z()) +
            "], radius_m: " + std::to_string(ball.radius_m) +
            ", hue_rad: " + std::to_string(hue_rad) + "}\n";
  }
  test.WritePair(marker, RigParams{}.MakeRig(), X_HM);
  const Json result = test.Run({"--left", test.File("left.png"), "--right", test.File("right.png"),
                                "--marker", test.File("marker.yaml", text)});
  EXPECT_EQ(result.at("detected"), true);
  EXPECT_LT((PoseOf(result).p - X_HM.p).norm(), 0.003);
  EXPECT_LT(units::DegFromRad(AngleBetween(PoseOf(result).q, X_HM.q)), 0.5);
  ASSERT_EQ(result.at("ball_fitness").size(), balls.size());
  for (const Json& fitness : result.at("ball_fitness")) EXPECT_GT(fitness, 0.7);
}

TEST_F(Estimate, AMarkerOfOnesOwnByFileAlone) {
  // Yellow, cyan and magenta on a T, of different sizes.
  ExpectFoundByFileAlone(
      *this,
      {{{0, 0.1, 0}, 0.03, 60}, {{0, -0.1, 0.02}, 0.025, 180}, {{-0.05, 0, -0.12}, 0.02, 300}},
      Pose::FromVectorPart({0.8, -0.05, 0.04}, {0.03, 0.02, -0.06}));
  // Five colours.
  ExpectFoundByFileAlone(*this,
                         {{{-0.06, 0, 0}, 0.022, 60},
                          {{0, 0.08, 0.05}, 0.022, 180},
                          {{0, -0.08, 0.05}, 0.022, 300},
                          {{0, 0.08, -0.07}, 0.022, 0},
                          {{0, -0.07, -0.06}, 0.022, 120}},
                         kPose);
  // Eight balls about a ring's rim, two of them orange, two of them violet.
  ExpectFoundByFileAlone(*this,
                         {{{0, 0.13, 0.01}, 0.018, 30},
                          {{-0.02, 0.09, 0.09}, 0.018, 90},
                          {{0, 0, 0.12}, 0.018, 150},
                          {{-0.03, -0.09, 0.08}, 0.018, 210},
                          {{0, -0.13, 0}, 0.018, 270},
                          {{-0.01, -0.08, -0.09}, 0.018, 330},
                          {{-0.06, 0.01, -0.13}, 0.018, 30},
                          {{0, 0.09, -0.09}, 0.018, 270}},
                         kPose);
}

TEST_F(Estimate, SaysWhatIsMissing) {
  media::WritePng(File("left.png"), Image3u8(640, 480));
  media::WritePng(File("right.png"), Image3u8(640, 480));
  const Json black = Run({"--left", File("left.png"), "--right", File("right.png")});
  EXPECT_EQ(black.at("detected"), false);
  EXPECT_THAT(black["report"]["missing"].dump(), HasSubstr("The marker was not found"));
  for (const Json& x : black["report"]["sections"][0]["panels"][0]["series"][0]["y"])
    EXPECT_TRUE(x.is_null()) << "a guess is drawn as a position";
}

TEST_F(Estimate, ThePublishedPresetIsUnrefinedAndRepeats) {
  WritePair({}, RigParams{}.MakeRig(), kPose);
  const std::vector<std::string> arguments = {"--left",  File("left.png"),
                                              "--right", File("right.png"),
                                              "--seed",  "3",
                                              "--set",   "estimator.rm_ga.preset=published"};
  const Json result = Run(arguments);
  EXPECT_EQ(result.at("evaluations"), 30 * 276);
  EXPECT_TRUE(result.at("covariance").is_null());
  EXPECT_EQ(Run(arguments), result);
}

// Films of a trial, compressed as a camera's are, and the truth at each image (make_footage.py).
TEST_F(Estimate, ShippedFilmsAreFollowed) {
  const std::string folder = std::string(TURBIDOCK_TEST_DATA) + "/../../assets/footage/";
  const Json result = Run({"--left", folder + "left.mp4", "--right", folder + "right.mp4"});
  EXPECT_EQ(result["notes"].size(), 0) << result["notes"];
  std::ifstream truth(folder + "truth.csv");
  std::string line;
  std::getline(truth, line);
  int followed = 0, images = 0;
  for (const Json& record : result["records"]) {
    ASSERT_TRUE(std::getline(truth, line)) << ++images;
    std::replace(line.begin(), line.end(), ',', ' ');
    double time_s;
    Eigen::Vector3d p_HM;
    std::istringstream(line) >> time_s >> p_HM.x() >> p_HM.y() >> p_HM.z();
    followed += record["detected"] && (PoseOf(record).p - p_HM).norm() < 0.015;
    ++images;
  }
  EXPECT_FALSE(std::getline(truth, line)) << line;
  EXPECT_EQ(images, 60);
  EXPECT_GE(followed, 55);
}

TEST_F(Estimate, BadInputIsNamed) {
  const StereoRig rig = RigParams{}.MakeRig();
  WritePair({}, rig, kPose);
  const std::string left = File("left.png"), right = File("right.png");
  ExpectBadInput({"--left", File("nothing.png"), "--right", right},
                 {"nothing.png", "no such file"});
  ExpectBadInput({"--left", File("text.png", "no picture"), "--right", right}, {"text.png"});
  ExpectBadInput({"--left", File("text.mp4", "no video"), "--right", File("none.mp4", "none")},
                 {"text.mp4", "cannot be read"});
  ExpectBadInput({"--left", File("left_%03d.png"), "--right", right},
                 {"no such images; write * for the numbers"});
  media::WritePng(File("small.png"), Image3u8(320, 240));
  ExpectBadInput({"--left", left, "--right", File("small.png")},
                 {"small.png: 320 x 240 pixels, must be the rig's 640 x 480", "make_footage.py"});
  media::WritePng(File("other.png"), Image3u8(320, 240));
  ExpectBadInput({"--left", File("small.png"), "--right", File("other.png")},
                 {"320 x 240 pixels, must be the rig's 640 x 480"});
  ExpectBadInput(
      {"--left", left, "--right", right, "--rig", File("zero.yml", CalibrationText("0., 0., 0."))},
      {"zero.yml", "T: the baseline is 0 m"});
  ExpectBadInput(
      {"--left", left, "--right", right, "--rig", File("mm.yml", CalibrationText("-150., 0., 0."))},
      {"mm.yml", "T must be in metres"});
  ExpectBadInput({"--left", left, "--right", right, "--rig",
                  File("rig.yaml", "width_px: 640\nbaseline_m: 0\n")},
                 {"rig.yaml:2: baseline_m"});
  ExpectBadInput({"--left", left, "--right", right, "--rig",
                  File("half.yml", "%YAML:1.0\n---\nimage_width: 640\n")},
                 {"half.yml: has no camera matrices of two cameras"});
  ExpectBadInput({"--left", left, "--right", right, "--marker", File("marker.yaml", "bals: []\n")},
                 {"marker.yaml:1: bals", "balls"});
  ExpectBadInput({"--left", left, "--right", right, "--set", "estimator.rm_ga.preset=best"},
                 {"estimator.rm_ga.preset", "must be one of default, published"});
  ExpectBadInput({"--left", left, "--right", right, "--overlay", File("film.avi")}, {"film.avi"});
}

}  // namespace
}  // namespace turbidock::testing
