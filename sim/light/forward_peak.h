#pragma once
// The image of a ball through water that scatters by small angles: all orders at once, by the
// theory of W. H. Wells (AGARD Lecture Series 61, 1973).
//
// The water between the camera and a ball at distance D passes what has frequency psi [1/rad] with
//   M(psi) = exp(-t (1 - h(w psi))),   h(x) = (1 - exp(-x)) / x,   t = D times the peak's
//   scattering,
// for light that a scattering turns as 1 / (1 + (angle / w)^2)^(3/2), which is Henyey's and
// Greenstein's phase function at small angles. The part exp(-t) is the ball as sharp as ever; the
// rest is spread over it and around it. Both together are all of its light.
//
// Surfaces that only lamps or balls light keep that part, unblurred.

#include <array>
#include <functional>
#include <vector>

#include "sim/light/scattering.h"

namespace turbidock::light {

class SpreadBall {
 public:
  static constexpr int kPlaces = 129;  // nodes in w = r / (r + R), r from 0 to infinity
  using Profile = std::array<float, kPlaces>;

  // Of a ball whose disc has the radiance shape(r / R) (0 to 1, in any unit).
  SpreadBall(const ForwardPeak& peak, double radius_m, const std::function<double(double)>& shape);

  // The spread part of a ball of unit intensity, seen through so much water, by the distance r of
  // the ray from its centre [sr/m^2].
  Profile At(double distance_m) const;

 private:
  // Nodes of distance at kNear_m * 2^(k / kPerOctave): from 0.125 to 16 m.
  static constexpr double kNear_m = 0.125;
  static constexpr int kPerOctave = 4, kDistances = 7 * kPerOctave + 1;

  std::vector<Profile> profiles_;  // by distance
};

}  // namespace turbidock::light
