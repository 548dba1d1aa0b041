#pragma once
// A marker of fiducial tags, square black and white codes (Olson 2011), as a data file describes
// it: which tag sits where in the marker frame M.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "sim/base/fields.h"
#include "sim/base/pose.h"

namespace turbidock::vision {

// Families of AprilTag. The first number is how many cells carry the code, the second in how many
// of them two codes differ at least.
enum class TagFamily { k16h5, k25h9, k36h11 };
constexpr auto Names(TagFamily) {
  using enum TagFamily;
  return EnumList<TagFamily>({{k16h5, "16h5"}, {k25h9, "25h9"}, {k36h11, "36h11"}});
}

// One tag. Its frame T has the tag's middle as its origin, x into the tag, y to the left and z up
// as the tag is printed: the axes of M when it hangs upright and faces the vehicle.
struct TagParams {
  int id = 0;
  Eigen::Vector3d p_MT_m = Eigen::Vector3d::Zero();
  Eigen::Vector4d q_MT_wxyz{1, 0, 0, 0};
  double size_m = 0.066;

  static void Fields(auto& self, auto&& field) {
    field("id", self.id, InRange(0, 100000), "its number in the family");
    field("p_MT_m", self.p_MT_m, InRange(-5, 5), "its middle in the marker frame M");
    field("q_MT_wxyz", self.q_MT_wxyz, InRange(-1, 1), "how it is turned in M; a unit quaternion");
    field("size_m", self.size_m, InRange(0.001, 5), "edge of its black square");
  }
  // ConfigError for a quaternion that is none.
  void Check(const std::string& path) const;

  Pose X_MT() const;
};

struct FiducialParams {
  TagFamily family = TagFamily::k16h5;
  std::vector<TagParams> tags;
  double blur_px = 0.8;
  double max_error_px = 1.5;

  static void Fields(auto& self, auto&& field) {
    field("family", self.family, Range{}, "the tags' family of AprilTag");
    field("tags", self.tags, Range{}, "the marker's tags; none: those of the scene (sites tag_*)");
    field("blur_px", self.blur_px, InRange(0, 5),
          "standard deviation of the blur before tags are looked for; steadies noisy images");
    field("max_error_px", self.max_error_px, InRange(0.05, 50),
          "root mean square of a tag's corners about where its pose has them, beyond which it is "
          "not used");
  }
  // ConfigError for two tags of one number, or one that the family does not have.
  void Check(const std::string& path) const;
};

}  // namespace turbidock::vision
