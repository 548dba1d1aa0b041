#include "experiments/config/calibration_file.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <boost/property_tree/xml_parser.hpp>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <map>
#include <sstream>

#include "experiments/config/yaml_fields.h"
#include "experiments/system/output_path.h"
#include "experiments/system/plain_text.h"

namespace turbidock::config {
namespace {

using Names = std::initializer_list<const char*>;

// What files call a camera matrix, in small letters without punctuation.
constexpr Names kMatrix = {"k", "m", "cameramatrix", "intrinsicmatrix", "mtx", "intrinsics"};
// What stands before or behind it for the one and for the other camera.
constexpr std::array kSideNames = {
    "1",          "2",           "l",     "r",       "left",    "right",      "0",
    "1",          "cam0",        "cam1",  "camera1", "camera2", "leftcamera", "rightcamera",
    "cameraleft", "cameraright", "file1", "file2"};  // a pair each; files: see Insert

std::string Plain(const std::string& key) {
  std::string plain;
  for (const unsigned char c : key)
    if (std::isalnum(c)) plain += static_cast<char>(std::tolower(c));
  return plain;
}

// All values of the files by their plain names.
class Values {
 public:
  // Of a document of one camera, whose names say no side, they are those of that file.
  void Insert(const YamlNode& document) {
    std::vector<std::pair<std::string, YamlNode>> entries;
    for (const auto& [key, value] : document.Entries()) {
      if (!value.IsMap() || value.Find("data"))
        entries.emplace_back(Plain(key), value);
      else
        for (const auto& [inner, at] : value.Entries())
          entries.emplace_back(Plain(key) + Plain(inner), at);
    }
    const bool of_one = std::ranges::any_of(
        entries, [](const auto& entry) { return std::ranges::count(kMatrix, entry.first) > 0; });
    const std::string prefix = of_one ? fmt::format("file{}", ++files_of_one_) : "";
    for (const auto& [key, value] : entries) values_.emplace(prefix + key, value);
  }
  // Finds how the files name their sides.
  void FindSides(const std::string& files) {
    for (size_t i = 0; i < kSideNames.size(); i += 2) {
      sides_ = {kSideNames[i], kSideNames[i + 1]};
      if (Find(kMatrix, Side::kLeft) && Find(kMatrix, Side::kRight)) return;
    }
    throw ConfigError(
        files + (files_of_one_ == 1
                     ? ": is of one camera; give both cameras' files: --rig LEFT --rig RIGHT"
                     : ": has no camera matrices of two cameras (such as K1 and K2, M1 and M2, "
                       "cameraMatrixL and cameraMatrixR, cam0 and cam1)"));
  }

  std::optional<YamlNode> Find(Names names, const std::string& side = "") const {
    for (const std::string name : names)
      for (const std::string& key : {side + name, name + side})
        if (const auto found = values_.find(key); found != values_.end()) return found->second;
    return std::nullopt;
  }
  std::optional<YamlNode> Find(Names names, Side side) const { return Find(names, sides_[side]); }
  // That of a side, or else of both.
  std::optional<YamlNode> FindAny(Names names, Side side) const {
    const std::optional<YamlNode> own = Find(names, side);
    return own ? own : Find(names);
  }

