#pragma once
// A marker of fiducial tags, square black and white codes (AprilTag: Olson 2011; ArUco:
// Garrido-Jurado et al. 2014), as a data file describes it: which tag sits where in the marker
// frame M.

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/pose.h"

namespace turbidock::vision {

// Families of AprilTag: the first number is how many cells carry the code, the second in how many
// of them two codes differ at least. ArUco's dictionaries as OpenCV has them, by their cells: tags
// 0 to 249 of DICT_4X4_*, DICT_5X5_* and DICT_6X6_* (larger ones begin with the smaller), and
// DICT_ARUCO_ORIGINAL.
enum class TagFamily { k16h5, k25h9, k36h11, kAruco4x4, kAruco5x5, kAruco6x6, kArucoOriginal };
constexpr auto Names(TagFamily) {
  using enum TagFamily;
  return EnumList<TagFamily>({{k16h5, "16h5"},
                              {k25h9, "25h9"},
                              {k36h11, "36h11"},
                              {kAruco4x4, "aruco_4x4"},
                              {kAruco5x5, "aruco_5x5"},
                              {kAruco6x6, "aruco_6x6"},
                              {kArucoOriginal, "aruco_original"}});
}

// One tag. Its frame T has the tag's middle as its origin, x into the tag, y to the left and z up
// as the tag is printed: the axes of M when it hangs upright and faces the vehicle.
struct TagParams {
  int id = 0;
  Eigen::Vector3d p_MT_m = Eigen::Vector3d::Zero();
  Eigen::Vector4d q_MT_wxyz{1, 0, 0, 0};
  double size_m = 0.066;

  static void Fields(auto& self, auto&& field) {
    field("id", self.id, InRange(0, 100000), "number of a fiducial tag in its family");
    field("p_MT_m", self.p_MT_m, InRange(-5, 5),
          "middle of a fiducial tag: x, y, z in the marker's frame M");
    field("q_MT_wxyz", self.q_MT_wxyz, InRange(-1, 1),
          "attitude of a fiducial tag in the marker's frame M: unit quaternion w, x, y, z");
    field("size_m", self.size_m, InRange(0.001, 5), "edge of a fiducial tag's black square");
  }
  // ConfigError for a quaternion that is none.
  void Check(const std::string& path) const;

  Pose X_MT() const;
};

struct FiducialParams {
  TagFamily family = TagFamily::k16h5;
  std::vector<TagParams> tags = {};
  bool tags_from_scene = true;
  double blur_px = 0.8;
  double max_error_px = 1.5;

  static void Fields(auto& self, auto&& field) {
    field("family", self.family, Range{},
          "family of the fiducial tags, of AprilTag or of OpenCV's ArUco dictionaries");
    field("tags", self.tags, Range{}, "fiducial tags of the marker");
    field("tags_from_scene", self.tags_from_scene, Range{},
          "whether the fiducial tags are those of the scene (sites tag_*); giving tags says no");
    field("blur_px", self.blur_px, InRange(0, 5),
          "standard deviation of the blur before fiducial tags are looked for; steadies noisy "
          "images");
    field("max_error_px", self.max_error_px, InRange(0.05, 50),
          "root mean square distance of a fiducial tag's corners from where its pose has them, "
          "beyond which the tag is not used");
  }
  static constexpr std::array kPresets = {"tags_from_scene"};
  void Given(const std::string& key) {
    if (key == "tags_from_scene") {
      if (!tags_from_scene) tags.clear();
    } else if (key.starts_with("tags")) {
      tags_from_scene = tags.empty();
    }
  }
  // ConfigError for two tags of one number, or one that the family does not have.
  void Check(const std::string& path) const;
};

}  // namespace turbidock::vision
