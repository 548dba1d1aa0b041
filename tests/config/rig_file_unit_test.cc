// What a calibration that OpenCV wrote says of the images and what no lens can be; how it is used
// is tested where it is (tests/studies/estimate).

#include "experiments/config/rig_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "sim/base/check.h"

namespace turbidock::config {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string Matrix(int rows, int cols, const std::string& values) {
  return " !!opencv-matrix\n   rows: " + std::to_string(rows) +
         "\n   cols: " + std::to_string(cols) + "\n   dt: d\n   data: [ " + values + " ]\n";
}

// "W x H" of a calibration that begins with `size`, of images of 320 x 240; or what is wrong.
std::string SizeOf(const std::string& size,
                   const std::string& matrix = "560., 0., 160., 0., 560., 120., 0., 0., 1.",
                   const std::string& distortion = "0., 0., 0., 0., 0.") {
  const std::string lens = Matrix(1, 5, distortion);
  const std::string camera = Matrix(3, 3, matrix);
  const std::string file = ::testing::TempDir() + "size.yml";
  std::ofstream(file) << "%YAML:1.0\n---\n"
                      << size << "M1:" << camera << "D1:" << lens << "M2:" << camera
                      << "D2:" << lens << "R:" << Matrix(3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.")
                      << "T:" << Matrix(3, 1, "-0.12, 0., 0.");
  try {
    const StereoRig rig = LoadRig({file}, 320, 240).rig;
    EXPECT_EQ(rig.left.width_px, rig.right.width_px);
    return std::to_string(rig.left.width_px) + " x " + std::to_string(rig.left.height_px);
  } catch (const ConfigError& error) {
    const std::string message = error.what();
    return message.substr(message.find("size.yml"));
  }
}

TEST(RigFile, SizeIsThatOfTheCalibrationElseOfTheImages) {
  EXPECT_EQ(SizeOf("image_width: 640\nimage_height: 480\n"), "640 x 480");
  EXPECT_EQ(SizeOf("imageSize: [ 640, 480 ]\n"), "640 x 480");
  EXPECT_EQ(SizeOf("size: [ 640., 480. ]\n"), "640 x 480");
  EXPECT_EQ(SizeOf(""), "320 x 240");
}

TEST(RigFile, ACameraThatCannotBeIsRefused) {
  const auto camera = [](const char* fx, const char* fy, const char* center) {
    return SizeOf("", std::string(fx) + ", 0., " + center + ", 0., " + fy + ", 120., 0., 0., 1.");
  };
  EXPECT_THAT(camera("1e-9", "560.", "160."),
              AllOf(HasSubstr("M1: a focal length of 1e-09 pixels: horizontal_fov_rad: 3.14"),
                    HasSubstr("must be in [0.1, 2.6]")));
  EXPECT_THAT(camera("560.", "1e9", "160."), HasSubstr("M1: a focal length of 1e+09 pixels: "));
  // one of images of 1280 x 960
  EXPECT_EQ(
      camera("1100.", "1100.", "640."),
      "size.yml:3: M1: the principal point (640, 120) is not near the middle of the images, 320 "
      "x 240, as if of images 2.5 times as large; give such images, or say in the file which "
      "image_width and image_height were calibrated");
  EXPECT_EQ(SizeOf("size: [ 320, 240 ]\n", "560., 0., -1., 0., 560., 120., 0., 0., 1."),
            "size.yml:4: M1: the principal point (-1, 120) is not in an image of 320 x 240");
  const std::string matrix = "560., 0., 160., 0., 560., 120., 0., 0., 1.";
  EXPECT_EQ(SizeOf("", matrix, "0.1, 1e9, 0., 0., 0."),
            "size.yml:8: D1: a distortion of 1e+09 must be in [-1000, 1000]");
  EXPECT_EQ(SizeOf("", matrix, "-0.3, 40., 0.001, 0., -900."), "320 x 240");
}

TEST(RigFile, ASizeThatIsNoneIsRefused) {
  const std::string allowed = ", must be a whole number in [1, 8192]";
  EXPECT_EQ(SizeOf("imageSize: [ 640.5, 480 ]\n"), "size.yml:3: imageSize[0]: is 640.5" + allowed);
  EXPECT_EQ(SizeOf("imageSize: [ 640, 1e9 ]\n"), "size.yml:3: imageSize[1]: is 1e+09" + allowed);
  EXPECT_EQ(SizeOf("image_width: 640\nimage_height: 0\n"),
            "size.yml:4: image_height: is 0" + allowed);
  EXPECT_EQ(SizeOf("imageSize: [ 640 ]\n"),
            "size.yml:3: imageSize: must be a list of width and height");
  EXPECT_EQ(SizeOf("image_width: 640\n"),
            "size.yml:3: image_width: stands alone: image_height is required");
}

}  // namespace
}  // namespace turbidock::config
