// The same scene as a path tracer's (tests/data/pathtraced/README.md: multiple scattering, nothing
// shared with this project), compared in ratios between places of an image.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "experiments/media/png.h"
#include "sim/camera/image_sensor.h"
#include "sim/light/water.h"
#include "tests/light/optics_scene.h"
#include "tests/support/transfer_curve.h"

namespace turbidock::camera {
namespace {

using testing::Cast;
using testing::MarkerAndPlate;

struct Pair {
  const char* name;
  double milk_ml_m3;
  Pose X_HM;
};

Pose At(double x, double y, double z, double qw, double qx, double qy, double qz) {
  return {Eigen::Quaterniond(qw, qx, qy, qz).normalized(), {x, y, z}};
}

// True poses from active_21.json and passive_22.json.
const std::array<Pair, 4> kActive = {
    {{"active_015ml_0500mm", 15,
      At(0.5, -0.040206, 0.018977, 0.99898, 0.0070127, -0.0014084, -0.0445847)},
     {"active_015ml_0900mm", 15,
      At(0.9, 0.00061, -0.026394, 0.9995515, -0.025917, -0.0070978, 0.0132278)},
     {"active_060ml_0500mm", 60,
      At(0.5, 0.03525, -0.026775, 0.9965897, -0.0120782, -0.0249779, 0.0777128)},
     {"active_060ml_0900mm", 60,
      At(0.9, -0.055912, -0.017107, 0.9972793, 0.001299, -0.0200733, 0.0709178)}}};
const std::array<Pair, 4> kPassive = {
    {{"passive_005ml_0500mm", 5,
      At(0.5, 0.054985, -0.035963, 0.9981516, -0.0236078, 0.0273012, -0.0488945)},
     {"passive_005ml_0900mm", 5,
      At(0.9, 0.035109, -0.042034, 0.9968761, -0.0102823, -0.0244123, 0.0744065)},
     {"passive_020ml_0500mm", 20,
      At(0.5, 0.024974, -0.045156, 0.9993448, 0.0200974, 0.0040924, -0.029821)},
     {"passive_020ml_0900mm", 20,
      At(0.9, 0.041977, 0.008282, 0.997036, 0.0218306, 0.0159618, 0.072026)}}};

Image3u8 LoadLeft(const std::string& name) {
  return media::ReadPng(TURBIDOCK_TEST_DATA "/pathtraced/" + name + "_left.png");
}

// The scene here: same optics, camera, curve and noise. `full_scale` is the path tracer's image
// gain.
struct Ours {
  Ours(const Pair& pair, bool active, double full_scale)
      : rig(RigParams{}.MakeRig()), surfaces(MarkerAndPlate(pair.X_HM)), seen(Cast(surfaces, rig)) {
    light::OpticsParams params;
    params.water.milk_ml_m3 = pair.milk_ml_m3;
    params.water.milk_scattering_m2_ml = {0.0182, 0.0204, 0.0224};
    params.water.milk_asymmetry.setConstant(0.71);
    params.ball_lights.enabled = active;
    params.ball_lights.rim_radiance_w_m2_sr = 0.6;
    params.ball_lights.core_radiance_w_m2_sr = 0;
    params.lamps.enabled = !active;
    params.lamps.beam = light::BeamShape::kCone;
    params.lamps.intensity_w_sr = {1, 1, 1};
    light::Water water(params, rig, light::SurfaceTable(surfaces), testing::LampsAt(0.16));
    light::RadianceStereo radiance;
    water.Apply(seen, &radiance);
    SensorParams camera;
    camera.full_scale_radiance_w_m2_sr = full_scale;
    StereoImage image;
    ImageSensor(camera, 1, 2).Digitise(radiance, 0, &image);
    left = image.left;
  }

