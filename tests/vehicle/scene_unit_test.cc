// A model that breaks the contract is refused, with the file's name and what is wrong.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "sim/base/check.h"
#include "sim/vehicle/mujoco_handlers.h"
#include "sim/vehicle/scene.h"
#include "tests/support/message_of.h"
#include "tests/vehicle/smallest_scene.h"

namespace turbidock::vehicle {
namespace {

using ::testing::HasSubstr;

TEST(LoadScene, ReadsTheContract) {
  const Scene scene = LoadScene({WriteModel(kSmallest)}, RigParams{});
  EXPECT_NEAR((scene.X_BH.p - Eigen::Vector3d(0.1, 0.02, 0.03)).norm(), 0, 1e-12);
  EXPECT_NEAR((scene.p_HQ_pole_tip - Eigen::Vector3d(0.21, -0.02, -0.03)).norm(), 0, 1e-12);
  EXPECT_NEAR(YawOf(scene.X_WM.q), 0.5, 1e-12);
  EXPECT_NEAR(
      (scene.X_WM.p - Eigen::Vector3d(0.5 + 0.1 * std::cos(0.5), 0.1 * std::sin(0.5), 1)).norm(), 0,
      1e-12);
  ASSERT_EQ(scene.balls.size(), 1u);
  EXPECT_EQ(scene.balls[0].name, "pink");
  EXPECT_EQ(scene.balls[0].radius_m, 0.03);
  EXPECT_NEAR((scene.balls[0].p_MQ - Eigen::Vector3d(0, 0.2, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR(scene.dock_throat_depth_m, 0.2, 1e-12);
  EXPECT_EQ(scene.dock_throat_half_width_m, 0.05);
  EXPECT_EQ(scene.geom_part, (std::vector<Part>{Part::kEnvironment, Part::kHull, Part::kPole,
                                                Part::kMarker, Part::kDock}));
  EXPECT_EQ(scene.lamp_sites.size(), 2u);
  ASSERT_EQ(NamesOf(scene.thrusters), (std::vector<std::string>{"port", "lift"}));
  EXPECT_EQ(scene.thrusters[1].actuator, 1);
  EXPECT_EQ(scene.thrusters[0].p_BT, Eigen::Vector3d(0, 0.1, 0));
  EXPECT_NEAR((scene.thrusters[1].axis_B - Eigen::Vector3d::UnitZ()).norm(), 0, 1e-12);
}

TEST(LoadScene, TakesOtherFilesForThoseThatTheSceneIncludes) {
  const std::string text = kSmallest;
  const size_t begin = text.find("<body name=\"vehicle\""),
               end = text.find("<body name=\"marker\"");
  const std::string folder = ::testing::TempDir();
  const std::string mine = folder + "mine.xml", scene = folder + "scene.xml";
  std::ofstream(scene) << text.substr(0, begin) << "<include file=\"vehicle.xml\"/>"
                       << text.substr(end);
  std::ofstream(mine) << "<mujoco>" << text.substr(begin, end - begin) << "</mujoco>";
  EXPECT_EQ(LoadScene({scene, {{"vehicle.xml", mine}}}, {}).thrusters.size(), 2u);
  try {
    LoadScene({scene, {{"vehicle.xml", folder + "none.xml"}}}, {});
    ADD_FAILURE();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("none.xml: cannot be read"));
  }
  // what is wrong in it is said with its name
  std::ofstream(mine) << "<mujoco><body name=\"vehicle\"><geom type=\"mesh\" mesh=\"fin\"/></body>"
                         "</mujoco>";
  try {
    LoadScene({scene, {{"vehicle.xml", mine}}}, {});
    ADD_FAILURE();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr(mine));
    EXPECT_THAT(error.what(), HasSubstr("mesh 'fin' not found"));
  }
  std::filesystem::remove(scene);
  std::filesystem::remove(mine);
}

TEST(LoadScene, LooksAtItsFilesWhereItsCompilerSays) {
  const std::string folder = ::testing::TempDir() + "compiled/";
  std::filesystem::remove_all(folder);  // of a run that was ended
  std::filesystem::create_directories(folder + "shapes");
  ASSERT_EQ(mkfifo((folder + "pipe.png").c_str(), 0600), 0);
  std::ofstream(folder + "shapes/fin.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n";
  const auto said = [&](const std::string& compiler, const std::string& asset) {
    std::ofstream(folder + "scene.xml")
        << WithChange("<compiler", "<asset>" + asset + "</asset>\n<compiler " + compiler);
    return ErrorOf(folder + "scene.xml");
  };
  // nobody writes into the pipe: it would be waited for
  for (const char* file : {"file", "fileleft"})
    EXPECT_THAT(
        said("", "<texture name=\"t\" type=\"cube\" " + std::string(file) + "=\"pipe.png\"/>"),
        HasSubstr("scene.xml:2: <texture file=\"pipe.png\">: " + folder + "pipe.png is no file"));
  EXPECT_THAT(said("", "<skin file=\"pipe.png\"/>"), HasSubstr("scene.xml:2: <skin> bends"));
  const std::string mesh = "<mesh name=\"fin\" file=\"x/fin.obj\"/>";
  EXPECT_THAT(said("", mesh), Not(HasSubstr("a face")));
  EXPECT_THAT(said("meshdir=\"shapes\" strippath=\"true\"", mesh),
              HasSubstr("shapes/fin.obj:4: a face names point 9, the file has 3"));
  std::filesystem::remove_all(folder);
}

// An error of MuJoCo's own, which must not come back to it, ends the program.
TEST(MujocoHandlersDeathTest, EndTheProgramAsAFaultOfTheSimulator) {
  InstallMujocoHandlers();
  EXPECT_EXIT(mju_error("engine: nothing left"), ::testing::ExitedWithCode(4),
              "turbidock: MuJoCo: engine: nothing left");
}

TEST(LoadScene, NamesAMissingFile) {
  EXPECT_THAT(ErrorOf("no/such/model.xml"), HasSubstr("no/such/model.xml"));
}

TEST(LoadScene, ReadsNoFileLargerThanAModelCanBe) {
  const std::string huge = ::testing::TempDir() + "huge.xml";
  std::ofstream{huge};
  std::filesystem::resize_file(huge, (64 << 20) + 1);  // takes no space
  const std::string said = huge + ": is larger than 64 MiB";
  EXPECT_EQ(ErrorOf(huge), said);
  EXPECT_EQ(testing::MessageOf([&] {
              LoadScene({WriteModel(kSmallest), {{"vehicle.xml", huge}}}, {});
            }),
            said);
  std::filesystem::remove(huge);
}

TEST(LoadScene, PassesOnTheLineOfAnXmlError) {
  const std::string path = WriteModel(WithChange("<freejoint/>", "<freejoint stiff=\"1\"/>"));
  EXPECT_THAT(ErrorOf(path), HasSubstr(path));
  EXPECT_THAT(ErrorOf(path), HasSubstr("line 7"));
}

TEST(LoadScene, RefusesABadRig) {
  EXPECT_THAT(ErrorOf(WriteModel(kSmallest), RigParams{.baseline_m = -1}),
              HasSubstr("cameras.rig.baseline_m"));
}

struct Breach {
  const char *from, *to, *message;
};

class BrokenContract : public ::testing::TestWithParam<Breach> {};

TEST_P(BrokenContract, IsAnErrorThatSaysSo) {
  const std::string path = WriteModel(WithChange(GetParam().from, GetParam().to));
  const std::string error = ErrorOf(path);
  EXPECT_THAT(error, HasSubstr(path));
  EXPECT_THAT(error, HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    LoadScene, BrokenContract,
    ::testing::Values(
        Breach{"name=\"vehicle\"", "name=\"boat\"", "no body named \"vehicle\""},
        Breach{"<freejoint/>", "<joint/>", "one free joint"},
        Breach{"<freejoint/>", "", "one free joint"},
        Breach{"<freejoint/>", "<joint type='free' stiffness='5'/>", "no stiffness"},
        Breach{"name=\"hull_box\"", "name=\"box\"", "must not have a geom named \"box\""},
        Breach{"name=\"hull_box\"", "", "must not have a geom named \"\""},
        Breach{"name=\"pole\"", "name=\"hull_pole\"", "no geom \"pole\""},
        Breach{"name=\"camera_head\"", "name=\"head\"", "no site named \"camera_head\""},
        Breach{"<site name=\"lamp_left\"/>", "", "no site named \"lamp_left\""},
        Breach{"<camera name=\"left\"/>", "<camera name=\"left\" mode=\"track\"/>",
               "camera \"left\" must be fixed in body \"vehicle\""},
        Breach{"<camera name=\"right\"/>", "", "no camera named \"right\""},
        Breach{"<camera name=\"spectator\" pos=\"0 0 1\"/>", "", "no camera named \"spectator\""},
        Breach{"<site name=\"marker\" pos=\"0.1 0 0\"/>", "", "no site named \"marker\""},
        Breach{"<site name=\"marker\" pos=\"0.1 0 0\"/>",
               "<joint/><site name=\"marker\" pos=\"0.1 0 0\"/>",
               "body \"marker\" must not have joints"},
        Breach{"name=\"ball_pink\" type=\"sphere\"", "name=\"marker_box\" type=\"sphere\"",
               "no geom ball_*"},
        Breach{"type=\"sphere\" size=\"0.03\"", "type=\"box\" size=\"0.03 0.03 0.03\"",
               "must be a sphere"},
        Breach{"name=\"dock_block\"", "name=\"station_block\"", "no geom dock_*"},
        Breach{"<site name=\"camera_head\" pos=\"0.1 0.02 0.03\"/>",
               "<body><site name=\"camera_head\"/></body>", "site \"camera_head\" must belong"},
        Breach{"<site name=\"lamp_right\"/>",
               "<site name=\"lamp_right\"/><body name=\"arm\"><geom name=\"hull_arm\" "
               "size=\"1\"/></body>",
               "body \"arm\" must not have joints or geoms: the vehicle is one body"},
        Breach{"<site name=\"camera_head\" pos=\"0.1 0.02 0.03\"/>",
               "<site name=\"camera_head\" pos=\"nan 0.02 0.03\"/>",
               "site \"camera_head\": its pos is no number"},
        Breach{"<site name=\"pole_tip\" pos=\"0.31 0 0\"/>",
               "<site name=\"pole_tip\" pos=\"1e300 0 0\"/>",
               "site \"pole_tip\": its pos is beyond 10 km"},
        Breach{"<geom name=\"floor\" type=\"plane\" size=\"1 1 1\"/>",
               "<geom name=\"floor\" type=\"plane\" size=\"1 nan 1\"/>",
               "geom \"floor\": its size is no number"},
        Breach{"<geom name=\"dock_block\" type=\"box\"",
               "<geom name=\"dock_block\" quat=\"nan 0 0 0\" type=\"box\"",
               "geom \"dock_block\": its orientation is no number"},
        Breach{"name=\"dock_throat\" pos=\"0.2 0 0.5\"", "name=\"dock_throat\" pos=\"0.2 0 0.4\"",
               "straight ahead"},
        Breach{"name=\"dock_throat\" pos=\"0.2 0 0.5\"",
               "name=\"dock_throat\" pos=\"0.2 0 0.5\" euler=\"0 0 0.1\"", "with its axes"},
        Breach{"size=\"0.01 0.05 0.05\"", "size=\"0.01 0.05 0.06\"", "as wide as it is high"},
        Breach{"type=\"box\" size=\"0.01 0.05 0.05\"", "", "must be a box"},
        Breach{"<motor name=\"lift\" site=\"up\" gear=\"1 0 0 0 0 0\"/>",
               "<motor name=\"lift\" site=\"left\" gear=\"1 0 0 0 0 0\"/>",
               "motors \"port\" and \"lift\" must not share the site \"left\""},
        Breach{
            "<motor name=\"lift\" site=\"up\" gear=\"1 0 0 0 0 0\"/>",
            "<motor name=\"lift\" site=\"up\" refsite=\"left\" gear=\"1 0 0 0 0 0\"/>",
            "motor \"lift\" must push at one site, but names \"up\" and, as its refsite, \"left\""},
        Breach{"<motor name=\"lift\" site=\"up\" gear=\"1 0 0 0 0 0\"/>",
               "<motor name=\"lift\" gear=\"1 0 0 0 0 0\"/>", "actuator 'lift'"},
        Breach{"<motor name=\"lift\" site=\"up\" gear=\"1 0 0 0 0 0\"/>",
               "<motor name=\"up ahead\" site=\"up\" gear=\"1 0 0 0 0 0\"/>",
               "motor \"up ahead\" must have a name of letters, digits and underscores"},
        Breach{"<motor name=\"lift\"", "<motor", "motor 1 has no name"},
        Breach{"<motor name=\"lift\" site=\"up\" gear=\"1 0 0 0 0 0\"/>",
               "<motor name=\"lift\" site=\"up\" gear=\"0 1 0 0 0 0\"/>",
               "motor \"lift\" must push along the x axis"},
        Breach{"<motor name=\"lift\" site=\"up\" gear=\"1 0 0 0 0 0\"/>",
               "<motor name=\"lift\" site=\"dock_mouth\" gear=\"1 0 0 0 0 0\"/>",
               "of a site of the vehicle"}));

constexpr const char* kMarkerBody = "<body name=\"marker\" pos=\"0.5 0 1\" euler=\"0 0 0.5\">";
constexpr const char* kThroat = "type=\"box\" size=\"0.01 0.05 0.05\"/>\n    </body>";

// The smallest scene with marker and station in a body that has these joints.
std::string Moored(const std::string& joints, const std::string& of_body = "") {
  std::string text =
      WithChange(kMarkerBody, "<body name=\"moored_body\"" + of_body + ">" + joints + kMarkerBody);
  const size_t end = text.find(kThroat) + std::string(kThroat).size();
  return text.insert(end, "</body>");
}

TEST(LoadScene, FindsAMooredBody) {
  const Scene scene =
      LoadScene({WriteModel(Moored("<joint name=\"mooring_x\" type=\"slide\" axis=\"1 0 0\"/>"
                                   "<joint name=\"mooring_yaw\" axis=\"0 0 1\"/>"))},
                {});
  EXPECT_GT(scene.moored_body.body, 0);
  const auto [x, y, yaw] = scene.moored_body.joints;
  EXPECT_GE(x, 0);
  EXPECT_EQ(y, -1);
  EXPECT_GT(yaw, x);
  EXPECT_EQ(LoadScene({WriteModel(kSmallest)}, {}).moored_body.body, -1);
}

TEST(LoadScene, RefusesAMooredBodyOtherwise) {
  const std::string x = "<joint name=\"mooring_x\" type=\"slide\" axis=\"1 0 0\"/>";
  const std::string yaw = "<joint name=\"mooring_yaw\" axis=\"0 0 1\"/>";
  const auto error = [](const std::string& joints, const std::string& of_body = "") {
    return ErrorOf(WriteModel(Moored(joints, of_body)));
  };
  EXPECT_EQ(error(x + yaw), "no error");
  EXPECT_THAT(error("<joint name=\"mooring_x\" type=\"slide\" axis=\"0 1 0\"/>"),
              HasSubstr("joint \"mooring_x\" must slide along 1 0 0"));
  EXPECT_THAT(error("<joint name=\"mooring_yaw\" type=\"slide\" axis=\"0 0 1\"/>"),
              HasSubstr("joint \"mooring_yaw\" must be a hinge about 0 0 1"));
  EXPECT_THAT(error(yaw + x), HasSubstr("must come after the others"));
  EXPECT_THAT(error(x + "<joint/>"), HasSubstr("must have no others"));
  EXPECT_THAT(error(x, " euler=\"0 0 1\""), HasSubstr("unturned"));
  EXPECT_THAT(error("<joint name=\"mooring_yaw\" axis=\"0 0 1\" damping=\"1\"/>"),
              HasSubstr("must be free"));
  EXPECT_THAT(error("<joint/>"), HasSubstr("must not have joints"));
  std::string apart = kSmallest;
  const std::string in_marker = std::string(kMarkerBody) + yaw;
  apart.replace(apart.find(kMarkerBody), std::string(kMarkerBody).size(), in_marker);
  EXPECT_THAT(ErrorOf(WriteModel(apart)), HasSubstr("unturned"));
  std::string two = Moored(x);
  two.insert(two.find("<body name=\"moored_body\""),
             "<body><geom name=\"buoy\" size=\"0.1\" pos=\"3 0 0\"/>" + yaw + "</body>");
  EXPECT_THAT(ErrorOf(WriteModel(two)),
              HasSubstr("\"mooring_yaw\" must belong to the body of the mooring's other joints"));
}

}  // namespace
}  // namespace turbidock::vehicle
