// Which GL context a trial draws in: the one asked for, else the other, and that it says so.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/program.h"

namespace turbidock::trial {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::ProgramEnd;
using testing::RunProgram;
using ::testing::StartsWith;

ProgramEnd RunAFrame(const std::string& renderer, const std::string& environment) {
  return RunProgram({"run", "pool_active", "--json", "--set", "trial.duration_s=0.01", "--set",
                     "cameras.rig.width_px=64", "--set", "cameras.rig.height_px=48", "--set",
                     "trial.renderer=" + renderer},
                    {environment});
}

// Where these libraries cannot be opened.
ProgramEnd RunWithout(const std::vector<std::string>& libraries, const std::string& renderer) {
  const std::filesystem::path folder = ::testing::TempDir() + "without_gl";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  for (const std::string& name : libraries) std::ofstream(folder / name) << "not a library";
  return RunAFrame(renderer, "LD_LIBRARY_PATH=" + folder.string());
}

std::string RendererOf(const ProgramEnd& end) {
  return nlohmann::json::parse(end.out).at("renderer");
}

const std::vector<std::string> kOsmesa = {"libOSMesa.so.8", "libOSMesa.so"};
const std::vector<std::string> kEgl = {"libEGL.so.1", "libEGL.so"};

TEST(RendererChoice, TheOneAskedFor) {
  for (const auto& [name, title] : {std::pair("osmesa", "OSMesa, "), std::pair("egl", "EGL, ")}) {
    const ProgramEnd end = RunWithout({}, name);
    ASSERT_EQ(end.exit_code, 0) << end.err;
    EXPECT_THAT(RendererOf(end), StartsWith(title));
    EXPECT_THAT(end.err, Not(HasSubstr("instead")));
  }
}

TEST(RendererChoice, TheOtherOneWithAClearLine) {
  const ProgramEnd no_egl = RunWithout(kEgl, "egl");
  ASSERT_EQ(no_egl.exit_code, 0) << no_egl.err;
  EXPECT_THAT(RendererOf(no_egl), StartsWith("OSMesa, "));
  EXPECT_THAT(no_egl.err, HasSubstr("install the package libegl1; drawing with OSMesa, "));

  const ProgramEnd no_osmesa = RunWithout(kOsmesa, "osmesa");
  ASSERT_EQ(no_osmesa.exit_code, 0) << no_osmesa.err;
  EXPECT_THAT(RendererOf(no_osmesa), StartsWith("EGL, "));
  EXPECT_THAT(no_osmesa.err, HasSubstr("install the package libosmesa6; drawing with EGL, "));
}

// The library is there, but no driver: MuJoCo must not take its functions.
TEST(RendererChoice, AnEglWithoutDevicesIsNoEgl) {
  const ProgramEnd end = RunAFrame("egl", "__EGL_VENDOR_LIBRARY_FILENAMES=/dev/null");
  ASSERT_EQ(end.exit_code, 0) << end.err;
  EXPECT_THAT(RendererOf(end), StartsWith("OSMesa, "));
  EXPECT_THAT(end.err, HasSubstr("drawing with OSMesa, "));
}

TEST(RendererChoice, NeitherIsAFaultThatNamesBoth) {
  std::vector<std::string> both = kOsmesa;
  both.insert(both.end(), kEgl.begin(), kEgl.end());
  const ProgramEnd end = RunWithout(both, "osmesa");
  EXPECT_EQ(end.exit_code, 4);
  EXPECT_THAT(end.err, HasSubstr("libosmesa6"));
  EXPECT_THAT(end.err, HasSubstr("libegl1"));
  EXPECT_EQ(end.out, "");
}

TEST(RendererChoice, BadValue) {
  const ProgramEnd end = RunWithout({}, "vulkan");
  EXPECT_EQ(end.exit_code, 2);
  EXPECT_THAT(end.err, HasSubstr("renderer"));
  EXPECT_THAT(end.err, HasSubstr("egl"));
}

}  // namespace
}  // namespace turbidock::trial
