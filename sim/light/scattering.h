#pragma once
// Light in a homogeneous, scattering medium: the few equations that the water model is made of, and
// tables of their integrals. Per channel (R, G, B), linear radiance, SI. Points and directions are
// Eigen vectors in one frame, whichever the caller uses.
//
// Symbols: a absorption, b scattering, c = a + b extinction [1/m]; g mean cosine of scattering;
// G the coefficient that replaces c where scattered light still counts (Medium::Diffuse);
// b' = b (1 - g), scattering by as much as an isotropic medium's that spreads light alike.
// Of b the narrow forward peak of sea water is apart (ForwardPeak): light that it turns still makes
// the image (sim/light/forward_peak.h), so it is no loss but to a narrow beam.

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/pose.h"
#include "sim/base/vector_math.h"
#include "sim/light/optics_params.h"
#include "sim/light/own_shadow.h"
#include "sim/light/surfaces.h"

namespace turbidock::light {

using Rgb = Eigen::Array3d;  // one value a channel: red, green, blue
// The same in single precision, and nothing: the layout of which one vector instruction takes all.
using Light = Eigen::Array4f;

// Scattering by small angles, equal in all channels: the phase function of Henyey and Greenstein of
// mean cosine 1 - width, of which 1 - 1 / sqrt(1 + x^2) turns by less than x widths.
struct ForwardPeak {
  double scattering_per_m = 0;  // none by default
  double width_rad = 0;
};

// What the water does to light.
struct Medium {
  Rgb absorption_per_m = Rgb::Zero();
  Rgb scattering_per_m = Rgb::Zero();  // without the peak's
  Rgb asymmetry = Rgb::Zero();         // g, likewise
  bool multiple_scattering = false;
  ForwardPeak peak{};

  // c = a + b and the peak's scattering: what a narrow beam loses.
  Rgb extinction_per_m() const { return image_loss_per_m() + peak.scattering_per_m; }
  // What an image loses on its way: c without the peak's scattering.
  Rgb image_loss_per_m() const { return absorption_per_m + scattering_per_m; }
  // G = a + b (1 - share g). With share = 1 light scattered forward is not lost, as for the
  // irradiance of a wide beam; with share = 0, G = c: strict single scattering.
  Rgb Diffuse(double share) const {
    return absorption_per_m + scattering_per_m * (1 - share * asymmetry);
  }
  // What light loses on its way to a surface and in the veil, and in a halo. Shares are from walks
  // of many turns (assets/measured/recognition.md).
  Rgb lighting_loss_per_m() const { return Diffuse(multiple_scattering ? 1 : 0); }
  Rgb halo_loss_per_m() const { return Diffuse(multiple_scattering ? 0.5 : 0); }
};

// The sum of the background water and the milk in it. Asymmetries add weighted by scattering; the
// peak is the background's.
Medium MakeMedium(const WaterParams& params);

// Phase function of Henyey and Greenstein (1941) [1/sr]; mu = cosine of the angle between the
// light's direction before and after. Integrates to 1 over the sphere.
double HenyeyGreenstein(double g, double mu);

// A lamp: a point with an axis, in the head frame.
struct Lamp {
  Eigen::Vector3d p_HE = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_H = Eigen::Vector3d::UnitX();
  LampParams beam = {};
  OwnShadow shadow = {};
};

// Intensity relative to that on the axis, of a beam and of a lamp with what stands before it.
double BeamPattern(const LampParams& beam, double cos_alpha);
double BeamPattern(const Lamp& lamp, const Eigen::Vector3d& e_H);
// A beam's mean over all directions, by which its power is 4 pi times its intensity on the axis.
double MeanBeamPattern(const LampParams& beam);

// The veil: light of a lamp scattered once into the camera along a stretch of a unit ray u
// from the optical centre p_HC (Jaffe 1990, backscatter term):
//   Int b p(mu) I(alpha) / r^2 exp(-G (r + t)) dt,   r = |x(t) - p_HE|.
// Substituting t = t_p + h tan(phi) (h: distance of the lamp from the ray, t_p: its foot) turns dt
// / r^2 into dphi / h and leaves a smooth integrand, summed with `samples` midpoints.
//
// With full multiple scattering light that turned more than once is added: for b p(mu) I / r^2
//   + b' / (4 pi) F,   F = pi^2 b' / (4 r) (0.2 I(alpha) + 0.8 mean I).
// F is the fluence of light scattered once on its way from an isotropic lamp, without extinction:
// Int b' I / (4 pi y^2 z^2) dV, y and z the distances from lamp and point. The share 0.2 of a
// beam's own direction was fitted to walks of many turns.
Rgb VeilAlongRay(const Medium& medium, const Rgb& diffuse_per_m, const Lamp& lamp,
                 const Eigen::Vector3d& p_HC, const Eigen::Vector3d& u_H, const Stretch& stretch,
                 int samples);

// A lit ball as the water sees it: a sphere of given intensity, which shines equally in all
// directions. Or a Lambertian disc that faces the camera, of that intensity along its normal.
struct Glow {
  double radius_m = 0;
  Rgb intensity_w_sr = Rgb::Zero();
  bool disc = false;
};

// Irradiance that a ball gives to a unit area at right angles to the line to its centre, distance
// r, in clear water: I / r^2 (exact for a Lambertian sphere). The light within it arrives from a
// disc of angular radius asin(R / r), so the fluence that feeds scattering is larger, up to twice
// at the ball:
//   fluence / irradiance = 2 (1 - sqrt(1 - q^2)) / q^2,   q = R / r.
double FluenceRatio(double q);

// What is seen of a glow from so far, for its halo. Of the light that is scattered forwards on the
// way the more stays beside the glow the larger it looks: 3 (R / way)^0.6, at most all, instead
// of the half that Medium::halo_loss_per_m has. From walks of many turns about balls, faces and, in
// the sea, balls at 0.5 to 2 m (tests/light).
Glow SeenFrom(double way_m, const Medium& medium, const Glow& glow);

// The halo of a ball: as VeilAlongRay, with the ball as the source. `foot_m` is the distance along
// the ray of the point nearest to the ball's centre, `offset_m` its distance h from there (not
// below the radius: inside the disc h = R is used); the ray runs from 0 to range_m (which may be
// infinite).
Rgb HaloAlongRay(const Medium& medium, const Rgb& diffuse_per_m, const Glow& glow, double foot_m,
                 double offset_m, const Stretch& lit, int samples);

// HaloAlongRay from a table. With s = t - t_p the integral is
//   b I / h exp(-G t_p) Int p(-sin phi) exp(-G h (1 / cos phi + tan phi)) dphi,   s = h tan(phi),
// whose integral up to phi depends on (h, phi) only. Uniform nodes in q = R / h and in
// w = s / (h + |s|), which need neither a logarithm nor an arc tangent to look up.
class HaloTable {
 public:
  HaloTable(const Medium& medium, const Glow& glow);

