// What is said of images, on images painted by hand.
#include "experiments/studies/recognition/look.h"

#include <gtest/gtest.h>

namespace turbidock::recognition {
namespace {

constexpr double kDistance_m = 0.6;

// Balls painted as flat discs of their channel on an even background.
Image3u8 Painted(const MountedCamera& camera, const vision::MarkerParams& marker,
                 const std::array<int, 3>& background, int ball_dn) {
  Image3u8 image(camera.width_px, camera.height_px);
  for (size_t i = 0; i < 3 * image.pixels(); ++i)
    image.data()[i] = static_cast<uint8_t>(background[i % 3]);
  const Pose X_HM = Pose::Translation(kDistance_m, 0, 0);
  for (size_t b = 0; b < marker.balls.size(); ++b) {
    const vision::BallParams& ball = marker.balls[b];
    const vision::BallCircle circle =
        vision::ProjectBall(camera, camera.X_HC.Inverse() * (X_HM * ball.p_MQ_m), ball.radius_m);
    const int channel = std::array{1, 0, 2}[b];  // green, red, blue
    for (int v = 0; v < image.height(); ++v)
      for (int u = 0; u < image.width(); ++u)
        if (std::hypot(u - circle.u_px, v - circle.v_px) <= circle.radius_px)
          image.at(u, v)[channel] = static_cast<uint8_t>(background[channel] + ball_dn);
  }
  return image;
}

TEST(Look, MeasuresBallsAgainstWhatIsAroundThem) {
  const vision::MarkerParams marker;
  const StereoRig rig = RigParams{}.MakeRig();
  const Pose X_HM = Pose::Translation(kDistance_m, 0, 0);
  for (const MountedCamera* camera : {&rig.left, &rig.right}) {
    const Look bright = LookOf(Painted(*camera, marker, {20, 20, 20}, 70), *camera, marker, X_HM);
    EXPECT_NEAR(bright.ball_dn, 70, 1e-9);
    // a brighter background of another hue is no ball
    const Look on_white = LookOf(Painted(*camera, marker, {90, 90, 90}, 70), *camera, marker, X_HM);
    EXPECT_NEAR(on_white.ball_dn, 70, 1e-9);
    EXPECT_NEAR(LookOf(Painted(*camera, marker, {9, 9, 9}, 0), *camera, marker, X_HM).ball_dn, 0,
                1e-9);
  }
}

TEST(Look, KnowsWhiteFromColored) {
  const vision::MarkerParams marker;
  const MountedCamera camera = RigParams{}.MakeRig().left;
  const Pose X_HM = Pose::Translation(kDistance_m, 0, 0);
  const Look look = LookOf(Painted(camera, marker, {200, 180, 150}, 0), camera, marker, X_HM);
  EXPECT_NEAR(look.brightness_dn, 200, 1e-9);
  EXPECT_NEAR(look.saturation, 0.25, 1e-9);
  EXPECT_EQ(LookOf(Painted(camera, marker, {0, 0, 0}, 0), camera, marker, X_HM).saturation, 0);
}

}  // namespace
}  // namespace turbidock::recognition
