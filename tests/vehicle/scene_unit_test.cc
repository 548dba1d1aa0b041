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

namespace turbidock::vehicle {
namespace {

using ::testing::HasSubstr;

// The least that satisfies the contract.
constexpr const char* kSmallest = R"(<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <camera name="spectator" pos="0 0 1"/>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="vehicle" pos="-2 0 1">
      <freejoint/>
      <geom name="hull_box" type="box" size="0.1 0.1 0.1"/>
      <geom name="pole" type="capsule" size="0.01" fromto="0 0 0 0.3 0 0"/>
      <site name="camera_head" pos="0.1 0.02 0.03"/>
      <site name="lamp_left"/>
      <site name="lamp_right"/>
      <site name="pole_tip" pos="0.31 0 0"/>
      <site name="left" pos="0 0.1 0"/>
      <site name="up" euler="0 -1.5707963267948966 0"/>
      <camera name="left"/>
      <camera name="right"/>
    </body>
    <body name="marker" pos="0.5 0 1" euler="0 0 0.5">
      <site name="marker" pos="0.1 0 0"/>
      <geom name="ball_pink" type="sphere" size="0.03" pos="0.1 0.2 0"/>
    </body>
    <body name="station" pos="0.5 0 1">
      <geom name="dock_block" type="box" size="0.1 0.1 0.1"/>
      <site name="dock_mouth" pos="0 0 0.5"/>
      <site name="dock_throat" pos="0.2 0 0.5" type="box" size="0.01 0.05 0.05"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="port" site="left" gear="1 0 0 0 0 0"/>
    <motor name="lift" site="up" gear="1 0 0 0 0 0"/>
  </actuator>
</mujoco>
)";

std::string WriteModel(const std::string& text) {
  const std::string path = ::testing::TempDir() + "scene_unit_test.xml";
  std::ofstream(path) << text;
  return path;
}

std::string WithChange(const std::string& from, const std::string& to) {
  std::string text = kSmallest;
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string ErrorOf(const std::string& path, const RigParams& rig = {}) {
  try {
    LoadScene({path}, rig);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

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

// A scene whose vehicle is a file of its own in a folder of its own.
class APart : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_);
    const std::string text = kSmallest;
    begin_ = text.find("<body name=\"vehicle\"");
    end_ = text.find("<body name=\"marker\"");
    std::ofstream(folder_ + "scene.xml")
        << text.substr(0, begin_) << "</worldbody><include file=\"vehicle.xml\"/><worldbody>"
        << text.substr(end_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // What is said of the vehicle with this before its body, and in it.
  std::string With(const std::string& before, const std::string& inside = "") {
    std::string body = std::string(kSmallest).substr(begin_, end_ - begin_);
    body.insert(body.find("<freejoint/>"), inside);
    Write(vehicle_, "<mujoco>\n" + before + "<worldbody>" + body + "</worldbody></mujoco>");
    return testing::MessageOf([&] {
      LoadScene({folder_ + "scene.xml", {{"vehicle.xml", folder_ + vehicle_}}}, {});
    });
  }
  // What is said of the vehicle with this mesh.
  std::string Mesh(const std::string& file) {
    return With("<asset><mesh name=\"fin\" file=\"" + file + "\"/></asset>",
                "<geom name=\"hull_fin\" type=\"mesh\" mesh=\"fin\"/>");
  }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ + name) << text;
  }

  const std::string folder_ = ::testing::TempDir() + "a part/";
  std::string vehicle_ = "mine.xml";
  size_t begin_ = 0, end_ = 0;
};

TEST_F(APart, SaysNothingForTheWholeScene) {
  const auto said = [&](const std::string& before) { return With(before); };
  for (const char* tag : {"option", "statistic", "visual", "equality", "contact"})
    EXPECT_THAT(said("<!-- <a> -->\n<" + std::string(tag) + " a='>'\n b=\"1\"/>"),
                HasSubstr("mine.xml:3: <" + std::string(tag) + "> is the scene's"));
  EXPECT_THAT(said("<compiler boundmass=\"1\"/>"),
              HasSubstr("mine.xml:2: <compiler boundmass=\"1\"> is the scene's: leave it out"));
  EXPECT_THAT(said("<compiler meshdir=\"m\"/>"), HasSubstr("write the folder into each file="));
  EXPECT_THAT(said("<worldbody><composite type=\"box\"/></worldbody>"),
              HasSubstr("<composite> is many bodies"));
  EXPECT_THAT(said("<asset><skin file=\"s.skn\"/></asset>"), HasSubstr("mine.xml:2: <skin> bends"));
  EXPECT_THAT(said("<!-- <option gravity=\"0 0 0\"/> -->"), Not(HasSubstr("option")));
}

// Each turns x to where the first one does.
TEST_F(APart, HasAnglesOfItsOwn) {
  const auto axis = [&](const std::string& compiler, const std::string& angles) {
    const std::string said =
        With(compiler, "<site name=\"turned\" " + angles + "/>\n<!-- euler=\"0 0 9\" -->");
    EXPECT_EQ(said, "no error") << compiler << angles;
    const Scene scene =
        LoadScene({folder_ + "scene.xml", {{"vehicle.xml", folder_ + vehicle_}}}, {});
    const int site = mj_name2id(scene.model.get(), mjOBJ_SITE, "turned");
    const mjtNum* q = scene.model->site_quat + 4 * site;
    return Eigen::Vector3d(Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * Eigen::Vector3d(1, 2, 3));
  };
  const std::string degree = "<compiler angle=\"degree\"/>";
  const Eigen::Vector3d wanted = axis("", "euler=\"0.1 0.2 0.3\"");
  for (const auto& [compiler, angles] : std::initializer_list<std::pair<std::string, std::string>>{
           {degree, "euler=\"5.729577951308232 11.459155902616464 17.188733853924695\""},
           {degree, "euler = '5.729577951308232 11.459155902616464\n17.188733853924695'"},
           {"<compiler eulerseq=\"ZYX\"/>", "euler=\"0.3 0.2 0.1\""},
           {"<compiler angle=\"degree\" eulerseq=\"ZYX\"/>",
            "euler=\"17.188733853924695 11.459155902616464 5.729577951308232\""},
           {"<compiler angle=\"radian\" autolimits=\"true\"/>", "euler=\"0.1 0.2 0.3\""}})
    EXPECT_TRUE(axis(compiler, angles).isApprox(wanted, 1e-9)) << compiler << angles;
  EXPECT_TRUE(axis(degree, "axisangle=\"0 0 2 90\"").isApprox(Eigen::Vector3d(-2, 1, 3), 1e-9));
  // of a file that it includes
  Write("angles.xml", "<mujoco>" + degree + "</mujoco>");
  EXPECT_TRUE(axis("<include file=\"angles.xml\"/>", "euler=\"0 0 90\"")
                  .isApprox(Eigen::Vector3d(-2, 1, 3), 1e-9));
  EXPECT_THAT(With("", "<site\neuler=\"0 0 45\"/>"),
              HasSubstr("mine.xml:3: <site euler=\"0 0 45\">: is more than a turn"));
  EXPECT_THAT(With("<compiler angle=\"deg\"/>"), HasSubstr("must be degree or radian"));
  EXPECT_THAT(With("<compiler eulerseq=\"abc\"/>"), HasSubstr("must be three of x, y, z"));
}

// Its parts would be read as the scene's compiler says.
TEST_F(APart, HasASceneInRadians) {
  std::ifstream file(folder_ + "scene.xml");
  const std::string scene(std::istreambuf_iterator<char>(file), {});
  for (const char* compiler : {"<compiler/>", "<compiler angle=\"degree\"/>",
                               "<compiler angle=\"radian\" eulerseq=\"zyx\"/>"}) {
    std::string changed = scene;
    const std::string radian = "<compiler angle=\"radian\"/>";
    Write("scene.xml", changed.replace(changed.find(radian), radian.size(), compiler));
    EXPECT_THAT(With(""), HasSubstr("say <compiler angle=\"radian\"/>, without eulerseq"));
  }
}

TEST_F(APart, NamesFilesThatStandBesideIt) {
  EXPECT_THAT(Mesh("fin.obj"),
              HasSubstr("mine.xml:2: <mesh file=\"fin.obj\">: " + folder_ + "fin.obj is no file"));
  Write("unnamed.stl", "");  // not this program's to read
  Write("fin.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n");
  EXPECT_EQ(Mesh("fin.obj"), "no error");
  std::filesystem::create_directories(folder_ + "meshes");
  std::filesystem::rename(folder_ + "fin.obj", folder_ + "meshes/fin.obj");
  EXPECT_EQ(Mesh("meshes/fin.obj"), "no error");
}

// MuJoCo follows a face wherever it points.
TEST_F(APart, HasFacesWhosePointsAreThere) {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
  const auto faces = [](const std::string& of) {  // with the rest of each corner
    return "f 1" + of + " 3" + of + " 2" + of + "\nf 1" + of + " 2" + of + " -1" + of + "\nf 1" +
           of + " 4" + of + " 3" + of + "\nf 2" + of + " 3" + of + " 4" + of + "\n";
  };
  const std::string texture = "vt 0 0\n", normal = "vn 0 0 1\n";
  Write("fin.obj", points + faces(""));
  EXPECT_EQ(Mesh("fin.obj"), "no error");
  Write("fin.obj", points + texture + faces("/1"));
  EXPECT_EQ(Mesh("fin.obj"), "no error");
  Write("fin.obj", points + texture + normal + faces("/-1/1"));
  EXPECT_EQ(Mesh("fin.obj"), "no error");
  Write("fin.obj", points + normal + faces("//-1"));
  EXPECT_EQ(Mesh("fin.obj"), "no error");
  Write("fin.obj", points + faces("/1"));
  EXPECT_THAT(Mesh("fin.obj"),
              HasSubstr("fin.obj:5: a face names texture point 1, the file has 0"));
  Write("fin.obj", points + texture + "f 1/1 2/1 3\n");
  EXPECT_THAT(Mesh("fin.obj"), HasSubstr("fin.obj:6: a face names no texture point, the file has "
                                         "1: each corner must name one, or the file have none"));
  Write("fin.obj", points + texture + normal + faces("/1"));
  EXPECT_THAT(Mesh("fin.obj"), HasSubstr("fin.obj:7: a face names no normal"));
  Write("fin.obj", points);  // their hull
  EXPECT_EQ(Mesh("fin.obj"), "no error");
  Write("fin.obj", points + normal);
  EXPECT_THAT(Mesh("fin.obj"), HasSubstr("fin.obj: has no faces"));
  Write("fin.OBJ", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  EXPECT_THAT(Mesh("fin.OBJ"), HasSubstr("fin.OBJ: has no faces; points alone are at least four"));
  const auto written = [&](const std::string& face) {
    return With("<asset><mesh name=\"fin\" vertex=\"0 0 0 1 0 0 0 1 0 0 0 1\" face=\"" + face +
                "\"/></asset>");
  };
  EXPECT_THAT(written("0 1 &#57;"), HasSubstr("must be numbers"));
  EXPECT_EQ(written("0 2 1 0 1 3 0 3 2 1 2 3"), "no error");
  EXPECT_THAT(written("0 1 4"), HasSubstr("<mesh face>: names point 4, the mesh has 4"));
  EXPECT_THAT(written("0 -1 2"), HasSubstr("names point -1"));
  Write("fin.obj", points + "l 1 2\n" + faces(""));
  EXPECT_THAT(Mesh("fin.obj"), HasSubstr("fin.obj:5: lines and points are no surface"));
  Write("fin.obj", points + "f 1 2 999999999\n");
  EXPECT_THAT(Mesh("fin.obj"),
              HasSubstr("fin.obj:5: a face names point 999999999, the file has 4"));
  Write("fin.obj", points + "v 1 0x 1\n" + faces(""));
  EXPECT_THAT(Mesh("fin.obj"), HasSubstr("fin.obj:5: a point must have 3 numbers"));
  Write("fin.obj", "vn 1 0\n" + points + faces(""));
  EXPECT_THAT(Mesh("fin.obj"), HasSubstr("fin.obj:1: a normal must have 3 numbers"));
  Write("fin.obj", points + "f 1 2 -5\n");
  EXPECT_THAT(Mesh("fin.obj"), HasSubstr("point -5"));
  Write("fin.obj", "f -1 -2 -3\n" + points);
  EXPECT_THAT(Mesh("fin.obj"), HasSubstr("fin.obj:1: a face names point -1, the file has 0"));
  for (const char* bad : {"3x", "3/1/1/1", "3/", "-", "+3", "3/1/x", "3/-/1"}) {
    Write("fin.obj", points + "f 1 2 " + bad + "\n");
    EXPECT_THAT(Mesh("fin.obj"), HasSubstr(std::string("'") + bad + "' is no point of a face"));
  }
  Write("fin.obj", points + "v\v0 0 0\n" + faces(""));
  EXPECT_THAT(Mesh("fin.obj"), HasSubstr("fin.obj: holds control characters"));
  Write("fin.obj", points + "v 0 0 1\rf 1 2 9\r\n" + faces(""));
  EXPECT_THAT(Mesh("fin.obj"), HasSubstr("fin.obj:6: a face names point 9"));
  Write("fin.obj", points + "f 1 2 x\n");
  EXPECT_THAT(Mesh("fin.obj"), HasSubstr("fin.obj:5: 'x' is no point of a face"));
}

// Numbers that would take gigabytes or minutes, names that end the program.
TEST_F(APart, AsksForNoMoreThanASceneNeeds) {
  const auto said = [&](const std::string& before) { return With(before); };
  EXPECT_THAT(said("<size nkey=\"1000000\"/>"),
              HasSubstr("mine.xml:2: <size nkey=\"1000000\">: must be at most 5000"));
  for (const char* tag :
       {"size nstack=\"1000000000\"", "size nuser_geom=\"5001\"", "hfield nrow=\"1e5\"",
        "hfield ncol=\"2049\"", "texture width=\"0xFFFF\"", "texture height=\"&#57;999\"",
        "composite count=\"1 51 1\"", "numeric size=\"1000000000\"", "user dim=\"nan\""})
    EXPECT_THAT(said("<" + std::string(tag) + "/>"), HasSubstr("must be at most")) << tag;
  EXPECT_EQ(said("<size njmax=\"5000\" nstack=\"10000000\"/>"), "no error");
  for (const char* tag : {"include", "include file=\"\"", "include file=\"fins/\"",
                          "mesh file=\"/\"", "texture file=\"fins/\""})
    EXPECT_THAT(said("<" + std::string(tag) + "/>"), HasSubstr("names no file")) << tag;
  EXPECT_THAT(said(std::string("<include file=\"a\0/\0\"/>", 22)), HasSubstr("null character"));
  EXPECT_THAT(said("<allocate/>"), HasSubstr("allocate"));  // not the machine's memory
  // what only MuJoCo decodes ends its loading, not the program
  EXPECT_THAT(said("<include file=\"&#47;\"/>"), HasSubstr("Empty filename"));
  EXPECT_THAT(With("<asset><mesh file=\"/proc/self/mem\"/></asset>"),
              HasSubstr("/proc/self/mem: cannot be read"));
  std::string png = "\x89PNG\r\n\x1a\n1234IHDR";
  Write("sand.png", png + std::string("\0\1\0\0\0\0\4\1", 8));
  EXPECT_THAT(said("<asset><texture type=\"2d\" file=\"sand.png\"/></asset>"),
              HasSubstr("sand.png: is of more than 64 million pixels"));
  Write("sand.png", png + std::string("\0\1\0\0\0\0\4\0", 8));
  EXPECT_THAT(said("<asset><texture type=\"2d\" file=\"sand.png\"/></asset>"),
              Not(HasSubstr("million pixels")));
}

TEST_F(APart, IncludesFilesThatStandBesideIt) {
  std::filesystem::create_directories(folder_ + "own/meshes");
  vehicle_ = "own/mine.xml";
  const auto including = [&](const std::string& file) {
    return With("", "<include file=\"" + file + "\"/>");
  };
  EXPECT_THAT(including("fins.xml"), HasSubstr("fins.xml"));  // nowhere yet
  Write("own/fins.xml", "<mujoco><geom name=\"hull_fin\" type=\"sphere\" size=\"0.05\"/></mujoco>");
  EXPECT_EQ(including("fins.xml"), "no error");
  std::filesystem::rename(folder_ + "own/fins.xml", folder_ + "own/meshes/fins.xml");
  EXPECT_EQ(including("meshes/fins.xml"), "no error");
  Write("own/fins.xml", "<mujoco><mesh file=\"meshes/fin.obj\"/></mujoco>");
  EXPECT_THAT(including("fins.xml"), HasSubstr("own/meshes/fin.obj is no file"));
  Write("own/fins.xml", "<mujoco>\n<option gravity=\"0 0 0\"/></mujoco>");
  EXPECT_THAT(including("fins.xml"), HasSubstr("own/fins.xml:2: <option> is the scene's"));
  Write("own/fins.xml", "<mujoco><include file=\"fins.xml\"/></mujoco>");
  EXPECT_THAT(including("fins.xml"), HasSubstr("fins.xml"));
  Write("own/vehicle.xml", "<mujoco/>");  // the scene's name for the vehicle itself
  EXPECT_THAT(including("vehicle.xml"), HasSubstr("already included"));
  Write("own/scene.xml", "<mujoco/>");
  EXPECT_THAT(including("scene.xml"),
              HasSubstr("has the name of a file that the scene includes: rename it"));
}

// What the scene lacks comes from elsewhere, what that includes from the scene where it has it.
TEST_F(APart, OfTheSceneIncludesTheScenesFiles) {
  std::filesystem::create_directories(folder_ + "ours");
  With("");
  Write("ours/vehicle.xml", "<mujoco><include file=\"inner.xml\"/></mujoco>");
  Write("ours/inner.xml", "<mujoco><theirs/></mujoco>");
  std::filesystem::rename(folder_ + vehicle_, folder_ + "inner.xml");
  EXPECT_EQ(
      testing::MessageOf([&] {
        LoadScene({folder_ + "scene.xml", {}, {{"vehicle.xml", folder_ + "ours/vehicle.xml"}}}, {});
      }),
      "no error");
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
              HasSubstr("rig.baseline_m"));
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
