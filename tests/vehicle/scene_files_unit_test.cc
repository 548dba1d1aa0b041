// A scene whose vehicle is a file of its own: which files, angles and settings it has.

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

}  // namespace
}  // namespace turbidock::vehicle
