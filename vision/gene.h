#pragma once
// The gene of RM-GA: 72 bits, six fields of 12 bits for x, y, z, eps1, eps2, eps3, plain binary.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "sim/base/fields.h"
#include "sim/base/pose.h"

namespace turbidock::vision {

inline constexpr int kGeneFields = 6;
inline constexpr int kFieldBits = 12;
inline constexpr int kGeneBits = kGeneFields * kFieldBits;
inline constexpr int kFieldMax = (1 << kFieldBits) - 1;

// Bit 0 is the most significant bit of x, bit 71 the least significant bit of eps3.
struct Gene {
  std::array<uint16_t, kGeneFields> fields{};

  bool bit(int i) const {
    return (fields[static_cast<size_t>(i / kFieldBits)] >> (kFieldBits - 1 - i % kFieldBits)) & 1;
  }
  void FlipBit(int i) {
    fields[static_cast<size_t>(i / kFieldBits)] ^=
        static_cast<uint16_t>(1u << (kFieldBits - 1 - i % kFieldBits));
  }
  bool operator==(const Gene&) const = default;
};

// Two-point crossover: `a` with bits [first, last) of `b`, 0 <= first <= last <= 72.
inline Gene Cross(const Gene& a, const Gene& b, int first, int last) {
  Gene child;
  for (int f = 0; f < kGeneFields; ++f) {
    // Bits of this field inside [first, last): a run of ones in a 12-bit mask.
    const int from = std::clamp(first - f * kFieldBits, 0, kFieldBits);
    const int to = std::clamp(last - f * kFieldBits, 0, kFieldBits);
    const unsigned mask = ((1u << (kFieldBits - from)) - 1) & ~((1u << (kFieldBits - to)) - 1);
    const auto i = static_cast<size_t>(f);
    child.fields[i] = static_cast<uint16_t>((a.fields[i] & ~mask) | (b.fields[i] & mask));
  }
  return child;
}

// Where the marker is looked for, in H. The ends of a field are its lowest and highest code.
struct SearchRange {
  double x_min_m = 0.3, x_max_m = 1.6;  // docking ends at 0.35, detection begins at 1.5 [S]
  double y_max_m = 0.4, z_max_m = 0.3;  // about the published +-400 and +-200 mm
  double eps_max = 0.15;                // +-17 degrees about one axis

  static void Fields(auto& self, auto&& field) {
    field("x_min_m", self.x_min_m, InRange(0.05, 100),
          "least x (forward of the camera head) at which the marker is looked for");
    field("x_max_m", self.x_max_m, InRange(0.05, 100),
          "largest x (forward of the camera head) at which the marker is looked for");
    field("y_max_m", self.y_max_m, InRange(0.01, 100),
          "largest distance to either side of the camera head at which the marker is looked for");
    field("z_max_m", self.z_max_m, InRange(0.01, 100),
          "largest distance above and below the camera head at which the marker is looked for");
    field("eps_max", self.eps_max, InRange(0.001, 0.57),
          "largest component eps1, eps2, eps3 of the unit quaternion with which the marker is "
          "looked for");
  }
  void Check(const std::string& path) const {
    if (!(x_min_m < x_max_m))
      throw ConfigError(JoinKey(path, "x_max_m"), FormatNumber(x_max_m) + " must be > x_min_m");
  }
};

// The linear map between codes and (x, y, z, eps1, eps2, eps3).
class GeneMap {
 public:
  using Values = std::array<double, kGeneFields>;

  explicit GeneMap(const SearchRange& range)
      : low_{range.x_min_m,  -range.y_max_m, -range.z_max_m,
             -range.eps_max, -range.eps_max, -range.eps_max},
        high_{range.x_max_m, range.y_max_m, range.z_max_m,
              range.eps_max, range.eps_max, range.eps_max} {}

  // The part of this range within `half_width` of `center`; a centre outside is moved to its end.
  GeneMap Around(const Values& center, const Values& half_width) const {
    GeneMap part = *this;
    for (size_t i = 0; i < kGeneFields; ++i) {
      const double middle = std::clamp(center[i], low_[i], high_[i]);
      part.low_[i] = std::max(low_[i], middle - half_width[i]);
      part.high_[i] = std::min(high_[i], middle + half_width[i]);
    }
    return part;
  }
  const Values& low() const { return low_; }
  const Values& high() const { return high_; }

  Values Decode(const Gene& gene) const {
    Values values;
    for (size_t i = 0; i < kGeneFields; ++i)
      values[i] = low_[i] + (high_[i] - low_[i]) * gene.fields[i] / kFieldMax;
    return values;
  }
  // The nearest code; values outside the range give its end.
  Gene Encode(const Values& values) const {
    Gene gene;
    for (size_t i = 0; i < kGeneFields; ++i) {
      const double code = kFieldMax * (values[i] - low_[i]) / (high_[i] - low_[i]);
      gene.fields[i] = static_cast<uint16_t>(std::lround(std::clamp(code, 0.0, 1.0 * kFieldMax)));
    }
    return gene;
  }
  static Pose PoseOf(const Values& v) {
    return Pose::FromVectorPart({v[0], v[1], v[2]}, {v[3], v[4], v[5]});
  }
  static Values ValuesOf(const Pose& X_HM) {
    const Pose X = X_HM.Canonical();
    return {X.p.x(), X.p.y(), X.p.z(), X.q.x(), X.q.y(), X.q.z()};
  }

 private:
  Values low_, high_;
};

}  // namespace turbidock::vision
