#include "sim/light/scattering.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace turbidock::light {
namespace {

// Of light that turned more than once, what goes with the beam's own direction; the rest goes with
// its mean. Fitted to walks of many turns (assets/measured/recognition.md).
constexpr double kOwnShare = 0.2;

Light LightOf(const Rgb& rgb) {
  return {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2]), 0};
}

Rgb Phase(const Medium& medium, double mu) {
  return {HenyeyGreenstein(medium.asymmetry[0], mu), HenyeyGreenstein(medium.asymmetry[1], mu),
          HenyeyGreenstein(medium.asymmetry[2], mu)};
}

// Petzold's volume scattering measurements at 514 nm (1972). Scattering is taken as equal in all
// channels, absorption differs from that at 514 nm by the pure water's. The mean cosine of all
// scattering is 0.924; with the share `peak` of it by small angles, 0.018 goes backwards, as was
// measured. Share and width of the peak give what turns by less than 1 and 2 degrees.
Medium PetzoldWater(double absorption_per_m, double scattering_per_m, double peak,
                    double width_rad) {
  Medium medium;
  medium.absorption_per_m = absorption_per_m + Rgb(0.235, 0, -0.03);
  medium.scattering_per_m = Rgb::Constant((1 - peak) * scattering_per_m);
  medium.asymmetry = Rgb::Constant((0.924 - peak * (1 - width_rad)) / (1 - peak));
  medium.peak = {peak * scattering_per_m, width_rad};
  return medium;
}

Medium BackgroundMedium(const WaterParams& params) {
  switch (params.background) {
    case Background::kPure:
      return {.absorption_per_m = Rgb(0.28, 0.045, 0.015)};  // Pope & Fry 1997
    case Background::kClear:
      return PetzoldWater(0.114, 0.037, 0.375, 0.00965);
    case Background::kCoastal:
      return PetzoldWater(0.179, 0.219, 0.565, 0.00722);
    case Background::kHarbor:
      return PetzoldWater(0.366, 1.824, 0.438, 0.00969);
    case Background::kCustom:
      break;
  }
  return {.absorption_per_m = params.absorption_per_m,
          .scattering_per_m = params.scattering_per_m,
          .asymmetry = params.asymmetry};
}

}  // namespace

Medium MakeMedium(const WaterParams& params) {
  Medium medium = BackgroundMedium(params);
  medium.multiple_scattering = params.multiple_scattering;
  const Rgb milk =
      params.scattering_scale * params.milk_ml_m3 * params.milk_scattering_m2_ml.array();
  for (int k = 0; k < 3; ++k) {
    const double total = medium.scattering_per_m[k] + milk[k];
    if (total <= 0) continue;
    medium.asymmetry[k] =
        (medium.scattering_per_m[k] * medium.asymmetry[k] + milk[k] * params.milk_asymmetry[k]) /
        total;
    medium.scattering_per_m[k] = total;
  }
  return medium;
}

double HenyeyGreenstein(double g, double mu) {
  const double x = 1 + g * g - 2 * g * mu;
  return (1 - g * g) / (4 * std::numbers::pi * x * std::sqrt(x));
}

