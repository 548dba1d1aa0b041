#include "sim/vehicle/sea.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace turbidock::vehicle {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kGravity_mps2 = 9.81;  // of the waves' dispersion relation

// Shape of the JONSWAP spectrum over x = f / f_peak; its level is set by the significant height.
double JonswapShape(double x, double gamma) {
  const double sigma = x <= 1 ? 0.07 : 0.09;
  const double enhancement = std::exp(-(x - 1) * (x - 1) / (2 * sigma * sigma));
  return std::pow(x, -5) * std::exp(-1.25 * std::pow(x, -4)) * std::pow(gamma, enhancement);
}

// All regular waves: the state's, then those spelt out.
std::vector<WaveComponent> RegularWaves(const SeaParams& params) {
  std::vector<WaveComponent> waves = params.waves;
  const auto across_the_dock = [&waves](double height_m, double period_s) {
    waves.insert(waves.begin(), {.height_m = height_m,
                                 .period_s = period_s,
                                 .direction_rad = std::numbers::pi / 2,
                                 .phase_rad = 0});
  };
  switch (params.state) {
    case SeaState::kCustom:
      break;
    case SeaState::kCalm:
      across_the_dock(0.05, 2);
      break;
    case SeaState::kModerate:
      across_the_dock(0.10, 2.5);
      break;
    case SeaState::kRough:
      across_the_dock(0.20, 3);
      break;
  }
  return waves;
}

// Held at both ends; zero without a series.
Vector3d ValueAt(const CurrentSeries& series, double time_s) {
  if (series.empty()) return Vector3d::Zero();
  const auto after = std::ranges::upper_bound(series, time_s, {}, &MeasuredCurrent::time_s);
  if (after == series.begin()) return series.front().v_W;
  const MeasuredCurrent& before = *std::prev(after);
  if (after == series.end()) return before.v_W;
  return before.v_W +
         (time_s - before.time_s) / (after->time_s - before.time_s) * (after->v_W - before.v_W);
}

}  // namespace

void CurrentParams::Check(const std::string& path) const {
  if (!file.empty() && !surface_velocity_mps.isZero(0))
    throw ConfigError(JoinKey(path, "surface_velocity_mps"),
                      "must be zero where there is a file, which is in its place");
}

Sea::Sea(const SeaParams& params, Rng rng, CurrentSeries measured)
    : params_(params), rng_(rng), first_rng_(rng), series_(std::move(measured)) {
  MakeWaves();
  Measure(0);
  const double gust_std_mps = params.current.gust_std_mps;
  if (gust_std_mps > 0) {
    gust_end_ = {gust_std_mps * rng_.Normal(), gust_std_mps * rng_.Normal()};
    gust_begin_ = gust_end_;
  }
}

void Sea::Become(const SeaParams& params) {
  const double before_mps = params_.current.gust_std_mps;
  const double scale = before_mps > 0 ? params.current.gust_std_mps / before_mps : 0;
  for (Eigen::Vector2d* gust : {&gust_begin_, &gust_end_, &gust_rate_}) *gust *= scale;
  params_ = params;
  const Rng gusts = std::exchange(rng_, first_rng_);
  MakeWaves();
  rng_ = gusts;
}

void Sea::MakeWaves() {
  waves_.clear();
  const auto add = [&](double amplitude_m, double omega_rad_s, double direction_rad,
                       double phase_rad) {
    waves_.push_back({.amplitude_m = amplitude_m,
                      .omega_rad_s = omega_rad_s,
                      .k_rad_m = omega_rad_s * omega_rad_s / kGravity_mps2,
                      .phase_rad = phase_rad,
                      .cos_direction = std::cos(direction_rad),
                      .sin_direction = std::sin(direction_rad)});
  };
  for (const WaveComponent& wave : RegularWaves(params_)) {
    const double phase_rad = params_.random_phases ? rng_.Uniform(0, kTwoPi) : wave.phase_rad;
    add(wave.height_m / 2, kTwoPi / wave.period_s, wave.direction_rad, phase_rad);
  }

  const JonswapParams& jonswap = params_.jonswap;
  if (jonswap.significant_height_m > 0) {
    // Bands of equal width hold nearly all the energy; a frequency drawn within each keeps the sum
    // from repeating itself.
    constexpr double kLow = 0.6, kHigh = 3;  // in peak frequencies
    const double band = (kHigh - kLow) / jonswap.components;
    double energy = 0;
    const size_t first = waves_.size();
    for (int i = 0; i < jonswap.components; ++i) {
      const double x = kLow + (i + rng_.Uniform()) * band;
      const double phase_rad = rng_.Uniform(0, kTwoPi);
      const double amplitude = std::sqrt(2 * JonswapShape(x, jonswap.gamma) * band);
      energy += amplitude * amplitude / 2;
      add(amplitude, x * kTwoPi / jonswap.peak_period_s, jonswap.direction_rad, phase_rad);
    }
    // m0 = sum a^2 / 2 = (Hs / 4)^2.
    const double scale = jonswap.significant_height_m / 4 / std::sqrt(energy);
    for (size_t i = first; i < waves_.size(); ++i) waves_[i].amplitude_m *= scale;
  }
}