  // Between two nodes: the lower one's number, and the share of the way from there.
  struct Place {
    int node;
    float share;
  };
  [[gnu::always_inline]] static Place AtOffset(float q) {
    return Between(q * (kOffsets - 1), kOffsets);
  }
  [[gnu::always_inline]] static Place At(float w) {
    return Between((0.5f + 0.5f * w) * (kPlaces - 1), kPlaces);
  }

  // b I Int ... dphi up to w.
  Light Cumulative(Place q, Place w) const {
    const Light* n = nodes_.data() + q.node * kPlaces + w.node;
    const Light low = n[0] + w.share * (n[1] - n[0]);
    const Light high = n[kPlaces] + w.share * (n[kPlaces + 1] - n[kPlaces]);
    return low + q.share * (high - low);
  }

 private:
  static constexpr int kOffsets = 65, kPlaces = 161;  // nodes in q and in w

  [[gnu::always_inline]] static Place Between(float x, int nodes) {
    const int node = std::min(static_cast<int>(x), nodes - 2);
    return {node, x - static_cast<float>(node)};
  }

  std::vector<Light> nodes_;  // [q][w]
};

// VeilAlongRay of all lamps for one camera, from a table over a grid of pixels (every 16th
// of 640) and logarithmic range. The lamps and the camera are fixed to the vehicle, so it is made
// once. The water begins at port_m.
class VeilTable {
 public:
  VeilTable(const Medium& medium, const std::vector<Lamp>& lamps, double port_m,
            const MountedCamera& camera);
  // Along the ray of pixel (u, v) to range_m (may be infinite).
  Light At(float u_px, float v_px, float range_m) const {
    const float per_px = 1.0f / static_cast<float>(stride_px_);
    const float x = u_px * per_px, y = v_px * per_px;
    const float z = kNodesPerOctave * Log2(range_m * static_cast<float>(1 / kNear_m));
    const int i = static_cast<int>(x), j = static_cast<int>(y);
    const int k = static_cast<int>(std::clamp(z, 0.0f, kRanges - 2.0f));
    const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
    const float fz = std::clamp(z - static_cast<float>(k), 0.0f, 1.0f);
    const Light* n = &nodes_[(static_cast<size_t>(j) * columns_ + i) * kRanges + k];
    const auto along_range = [fz](const Light* p) -> Light { return p[0] + fz * (p[1] - p[0]); };
    const auto along_row = [&](const Light* p) -> Light {
      const Light here = along_range(p);
      return here + fx * (along_range(p + kRanges) - here);
    };
    const Light top = along_row(n);
    return top + fy * (along_row(n + static_cast<ptrdiff_t>(columns_) * kRanges) - top);
  }

 private:
  // Nodes across the picture; nodes of range at kNear_m * 2^(k / kNodesPerOctave).
  static constexpr int kColumns = 40;
  static constexpr double kNear_m = 0.05;
  static constexpr int kNodesPerOctave = 4;
  static constexpr int kRanges = 8 * kNodesPerOctave + 1;

  int stride_px_, columns_, rows_;
  std::vector<Light> nodes_;  // [row][column][range]
};

}  // namespace turbidock::light
