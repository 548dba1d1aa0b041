// Which calibrations of other programs are read, and what is said of the others: the table
// tests/data/variants/calibrations.txt is drawn from the variants below and compared with the
// committed one.

#include "experiments/config/calibration_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "experiments/config/rig_file.h"
#include "sim/base/check.h"
#include "tests/support/drawn_table.h"

namespace turbidock::config {
namespace {

using testing::Swaps;
using testing::With;

struct Variant {
  std::string format, name;
  std::vector<std::string> files;
};

std::string Matrix(const std::string& name, int rows, int cols, const std::string& numbers) {
  return name + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
         "\n   cols: " + std::to_string(cols) + "\n   dt: d\n   data: [ " + numbers + " ]\n";
}

const std::string kK = "554.25, 0., 319.5, 0., 554.25, 239.5, 0., 0., 1.";
const std::string kOne = "1., 0., 0., 0., 1., 0., 0., 0., 1.";
const std::string kD = "-0.1, 0.02, 0.001, -0.002, 0.";
const std::string kSize = "image_width: 640\nimage_height: 480\n";

std::string Yaml(int lens_numbers = 5, const std::string& lens = kD) {
  return "%YAML:1.0\n---\n" + kSize + Matrix("K1", 3, 3, kK) + Matrix("D1", 1, lens_numbers, lens) +
         Matrix("K2", 3, 3, kK) + Matrix("D2", 1, lens_numbers, lens) + Matrix("R", 3, 3, kOne) +
         Matrix("T", 3, 1, "-0.12, 0., 0.");
}

std::string YamlWith(const Swaps& swaps) { return With(Yaml(), swaps); }

// Of the numbers of lists alone, as people write them by hand.
std::string Lists() {
  const std::string k = "[[554.25, 0, 319.5], [0, 554.25, 239.5], [0, 0, 1]]\n";
  return "imageSize: [640, 480]\nK1: " + k + "D1: [" + kD + "]\nK2: " + k + "D2: [[" + kD +
         "]]\nR: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nT: [[-0.12], [0], [0]]\n";
}

std::string Xml() {
  const auto matrix = [](const std::string& name, int rows, int cols, const std::string& numbers) {
    return "<" + name + " type_id=\"opencv-matrix\">\n  <rows>" + std::to_string(rows) +
           "</rows>\n  <cols>" + std::to_string(cols) + "</cols>\n  <dt>d</dt>\n  <data>\n    " +
           With(numbers, {{",", ""}}) + "</data></" + name + ">\n";
  };
  return "<?xml version=\"1.0\"?>\n<opencv_storage>\n<!-- by hand -->\n" + matrix("K1", 3, 3, kK) +
         matrix("D1", 1, 5, kD) + matrix("K2", 3, 3, kK) + matrix("D2", 1, 5, kD) +
         matrix("R", 3, 3, kOne) + matrix("T", 3, 1, "-0.12, 0., 0.") +
         "<imageSize>\n  640 480</imageSize>\n</opencv_storage>\n";
}

std::string Json() {
  const auto matrix = [](const std::string& name, int rows, int cols, const std::string& numbers) {
    return "    \"" + name + "\": {\n        \"type_id\": \"opencv-matrix\",\n        \"rows\": " +
           std::to_string(rows) + ",\n        \"cols\": " + std::to_string(cols) +
           ",\n        \"dt\": \"d\",\n        \"data\": [ " + numbers + "0 ]\n    },\n";
  };
  return "{\n" + matrix("K1", 3, 3, kK) + matrix("D1", 1, 5, kD) + matrix("K2", 3, 3, kK) +
         matrix("D2", 1, 5, kD) + matrix("R", 3, 3, kOne) + matrix("T", 3, 1, "-0.12, 0.0, 0.") +
         "    \"image_width\": 640,\n    \"image_height\": 480\n}\n";
}

std::string Kalibr(const Swaps& swaps = {}) {
  const std::string camera =
      "  camera_model: pinhole\n  distortion_coeffs: [-0.1, 0.02, 0.001, -0.002]\n"
      "  distortion_model: radtan\n  intrinsics: [554.25, 554.25, 319.5, 239.5]\n"
      "  resolution: [640, 480]\n";
  return With("cam0:\n  cam_overlaps: [1]\n" + camera + "  rostopic: /left/image_raw\ncam1:\n" +
                  "  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, -0.12]\n  - [0.0, 1.0, 0.0, 0.0]\n" +
                  "  - [0.0, 0.0, 1.0, 0.0]\n  - [0.0, 0.0, 0.0, 1.0]\n" + camera,
              swaps);
}

std::string Ros(const std::string& side, const std::string& shift, const Swaps& swaps = {}) {
  return With(kSize + "camera_name: " + side + "\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [" +
                  kK + "]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n" +
                  "  cols: 5\n  data: [" + kD + "]\nrectification_matrix:\n  rows: 3\n  cols: 3\n" +
                  "  data: [" + kOne + "]\nprojection_matrix:\n  rows: 3\n  cols: 4\n" +
                  "  data: [554.25, 0, 319.5, " + shift + ", 0, 554.25, 239.5, 0, 0, 0, 1, 0]\n",
              swaps);
}

std::vector<Variant> OfOpenCv() {
  const std::string yaml = "OpenCV YAML",
                    p = Matrix("P1", 3, 4,
                               "500., 0., 320., 0., 0., 500., 240., 0., 0., 0., 1., 0.");
  const auto swapped = [&](const std::string& name, const Swaps& swaps) {
    return Variant{yaml, name, {YamlWith(swaps)}};
  };
  const std::string size = kSize, eight = "0.1, 0.2, 0., 0., 0.3, 0.4, 0.5, 0.6";
  const auto lens = [&](const std::string& name, int count, const std::string& numbers,
                        const std::string& model = "") {
    return Variant{yaml, name, {With(Yaml(count, numbers), {{kSize, kSize + model}})}};
  };
  const size_t half = Yaml().find("K2");
  return {
      {yaml, "as OpenCV 4 writes it", {Yaml()}},
      swapped("OpenCV 5: `%YAML 1.2`", {{"%YAML:1.0", "%YAML 1.2"}}),
      {yaml, "byte-order mark", {"\xEF\xBB\xBF" + Yaml()}},
      {yaml, "blank first line", {"\n" + Yaml()}},
      swapped("no first line", {{"%YAML:1.0\n---\n", ""}}),
      swapped("lines end as on Windows", {{"\n", "\r\n"}}),
      {yaml, "in two files", {Yaml().substr(0, half), "%YAML:1.0\n---\n" + Yaml().substr(half)}},
      {yaml, "lists of numbers", {Lists()}},
      {yaml, "cut off", {Yaml().substr(0, half)}},
      {yaml, "cut off in a matrix", {Yaml().substr(0, half - 30)}},
      {yaml, "no second distortion", {With(Yaml(), {{"D2", "E2"}})}},
      swapped("data in base64", {{"data: [ -0.12, 0., 0. ]", "data: !!binary |\n     ZAAA"}}),
      swapped("names M1, D1", {{"K1", "M1"}, {"K2", "M2"}}),
      swapped("names cameraMatrix1, distCoeffs1", {{"K1", "cameraMatrix1"},
                                                   {"K2", "cameraMatrix2"},
                                                   {"D1", "distCoeffs1"},
                                                   {"D2", "distCoeffs2"}}),
      swapped("names cameraMatrixL, distCoeffsL", {{"K1", "cameraMatrixL"},
                                                   {"K2", "cameraMatrixR"},
                                                   {"D1", "distCoeffsL"},
                                                   {"D2", "distCoeffsR"}}),
      swapped("names K_left, D_left",
              {{"K1", "K_left"}, {"K2", "K_right"}, {"D1", "D_left"}, {"D2", "D_right"}}),
      swapped("names left_camera_matrix", {{"K1", "left_camera_matrix"},
                                           {"K2", "right_camera_matrix"},
                                           {"D1", "left_distortion_coefficients"},
                                           {"D2", "right_distortion_coefficients"}}),
      swapped("names K0, K1", {{"K1", "K0"}, {"D1", "D0"}, {"K2", "K1"}, {"D2", "D1"}}),
      swapped("names A, B", {{"K1", "A"}, {"K2", "B"}}),
      swapped("R and T missing", {{"R:", "S:"}, {"T:", "U:"}}),
      swapped("R1, P1, R2, P2 instead of R and T",
              {{"R:", "R1:"},
               {"T:", "U:"},
               {"U:", Matrix("R2", 3, 3, kOne) + p +
                          With(p, {{"P1", "P2"}, {"320., 0.,", "320., -60.,"}}) + "U:"}}),
      swapped("no image size", {{size, ""}}),
      swapped("no image size, of twice as large images",
              {{size, ""}, {kK, "1108.5, 0., 632.1, 0., 1108.5, 471.3, 0., 0., 1."}}),
      swapped("no image size, of half as large images",
              {{size, ""}, {kK, "277.1, 0., 159.5, 0., 277.1, 119.5, 0., 0., 1."}}),
      swapped("MATLAB's order of a camera matrix",
              {{kK, "554.25, 0., 0., 0., 554.25, 0., 319.5, 239.5, 1."}}),
      lens("4 numbers of a lens", 4, "0.1, 0.2, 0.3, 0.4"),
      lens("4 numbers, plumb_bob", 4, "0.1, 0.2, 0.3, 0.4", "distortion_model: plumb_bob\n"),
      lens("4 numbers, equidistant", 4, "0.1, 0.2, 0.3, 0.4", "distortion_model: equidistant\n"),
      lens("4 numbers, fisheye_model: 1", 4, "0.1, 0.2, 0.3, 0.4", "fisheye_model: 1\n"),
      lens("5 numbers, equidistant", 5, kD, "distortion_model: equidistant\n"),
      lens("another model", 5, kD, "distortion_model: fov\n"),
      lens("7 numbers", 7, "0.1, 0.2, 0.3, 0.4, 0., 0., 0."),
      lens("8 numbers, rational", 8, eight),
      lens("12 numbers, thin prism", 12, eight + ", 0.01, 0.02, 0.03, 0.04"),
      lens("14 numbers, the last 0", 14, eight + ", 0.01, 0.02, 0.03, 0.04, 0., 0."),
      lens("14 numbers, tilted", 14, eight + ", 0., 0., 0., 0., 0.1, 0."),
      swapped("T in millimetres", {{"-0.12, 0., 0.", "-120., 0., 0."}}),
      swapped("T of the other direction", {{"-0.12, 0., 0.", "0.12, 0., 0."}}),
      swapped("right camera below", {{"-0.12, 0., 0.", "-0.0006, -0.12, 0."}}),
      swapped("right camera below, to the left by noise", {{"-0.12, 0., 0.", "0.0006, -0.12, 0."}}),
      swapped("right camera above", {{"-0.12, 0., 0.", "0., 0.12, 0."}}),
      swapped("right camera on its side", {{kOne, "0., -1., 0., 1., 0., 0., 0., 0., 1."}}),
      swapped("right camera upside down", {{kOne, "-1., 0., 0., 0., -1., 0., 0., 0., 1."}}),
      {"OpenCV XML", "as OpenCV 4 writes it", {Xml()}},
      {"OpenCV XML", "cut off", {Xml().substr(0, Xml().find("K2"))}},
      {"OpenCV XML", "3 numbers of a lens", {With(Xml(), {{"0.001 -0.002 0.", ""}})}},
      {"OpenCV XML", "of another program", {With(Xml(), {{"opencv_storage", "calibration"}})}},
      {"OpenCV JSON", "as OpenCV 4 writes it", {Json()}},
      {"OpenCV JSON", "indented by tabs", {With(Json(), {{"    ", "\t"}})}},
      {"OpenCV JSON", "cut off", {Json().substr(0, Json().find("K2"))}},
  };
}

std::vector<Variant> OfOthers() {
  const std::string radtan = "radtan", below = "  - [1.0, 0.0, 0.0, -0.12]";
  return {
      {"Kalibr", "camchain, radtan", {Kalibr()}},
      {"Kalibr", "camchain, equidistant", {Kalibr({{radtan, "equidistant"}})}},
      {"Kalibr", "camchain, fov", {Kalibr({{radtan, "fov"}})}},
      {"Kalibr", "camchain, omni", {Kalibr({{"pinhole", "omni"}})}},
      {"Kalibr", "one camera", {Kalibr().substr(0, Kalibr().find("cam1"))}},
      {"Kalibr", "cam1 on the left", {Kalibr({{below, "  - [1.0, 0.0, 0.0, 0.12]"}})}},
      {"ROS camera_info", "left, right", {Ros("left", "0"), Ros("right", "-66.51")}},
      {"ROS camera_info", "right, left", {Ros("right", "-66.51"), Ros("left", "0")}},
      {"ROS camera_info", "left alone", {Ros("left", "0")}},
      {"ROS camera_info", "calibrated one by one", {Ros("left", "0"), Ros("right", "0")}},
      {"ROS camera_info",
       "rational_polynomial",
       {Ros("left", "0", {{"plumb_bob", "rational_polynomial"}}),
        Ros("right", "-66.51", {{"plumb_bob", "rational_polynomial"}})}},
      {"ROS camera_info",
       "equidistant, 5 numbers",
       {Ros("left", "0", {{"plumb_bob", "equidistant"}}), Ros("right", "-66.51")}},
      {"ROS camera_info", ".ini", {"# oST version 5.0 parameters\n\n[image]\n\nwidth\n640\n"}},
      {"ROS CameraInfo",
       "messages, left, right",
       {"height: 480\nwidth: 640\ndistortion_model: plumb_bob\nd: [" + kD + "]\nk: [" + kK +
            "]\nr: [" + kOne + "]\np: [554.25, 0, 319.5, 0, 0, 554.25, 239.5, 0, 0, 0, 1, 0]\n",
        "height: 480\nwidth: 640\ndistortion_model: plumb_bob\nd: [" + kD + "]\nk: [" + kK +
            "]\nr: [" + kOne +
            "]\np: [554.25, 0, 319.5, -66.51, 0, 554.25, 239.5, 0, 0, 0, 1, 0]\n"}},
      {"ORB-SLAM",
       "LEFT.K, LEFT.R, LEFT.P",
       {"%YAML:1.0\n---\nLEFT.width: 640\nLEFT.height: 480\nRIGHT.width: 640\nRIGHT.height: 480\n" +
        Matrix("LEFT.K", 3, 3, kK) + Matrix("LEFT.D", 1, 5, kD) + Matrix("LEFT.R", 3, 3, kOne) +
        Matrix("LEFT.P", 3, 4, "500., 0., 320., 0., 0., 500., 240., 0., 0., 0., 1., 0.") +
        Matrix("RIGHT.K", 3, 3, kK) + Matrix("RIGHT.D", 1, 5, kD) + Matrix("RIGHT.R", 3, 3, kOne) +
        Matrix("RIGHT.P", 3, 4, "500., 0., 320., -60., 0., 500., 240., 0., 0., 0., 1., 0.")}},
      {"by hand",
       "left: {K, D}, right: {K, D}",
       {"imageSize: [640, 480]\nleft: {K: [" + kK + "], D: [" + kD + "]}\nright: {K: [" + kK +
        "], D: [" + kD + "]}\nR: [" + kOne + "]\nT: [-0.12, 0, 0]\n"}},
      {"our own",
       "rig file",
       {"width_px: 640\nheight_px: 480\nhorizontal_fov_rad: 1.0471975511965976\n"
        "baseline_m: 0.12\n"}},
      {"our own",
       "rig file, without a field of view",
       {"width_px: 640\nheight_px: 480\nbaseline_m: 0.12\n"}},
      {"our own", "rig file, a key misspelt", {"widht_px: 640\n"}},
      {"our own", "rig file beside a calibration", {"width_px: 640\n", Yaml()}},
      {"NumPy", ".npz", {std::string("PK\x03\x04\x14\0", 6)}},
      {"NumPy", ".npy", {"\x93NUMPY\x01"}},
      {"MATLAB", ".mat", {std::string("MATLAB 5.0 MAT-file\0\1IM", 23)}},
      {"gzip", ".yml.gz", {"\x1f\x8b\x08"}},
      {"any", "empty file", {""}},
      {"any", "a picture", {"\x89PNG\r\n"}},
  };
}

std::string Described(const RigFromFile& from) {
  const MountedCamera& left = from.rig.left;
  const vision::LensDistortion& lens = from.distortion.left;
  std::ostringstream out;
  out << left.width_px << " x " << left.height_px << ", f " << left.fx_px;
  if (lens.equidistant) out << ", equidistant";
  const char* names[] = {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2", "s1", "s2", "s3", "s4"};
  const double numbers[] = {lens.k1, lens.k2, lens.k3, lens.k4, lens.k5, lens.k6,
                            lens.p1, lens.p2, lens.s1, lens.s2, lens.s3, lens.s4};
  for (size_t i = 0; i < std::size(names); ++i)
    if (numbers[i] != 0) out << " " << names[i] << " " << numbers[i];
  const Pose X_LR = left.X_HC.Inverse() * from.rig.right.X_HC;
  for (int i = 0; i < 3; ++i)
    out << (i == 0 ? ", right camera at " : " ") << std::round(1000 * X_LR.p(i)) + 0.;
  const Eigen::Vector3d left_of_head = left.X_HC.q.inverse() * Eigen::Vector3d::UnitY();
  out << " mm" << (left_of_head.x() > -0.9 ? ", head turned" : "");
  EXPECT_EQ(from.distortion.left, from.distortion.right);
  return out.str();
}

std::string OutcomeOf(const Variant& variant, const std::filesystem::path& folder) {
  std::vector<std::string> files;
  for (const std::string& text : variant.files) {
    files.push_back(
        (folder / (std::string(1, static_cast<char>('a' + files.size())) + ".yml")).string());
    std::ofstream(files.back(), std::ios::binary) << text;
  }
  try {
    return Described(LoadRig(files, 640, 480));
  } catch (const ConfigError& error) {
    return "refused: " +
           With(std::string(error.what()) + "/", {{folder.string() + "/", ""}, {"/", ""}});
  }
}

TEST(Calibrations, AreReadOrRefusedAsTheTableSays) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "calibrations";
  std::filesystem::create_directories(folder);
  std::string table = "| Format | Variant | Outcome |\n|---|---|---|\n";
  for (const std::vector<Variant>& variants : {OfOpenCv(), OfOthers()})
    for (const Variant& variant : variants)
      table += "| " + variant.format + " | " + variant.name + " | " + OutcomeOf(variant, folder) +
               " |\n";
  testing::ExpectDrawn("calibrations.txt", table);
}

}  // namespace
}  // namespace turbidock::config