void Sea::Measure(double time_s) { measured_ = ValueAt(series_, time_s); }

double Sea::Remaining(double z_m) const {
  const double decay_m = params_.current.decay_depth_m;
  return decay_m > 0 ? std::exp(std::min(z_m, 0.0) / decay_m) : 1.0;
}

void Sea::Step(double dt_s, double begin_s) {
  Measure(begin_s);
  // Over the step: slopes of rows that are closer would add up to another speed.
  measured_rate_ = (ValueAt(series_, begin_s + dt_s) - measured_) / dt_s;
  const CurrentParams& current = params_.current;
  drift_ += dt_s * (current.surface_velocity_mps + measured_ + dt_s / 2 * measured_rate_);
  if (current.gust_std_mps <= 0) return;
  const double kept = std::exp(-dt_s / current.gust_time_constant_s);
  const double fresh_mps = current.gust_std_mps * std::sqrt(1 - kept * kept);
  gust_begin_ = gust_end_;
  gust_end_ = {kept * gust_begin_.x() + fresh_mps * rng_.Normal(),
               kept * gust_begin_.y() + fresh_mps * rng_.Normal()};
  gust_rate_ = (gust_end_ - gust_begin_) / dt_s;
  gust_drift_ += dt_s / 2 * (gust_begin_ + gust_end_);
}

Vector3d Sea::Drift(const Vector3d& p_WQ) const {
  Vector3d drift_W = Remaining(p_WQ.z()) * drift_;
  drift_W.head<2>() += gust_drift_;
  return drift_W;
}

Vector3d Sea::Current(const Vector3d& p_WQ) const {
  Vector3d v_W = Remaining(p_WQ.z()) * (params_.current.surface_velocity_mps + measured_);
  v_W.head<2>() += gust_begin_;
  return v_W;
}

WaterMotion Sea::At(const Vector3d& p_WQ, double time_s) const {
  WaterMotion motion;
  const double z_m = std::min(p_WQ.z(), 0.0);
  motion.v_W = Current(p_WQ);
  motion.a_W = Remaining(p_WQ.z()) * measured_rate_;
  motion.a_W.head<2>() += gust_rate_;

  // Elevation a cos(theta) with theta = k s - w t + phase gives, along the direction of travel and
  // up, v = a w e^(kz) (cos, sin)(theta) and a = a w^2 e^(kz) (sin, -cos)(theta).
  for (const Wave& wave : waves_) {
    const double s_m = wave.cos_direction * p_WQ.x() + wave.sin_direction * p_WQ.y();
    const double theta = wave.k_rad_m * s_m - wave.omega_rad_s * time_s + wave.phase_rad;
    const double speed_mps = wave.amplitude_m * wave.omega_rad_s * std::exp(wave.k_rad_m * z_m);
    const double along_mps = speed_mps * std::cos(theta), up_mps = speed_mps * std::sin(theta);
    motion.v_W += Vector3d(wave.cos_direction * along_mps, wave.sin_direction * along_mps, up_mps);
    motion.a_W += wave.omega_rad_s *
                  Vector3d(wave.cos_direction * up_mps, wave.sin_direction * up_mps, -along_mps);
  }
  return motion;
}

double Sea::Elevation(const Vector3d& p_WQ, double time_s) const {
  double elevation_m = 0;
  for (const Wave& wave : waves_) {
    const double s_m = wave.cos_direction * p_WQ.x() + wave.sin_direction * p_WQ.y();
    elevation_m += wave.amplitude_m *
                   std::cos(wave.k_rad_m * s_m - wave.omega_rad_s * time_s + wave.phase_rad);
  }
  return elevation_m;
}

Vector3d Sea::TetherForce(const Vector3d& p_WQ, const Vector3d& v_WQ, double time_s) const {
  const TetherParams& tether = params_.tether;
  if (!tether.enabled) return Vector3d::Zero();
  const Vector3d chord = tether.p_WAnchor_m - p_WQ;
  const double distance_m = chord.norm();
  const Vector3d along =
      distance_m > 1e-9 ? Vector3d(chord / distance_m) : Vector3d(Vector3d::UnitX());

  // The flow across the cable, at its middle, which moves with half the vehicle's velocity.
  const Vector3d flow = At(p_WQ + chord / 2, time_s).v_W - v_WQ / 2;
  const Vector3d across = flow - along * along.dot(flow);
  const double drag_area_m2 = tether.drag_coefficient * tether.diameter_m * tether.length_m;
  const Vector3d drag = 0.5 * tether.water_density_kg_m3 * drag_area_m2 * across.norm() * across;

  Vector3d force = drag / 2;
  force.z() -= tether.net_weight_newton_per_m * tether.length_m / 2;
  if (distance_m > tether.length_m) {
    const double pull_newton = tether.stiffness_newton_per_m * (distance_m - tether.length_m) -
                               tether.stretch_damping_newton_s_per_m * along.dot(v_WQ);
    force += std::max(0.0, pull_newton) * along;  // a cable does not push
  }
  return force;
}

}  // namespace turbidock::vehicle