  StereoRig rig;
  std::vector<light::Surface> surfaces;
  view::RenderedStereo seen;
  Image3u8 left;
};

double Linear(uint8_t dn) { return testing::Decode(SensorParams{}, dn / 255.0); }

bool ShowsBall(const Ours& ours, int u, int v) {
  const int id = *ours.seen.left.surface.at(u, v);
  return id > 0 && ours.surfaces[id - 1].shape == light::Shape::kSphere;
}

struct Zone {
  double from, to;  // distance from the ball's centre, in its radii
  bool on_ball;     // this ball's own pixels, or those that show no ball at all
};
constexpr Zone kDisc = {0, 0.8, true};
constexpr std::array<Zone, 3> kRings = {{{1.2, 1.4, false}, {1.9, 2.1, false}, {3.4, 3.6, false}}};

// Mean linear value of a channel around a ball.
double MeanAround(const Ours& ours, const Image3u8& image, int ball, int channel,
                  const Zone& zone) {
  const light::Surface& surface = ours.surfaces[ball];
  const Eigen::Vector3d p_LQ = ours.rig.left.X_HC.Inverse() * surface.X_AS.p;
  const Eigen::Vector2d center_px = ours.rig.left.Project(p_LQ);
  const double radius_px = ours.rig.left.fx_px * surface.size_m[0] / p_LQ.z();
  double sum = 0;
  int count = 0;
  for (int v = 0; v < image.height(); ++v)
    for (int u = 0; u < image.width(); ++u) {
      const double r = std::hypot(u - center_px.x(), v - center_px.y()) / radius_px;
      if (r < zone.from || r > zone.to) continue;
      if (zone.on_ball ? *ours.seen.left.surface.at(u, v) != ball + 1 : ShowsBall(ours, u, v))
        continue;
      sum += Linear(image.at(u, v)[channel]);
      ++count;
    }
  EXPECT_GT(count, 50);
  return sum / count;
}

// green, red, blue: the surfaces' order in MarkerAndPlate
constexpr std::array<std::pair<int, int>, 3> kBallAndChannel = {{{1, 1}, {2, 0}, {3, 2}}};

// Balls themselves: within 2.5 % measured (what is scattered into them is small).
TEST(PathTraced, LitBallsAreAsBright) {
  for (const Pair& pair : kActive) {
    const Ours ours(pair, true, 1);
    const Image3u8 theirs = LoadLeft(pair.name);
    for (const auto& [ball, channel] : kBallAndChannel)
      EXPECT_NEAR(MeanAround(ours, ours.left, ball, channel, kDisc) /
                      MeanAround(ours, theirs, ball, channel, kDisc),
                  1, 0.05)
          << pair.name << " " << ours.surfaces[ball].name;
  }
}

// Halo over ball at 1.3, 2 and 3.5 radii. Measured 0.73 to 1.20 of the path tracer's; the darkest
// are the furthest rings of the green ball, which the box behind it also lights.
TEST(PathTraced, HalosAreAsBright) {
  int compared = 0;
  for (const Pair& pair : kActive) {
    const Ours ours(pair, true, 1);
    const Image3u8 theirs = LoadLeft(pair.name);
    for (const auto& [ball, channel] : kBallAndChannel)
      for (const Zone& ring : kRings) {
        const double here = MeanAround(ours, ours.left, ball, channel, ring) /
                            MeanAround(ours, ours.left, ball, channel, kDisc);
        const double there = MeanAround(ours, theirs, ball, channel, ring) /
                             MeanAround(ours, theirs, ball, channel, kDisc);
        EXPECT_NEAR(here / there, 1, 0.3) << pair.name << " " << ours.surfaces[ball].name << " "
                                          << ring.from << ": " << here << " " << there;
        ++compared;
      }
  }
  EXPECT_EQ(compared, 36);
}

// Lamp-lit: surroundings over ball at the same places, and the veil where nothing else is seen,
// over the green ball. Measured 0.92 to 1.06. The veil is 0.95 to 1.30: before open water the model
// is brighter than these images, whose light scatters six times at most; before the marker it is
// not (photon_walk_oracle_test.cc).
TEST(PathTraced, LampLitSceneAndVeilAreAsBright) {
  int veils = 0;
  for (const Pair& pair : kPassive) {
    // any gain will do, for these ratios; none clips
    const Ours ours(pair, false, pair.X_HM.p.x() < 0.7 ? 2.0 : 0.5);
    const Image3u8 theirs = LoadLeft(pair.name);
    for (const auto& [ball, channel] : kBallAndChannel)
      for (const Zone& ring : kRings) {
        const double here = MeanAround(ours, ours.left, ball, channel, ring) /
                            MeanAround(ours, ours.left, ball, channel, kDisc);
        const double there = MeanAround(ours, theirs, ball, channel, ring) /
                             MeanAround(ours, theirs, ball, channel, kDisc);
        EXPECT_NEAR(here / there, 1, 0.12)
            << pair.name << " " << ours.surfaces[ball].name << " " << ring.from;
      }
    for (const auto& [u0, v0] : {std::pair{10, 10}, {310, 10}, {610, 10}, {10, 450}}) {
      double here = 0, there = 0;
      bool empty = true;
      for (int v = v0; v < v0 + 20; ++v)
        for (int u = u0; u < u0 + 20; ++u) {
          empty = empty && *ours.seen.left.surface.at(u, v) == 0;
          here += Linear(ours.left.at(u, v)[1]) / 400;
          there += Linear(theirs.at(u, v)[1]) / 400;
        }
      if (!empty) continue;
      ++veils;
      EXPECT_NEAR(here / MeanAround(ours, ours.left, 1, 1, kDisc) /
                      (there / MeanAround(ours, theirs, 1, 1, kDisc)),
                  1.15, 0.22)
          << pair.name << " " << u0 << " " << v0;
    }
  }
  EXPECT_GE(veils, 12);
}

}  // namespace
}  // namespace turbidock::camera