 private:
  std::map<std::string, YamlNode> values_;
  Stereo<std::string> sides_;
  int files_of_one_ = 0;
};

template <class V>
V ValueOf(const YamlNode& at) {
  V value{};
  ReadValue(at, &value);
  return value;
}

void AddNumbers(const YamlNode& at, std::vector<double>* numbers) {
  if (!at.IsList()) return numbers->push_back(ValueOf<double>(at));
  for (const YamlNode& element : at.Elements()) AddNumbers(element, numbers);
}

// Of a matrix row by row. `sizes`: how many are allowed.
std::vector<double> NumbersOf(const YamlNode& at, std::initializer_list<size_t> sizes) {
  const std::optional<YamlNode> data = at.IsMap() ? at.Find("data") : at;
  if (!data || !data->IsList()) at.Fail("is no matrix");
  std::vector<double> numbers;
  AddNumbers(*data, &numbers);
  if (std::ranges::find(sizes, numbers.size()) == sizes.end())
    at.Fail(fmt::format("has {} elements, must have {}", numbers.size(), fmt::join(sizes, " or ")));
  return numbers;
}

template <int kRows, int kCols>
Eigen::Matrix<double, kRows, kCols> MatrixOf(const YamlNode& at) {
  const std::vector<double> numbers = NumbersOf(at, {size_t{kRows * kCols}});
  return Eigen::Map<const Eigen::Matrix<double, kCols, kRows>>(numbers.data()).transpose();
}

// Pixels of a side of the images; OpenCV may have written them as "640.".
int SideIn(const YamlNode& at) {
  constexpr double kLargest_px = 8192;
  const auto side_px = ValueOf<double>(at);
  if (!(side_px >= 1 && side_px <= kLargest_px) || side_px != std::floor(side_px))
    at.Fail(fmt::format("is {}, must be a whole number in [1, {}]", FormatNumber(side_px),
                        kLargest_px));
  return static_cast<int>(side_px);
}

std::optional<ImageSize> SizeIn(const Values& values, Side side) {
  const auto width = values.FindAny({"imagewidth", "width"}, side),
             height = values.FindAny({"imageheight", "height"}, side);
  if (width && height) return ImageSize{SideIn(*width), SideIn(*height)};
  if (width) width->Fail("stands alone: image_height is required");
  if (height) height->Fail("stands alone: image_width is required");
  const auto size = values.FindAny({"imagesize", "size", "resolution", "imgsize"}, side);
  if (!size) return std::nullopt;
  const std::vector<YamlNode> sides = size->Elements();
  if (sides.size() != 2) size->Fail("must be a list of width and height");
  return ImageSize{SideIn(sides[0]), SideIn(sides[1])};
}

// Whether the lens is said to be equidistant; nothing where nothing is said.
std::optional<bool> IsEquidistant(const Values& values, Side side) {
  const auto camera = values.FindAny({"cameramodel"}, side),
             fisheye = values.FindAny({"fisheyemodel"}, side),
             at = values.FindAny({"distortionmodel"}, side);
  if (camera && camera->Text() != "pinhole") camera->Fail("must be pinhole to be read");
  if (fisheye) return ValueOf<double>(*fisheye) != 0;
  if (!at) return std::nullopt;
  const std::string model = Plain(at->Text().value_or(""));
  for (const std::string known : {"plumbbob", "radtan", "rationalpolynomial"})
    if (model == known) return false;
  if (model != "equidistant" && model != "fisheye")
    at->Fail("must be plumb_bob, radtan, rational_polynomial or equidistant to be read");
  return true;
}

vision::LensDistortion LensIn(const Values& values, Side side, const std::string& files) {
  const std::optional<YamlNode> at =
      values.Find({"d", "distcoeffs", "distortioncoefficients", "distortioncoeffs", "dist"}, side);
  if (!at) throw ConfigError(files + ": has no distortion of a camera (such as D1, distCoeffs1)");
  const std::optional<bool> equidistant = IsEquidistant(values, side);
  std::vector<double> d =
      equidistant.value_or(false) ? NumbersOf(*at, {4}) : NumbersOf(*at, {4, 5, 8, 12, 14});
  if (d.size() == 4 && !equidistant)
    at->Fail(
        "has 4 numbers, which are k1 k2 p1 p2 of a plain lens or k1 k2 k3 k4 of a fisheye; add "
        "the line 'distortion_model: plumb_bob' or 'distortion_model: equidistant'");
  constexpr double kMost = 1000;  // of a fit to any lens
  for (const double k : d)
    if (!InRange(-kMost, kMost).Contains(k))
      at->Fail(
          fmt::format("a distortion of {} must be in [{}, {}]", FormatNumber(k), -kMost, kMost));
  d.resize(14);
  if (d[12] != 0 || d[13] != 0)
    at->Fail("has a tilted sensor (its last two numbers); calibrate without CALIB_TILTED_MODEL");
  if (equidistant == true)
    return {.equidistant = true, .k1 = d[0], .k2 = d[1], .k3 = d[2], .k4 = d[3]};
  return {false, d[0], d[1], d[4], d[5], d[6], d[7], d[2], d[3], d[8], d[9], d[10], d[11]};
}

CalibratedCamera CameraIn(const Values& values, Side side, const std::string& files) {
  const YamlNode at = values.Find(kMatrix, side).value();
  const std::vector<double> k = NumbersOf(at, {9, 4});
  CalibratedCamera camera{
      .at = at, .K = {}, .lens = LensIn(values, side, files), .size = SizeIn(values, side)};
  if (k.size() == 4)  // Kalibr's
    camera.K << k[0], 0, k[2], 0, k[1], k[3], 0, 0, 1;
  else
    camera.K = MatrixOf<3, 3>(at);
  if (camera.K(1, 0) != 0 || camera.K.row(2) != Eigen::RowVector3d(0, 0, 1))
    at.Fail("is no camera matrix, fx 0 cx, 0 fy cy, 0 0 1 (MATLAB has it transposed)");
  return camera;
}

void ReadExtrinsics(const Values& values, Calibration* out) {
  if (const auto T = values.Find({"tcncnm1"}, Side::kRight)) {  // Kalibr's
    const Eigen::Matrix4d X = MatrixOf<4, 4>(*T);
    out->R_RL = X.topLeftCorner<3, 3>();
    out->p_RL = X.topRightCorner<3, 1>();
    return;
  }
  if (const auto R = values.Find({"r", "rotation", "rotationmatrix"}),
      T = values.Find({"t", "translation", "translationvector"});
      R && T) {
    out->R_RL = MatrixOf<3, 3>(*R);
    out->p_RL = MatrixOf<3, 1>(*T);
    return;
  }
  // From what makes both images parallel: p_rectified = R p, and the baseline in P.
  Stereo<Eigen::Matrix3d> R;
  Stereo<Eigen::Vector3d> p;
  for (const Side side : kSides) {
    const auto rectification = values.Find({"r", "rectificationmatrix"}, side),
               projection = values.Find({"p", "projectionmatrix"}, side);
    if (!rectification || !projection)
      throw ConfigError(out->files +
                        ": has no R and T of the right camera, and no rectification "
                        "and projection matrices of both (such as R1, P1, R2, P2)");
    R[side] = MatrixOf<3, 3>(*rectification);
    const Eigen::Matrix<double, 3, 4> P = MatrixOf<3, 4>(*projection);
    p[side] = P.leftCols<3>().diagonal().cwiseInverse().cwiseProduct(P.col(3));
    if (side == Side::kRight && p.left == p.right)
      projection->Fail(
          "has no baseline: its fourth number is that of the left camera; calibrate "
          "both cameras together");
  }
  out->R_RL = R.right.transpose() * R.left;
  out->p_RL = R.right.transpose() * (p.right - p.left);
}

// What XML says, as YAML would: a map of its elements, or else its words.
YamlTree TreeOf(const boost::property_tree::ptree& xml, int line) {
  YamlTree tree{.kind = YamlTree::Kind::kMap, .text = "", .entries = {}, .line = line};
  for (const auto& [name, child] : xml)
    if (name != "<xmlattr>")
      tree.entries.push_back({name, line, std::make_shared<const YamlTree>(TreeOf(child, line))});
  if (!tree.entries.empty()) return tree;
  std::istringstream words(xml.data());
  tree.kind = YamlTree::Kind::kList;
  for (std::string word; words >> word;)
    tree.entries.push_back({"", line, TextNode(word, {nullptr, "", "", line}).tree});
  return tree.entries.size() == 1 ? *tree.entries[0].value : tree;
}

YamlNode ParseXml(const std::string& text, const std::string& file) {
  constexpr auto kMostTags = 10000;  // they may be nested, and are read by recursion
  if (std::ranges::count(text, '<') > kMostTags)
    throw ConfigError(fmt::format("{}: has more than {} tags", file, kMostTags));
  boost::property_tree::ptree xml;
  try {
    std::istringstream stream(text);
    boost::property_tree::read_xml(stream, xml, boost::property_tree::xml_parser::no_comments);
  } catch (const boost::property_tree::xml_parser_error& error) {
    throw ConfigError(fmt::format("{}:{}: not valid XML: {}", file, error.line(), error.message()));
  }
  const auto storage = xml.get_child_optional("opencv_storage");
  if (!storage) throw ConfigError(file + ": is XML without <opencv_storage>, as OpenCV writes it");
  YamlTree tree{.kind = YamlTree::Kind::kMap, .text = "", .entries = {}};
  for (const auto& [name, child] : *storage) {
    const auto end =
        text.begin() + static_cast<std::ptrdiff_t>(std::min(text.find("<" + name), text.size()));
    const int line = 1 + static_cast<int>(std::count(text.begin(), end, '\n'));
    tree.entries.push_back({name, line, std::make_shared<const YamlTree>(TreeOf(child, line))});
  }
  return {std::make_shared<const YamlTree>(std::move(tree)), file, ""};
}

bool IsOwnRig(const YamlNode& document) {
  const std::vector<KeyDoc> own = ListKeys<RigParams>();
  return std::ranges::any_of(own,
                             [&](const auto& at) { return document.Find(at.key).has_value(); });
}

void RefuseOthers(const std::string& text, const std::string& file) {
  const auto holds = [&](const char* mark) { return text.find(mark) != std::string::npos; };
  if (system::FirstNoText(text) || text.starts_with("# oST"))  // ROS's .ini
    throw ConfigError(file + ": is no YAML, XML or JSON, as cv::FileStorage, ROS and Kalibr write");
  if (holds("!!binary") || holds("$base64$"))
    throw ConfigError(file + ": holds base64; write it without cv::FileStorage::WRITE_BASE64");
}

}  // namespace

std::optional<Calibration> ReadCalibration(const std::vector<std::string>& files) {
  Values values;
  std::vector<std::string> own;
  for (const std::string& file : files) {
    std::string text = system::ReadWhole(file);
    RefuseOthers(text, file);
    if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);  // a byte-order mark
    const size_t first = std::min(text.find_first_not_of(" \t\r\n"), text.size());
    const char mark = text.c_str()[first];
    if (mark == '%') text[first] = '#';  // OpenCV's first line is not quite YAML's
    if (mark == '{') std::ranges::replace(text, '\t', ' ');  // JSON is YAML but for these
    const YamlNode document =
        mark == '<' ? ParseXml(text, file) : ParseYaml(text, file, "!!opencv-matrix");
    const bool has_lists = std::ranges::any_of(
        document.Entries(), [](const auto& at) { return !at.second.Text().has_value(); });
    if (IsOwnRig(document) || !(has_lists || mark == '%' || mark == '{' || mark == '<'))
      own.push_back(file);
    else
      values.Insert(document);
  }
  if (own.size() == files.size()) return std::nullopt;
  if (!own.empty())
    throw ConfigError(own[0] + ": is no calibration as the files beside it; give either");
  Calibration out{
      .files = fmt::format("{}", fmt::join(files, ", ")), .cameras = {}, .R_RL = {}, .p_RL = {}};
  values.FindSides(out.files);
  for (const Side side : kSides) out.cameras[side] = CameraIn(values, side, out.files);
  ReadExtrinsics(values, &out);
  return out;
}

}  // namespace turbidock::config