double BeamPattern(const LampParams& beam, double cos_alpha) {
  switch (beam.beam) {
    case BeamShape::kIsotropic:
      return 1;
    case BeamShape::kCosine:
      if (cos_alpha <= 0) return 0;
      return beam.cosine_exponent == 1 ? cos_alpha : std::pow(cos_alpha, beam.cosine_exponent);
    case BeamShape::kCone:
      break;
  }
  const double alpha_rad = std::acos(std::clamp(cos_alpha, -1.0, 1.0));
  const double x =
      std::clamp((beam.cone_half_angle_rad - alpha_rad) / beam.cone_soft_rad, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

double MeanBeamPattern(const LampParams& beam) {
  switch (beam.beam) {
    case BeamShape::kIsotropic:
      return 1;
    case BeamShape::kCosine:
      return 0.5 / (beam.cosine_exponent + 1);
    case BeamShape::kCone:
      break;
  }
  constexpr int kSamples = 32;
  const double soft_rad = std::min(beam.cone_soft_rad, beam.cone_half_angle_rad);
  double edge = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double alpha_rad = beam.cone_half_angle_rad - soft_rad * (i + 0.5) / kSamples;
    edge += BeamPattern(beam, std::cos(alpha_rad)) * std::sin(alpha_rad) * soft_rad / kSamples;
  }
  return 0.5 * (1 - std::cos(beam.cone_half_angle_rad - soft_rad) + edge);
}

double BeamPattern(const Lamp& lamp, const Eigen::Vector3d& e_H) {
  return BeamPattern(lamp.beam, lamp.axis_H.dot(e_H)) * lamp.shadow.OpenAt(e_H);
}

Rgb VeilAlongRay(const Medium& medium, const Rgb& diffuse_per_m, const Lamp& lamp,
                 const Eigen::Vector3d& p_HC, const Eigen::Vector3d& u_H, const Stretch& stretch,
                 int samples) {
  if (stretch.t1_m <= stretch.t0_m) return Rgb::Zero();
  const Eigen::Vector3d p_CE_H = lamp.p_HE - p_HC;
  const double foot_m = u_H.dot(p_CE_H);
  // A ray through the lamp itself would see an endless veil.
  const double h_m =
      std::max(1e-4, std::sqrt(std::max(0.0, p_CE_H.squaredNorm() - foot_m * foot_m)));
  const double phi0 = std::atan((stretch.t0_m - foot_m) / h_m);
  const double phi1 = std::atan((stretch.t1_m - foot_m) / h_m);
  const double step = (phi1 - phi0) / samples;
  const bool again = medium.multiple_scattering;
  const double mean_pattern = again ? MeanBeamPattern(lamp.beam) : 0;
  // over b, which the sum is multiplied with
  const Rgb again_per_m =
      std::numbers::pi / 16 * medium.scattering_per_m * (1 - medium.asymmetry).square();
  Rgb sum = Rgb::Zero();
  for (int i = 0; i < samples; ++i) {
    const double phi = phi0 + (i + 0.5) * step;
    const double t_m = foot_m + h_m * std::tan(phi), r_m = h_m / std::cos(phi);
    const Eigen::Vector3d e_H = (t_m * u_H - p_CE_H) / r_m;  // from the lamp to the point
    const double pattern = BeamPattern(lamp, e_H);
    Rgb share = Rgb::Zero();
    if (pattern > 0) share = pattern * Phase(medium, -e_H.dot(u_H));
    if (again) share += again_per_m * r_m * (kOwnShare * pattern + (1 - kOwnShare) * mean_pattern);
    sum += share * (-diffuse_per_m * (r_m + t_m)).exp();
  }
  return medium.scattering_per_m * lamp.beam.intensity_w_sr.array() * sum * (step / h_m);
}

double FluenceRatio(double q) {
  const double x = std::clamp(q * q, 0.0, 1.0);
  return x < 1e-6 ? 1 : 2 * (1 - std::sqrt(1 - x)) / x;
}

Glow SeenFrom(double way_m, const Medium& medium, const Glow& glow) {
  const double share = std::min(1.0, 3 * std::pow(glow.radius_m / way_m, 0.6));
  Glow seen = glow;
  seen.intensity_w_sr *=
      ((medium.halo_loss_per_m() - medium.Diffuse(medium.multiple_scattering ? share : 0)) * way_m)
          .exp();
  return seen;
}

namespace {

// Integrand of the halo over phi at offset h, without b I / h and exp(-G t_p). The light's way in
// the water begins at the ball's surface. A disc's light falls off with the cosine of the angle
// from its normal, which is that to the ray: none gets behind it.
Rgb HaloIntegrand(const Medium& medium, const Rgb& diffuse_per_m, const Glow& glow, double h_m,
                  double phi) {
  const double cos_phi = std::cos(phi), sin_phi = std::sin(phi);
  // (1 + sin) / cos, written so that it does not cancel on either side
  const double path = sin_phi < 0 ? cos_phi / (1 - sin_phi) : (1 + sin_phi) / cos_phi;
  const Rgb scattered = Phase(medium, -sin_phi);
  if (glow.disc) return std::max(0.0, -sin_phi) * scattered * (-diffuse_per_m * h_m * path).exp();
  return FluenceRatio(glow.radius_m * cos_phi / h_m) * scattered *
         (-diffuse_per_m * (h_m * path - glow.radius_m)).exp();
}

}  // namespace

Rgb HaloAlongRay(const Medium& medium, const Rgb& diffuse_per_m, const Glow& glow, double foot_m,
                 double offset_m, const Stretch& lit, int samples) {
  const double h_m = std::max(offset_m, glow.radius_m);
  const double phi0 = std::atan((lit.t0_m - foot_m) / h_m),
               phi1 = std::atan((lit.t1_m - foot_m) / h_m);
  const double step = (phi1 - phi0) / samples;
  if (step <= 0) return Rgb::Zero();
  Rgb sum = Rgb::Zero();
  for (int i = 0; i < samples; ++i)
    sum += HaloIntegrand(medium, diffuse_per_m, glow, h_m, phi0 + (i + 0.5) * step);
  return medium.scattering_per_m * glow.intensity_w_sr / h_m * (-diffuse_per_m * foot_m).exp() *
         sum * step;
}

HaloTable::HaloTable(const Medium& medium, const Glow& glow) {
  constexpr int kSubsteps = 4;
  const Rgb diffuse_per_m = medium.halo_loss_per_m();
  const auto phi_at = [](int j) {
    const double w = -1 + 2.0 * j / (kPlaces - 1);
    return std::abs(w) == 1 ? w * std::numbers::pi / 2 : std::atan(w / (1 - std::abs(w)));
  };
  const Rgb scale = medium.scattering_per_m * glow.intensity_w_sr;
  nodes_.reserve(kOffsets * kPlaces);
  for (int i = 0; i < kOffsets; ++i) {
    const double q = std::max(0.1, static_cast<double>(i)) / (kOffsets - 1);
    Rgb sum = Rgb::Zero();
    nodes_.push_back(Light::Zero());
    for (int j = 1; j < kPlaces; ++j) {
      const double phi0 = phi_at(j - 1), step = (phi_at(j) - phi0) / kSubsteps;
      for (int k = 0; k < kSubsteps; ++k)
        sum += step * HaloIntegrand(medium, diffuse_per_m, glow, glow.radius_m / q,
                                    phi0 + (k + 0.5) * step);
      nodes_.push_back(LightOf(scale * sum));
    }
  }
}

VeilTable::VeilTable(const Medium& medium, const std::vector<Lamp>& lamps, double port_m,
                     const MountedCamera& camera)
    : stride_px_(std::max(1, camera.width_px / kColumns)),
      columns_((camera.width_px - 1) / stride_px_ + 2),
      rows_((camera.height_px - 1) / stride_px_ + 2) {
  constexpr int kSamples = 4;
  const Rgb diffuse_per_m = medium.lighting_loss_per_m();
  const Eigen::Matrix3d R_HC = camera.X_HC.R();
  nodes_.reserve(static_cast<size_t>(rows_) * columns_ * kRanges);
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      const Eigen::Vector3d u_H =
          R_HC * camera.RayAt(column * stride_px_, row * stride_px_).normalized();
      Rgb sum = Rgb::Zero();
      double t0_m = port_m;
      for (int k = 0; k < kRanges; ++k) {
        const double t1_m = kNear_m * std::exp2(static_cast<double>(k) / kNodesPerOctave);
        for (const Lamp& lamp : lamps)
          sum +=
              VeilAlongRay(medium, diffuse_per_m, lamp, camera.X_HC.p, u_H, {t0_m, t1_m}, kSamples);
        nodes_.push_back(LightOf(sum));
        t0_m = std::max(t0_m, t1_m);
      }
    }
}

}  // namespace turbidock::light
