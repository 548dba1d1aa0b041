#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/base/units.h"
#include "tests/support/paint_marker.h"
#include "vision/refiner.h"

namespace turbidock::vision {
namespace {

const StereoRegion kWhole{{0, 0, 640, 480}, {0, 0, 640, 480}};
const StereoRig kRig = RigParams{}.MakeRig();
// The painted discs do not hide each other here, and the box would not be painted.
const Pose kTrue = Pose::FromVectorPart({0.6, 0.02, -0.03}, {0.01, -0.02, 0.05});

MarkerParams Marker() {
  MarkerParams marker;
  marker.box_m.setZero();
  return marker;
}

StereoImage Painted(double noise_dn, Rng* rng, const Pose& X_HM = kTrue) {
  return testing::PaintMarker(Marker(), kRig, X_HM, {.noise_dn = noise_dn}, rng);
}

TEST(PoseRefiner, ComesBackFromWhereASearchMayEnd) {
  Rng rng = SeedTree(1).Stream("starts");
  PoseRefiner refiner(Marker(), kRig);
  for (const double distance_m : {0.4, 0.6, 1.0, 1.4}) {
    Pose X_true = kTrue;
    X_true.p.x() = distance_m;
    const StereoImage seen = Painted(1.5, &rng, X_true);
    for (int i = 0; i < 20; ++i) {
      Pose X_HM = X_true;
      X_HM.p.x() *= 1 + 0.03 * (2 * rng.Uniform() - 1);
      X_HM.p.y() += 0.003 * (2 * rng.Uniform() - 1);
      X_HM.p.z() += 0.003 * (2 * rng.Uniform() - 1);
      X_HM.q =
          X_HM.q * FromYawPitchRoll(0.05 * (2 * rng.Uniform() - 1), 0.05 * (2 * rng.Uniform() - 1),
                                    0.05 * (2 * rng.Uniform() - 1));
      const auto refined = refiner.Refine(seen, kWhole, X_HM);
      ASSERT_TRUE(refined) << distance_m;
      // Painted discs are circles about the centre's projection; a sphere's outline is an ellipse
      // beside it, by up to half a pixel at 0.4 m: 0.4 mm sideways and 1 mm in depth. Noise adds
      // with the square of the distance.
      EXPECT_LT((refined->X_HM.p - X_true.p).norm(), 0.0012 + 0.0035 * distance_m * distance_m)
          << distance_m << ' ' << i;
      EXPECT_LT(units::DegFromRad(AngleBetween(refined->X_HM.q, X_true.q)), 0.9) << distance_m;
    }
  }
}

TEST(PoseRefiner, SaysWhichCameraSupportsAPose) {
  Rng rng = SeedTree(7).Stream("noise");
  PoseRefiner refiner(Marker(), kRig);
  StereoImage seen = Painted(1.5, &rng);
  for (const Side blind : kSides) {
    StereoImage one = seen;
    std::fill_n(one[blind].data(), 3 * one[blind].pixels(), uint8_t{8});
    const auto refined = refiner.Refine(one, kWhole, kTrue);
    ASSERT_TRUE(refined);
    const Side seeing = blind == Side::kLeft ? Side::kRight : Side::kLeft;
    EXPECT_EQ(refined->camera_support[blind], 0);
    EXPECT_GT(refined->camera_support[seeing], 0.9);
    for (int b = 0; b < 3; ++b) EXPECT_NEAR(refined->support[b], 0.5, 0.06) << b;
  }
  const auto refined = refiner.Refine(seen, kWhole, kTrue);
  ASSERT_TRUE(refined);
  EXPECT_GT(std::min(refined->camera_support.left, refined->camera_support.right), 0.9);
}

TEST(PoseRefiner, DepthDoesNotRestOnHowLargeTheBallsLook) {
  // Balls that look a tenth larger in both images, as blooming makes them.
  MarkerParams bloomed = Marker();
  for (BallParams& ball : bloomed.balls) ball.radius_m *= 1.06;
  Rng rng = SeedTree(2).Stream("noise");
  const StereoImage seen = testing::PaintMarker(bloomed, kRig, kTrue, {.noise_dn = 1}, &rng);
  PoseRefiner refiner(Marker(), kRig);
  const auto refined = refiner.Refine(seen, kWhole, kTrue);
  ASSERT_TRUE(refined);
  EXPECT_LT(std::abs(refined->X_HM.p.x() - kTrue.p.x()), 0.002);  // by size: 0.034
  EXPECT_NEAR(refined->bloom_px, 0.06 * 0.02 * kRig.left.fx_px / 0.6, 0.3);
}

// Of a dim ball a camera keeps less colour: it looks smaller than the others do.
TEST(PoseRefiner, BallsMayDifferInHowLargeTheyLook) {
  const Pose far{kTrue.q, {1.4, 0.05, 0.05}};
  MarkerParams dim = Marker();
  dim.balls[1].radius_m -= 0.8 * 1.4 / kRig.left.fx_px;
  Rng rng = SeedTree(9).Stream("noise");
  PoseRefiner refiner(Marker(), kRig);
  const auto refined =
      refiner.Refine(testing::PaintMarker(dim, kRig, far, {.noise_dn = 1}, &rng), kWhole, far);
  ASSERT_TRUE(refined);
  EXPECT_GT(refined->support[1], 0.9);
  EXPECT_LT(AngleBetween(refined->X_HM.q, far.q), units::RadFromDeg(0.5));
}

// Video keeps less colour along a line: there the ball is narrower, and across the lines it is not.
TEST(PoseRefiner, ABallMayBeNarrowerAlongTheLinesOnly) {
  constexpr double kNarrower_px = 1.2;
  const Pose far{kTrue.q, {1.4, 0.05, 0.05}};
  Rng rng = SeedTree(11).Stream("noise");
  const StereoImage plain = testing::PaintMarker(Marker(), kRig, far, {.noise_dn = 1}, &rng);
  StereoImage seen = plain;
  const BallParams& red = Marker().balls[1];
  const double radius_px = kRig.left.fx_px * red.radius_m / 1.4;
  for (const Side side : kSides) {
    const MountedCamera& camera = kRig[side];
    const Eigen::Vector2d middle = camera.Project(camera.X_HC.Inverse() * (far * red.p_MQ_m));
    for (int v = static_cast<int>(middle.y()) - 12; v < middle.y() + 12; ++v)
      for (int u = static_cast<int>(middle.x()) - 12; u < middle.x() + 12; ++u) {
        const double from_px =
            middle.x() + (u - middle.x()) * radius_px / (radius_px - kNarrower_px);
        const int left_px = static_cast<int>(std::floor(from_px));
        const double share = from_px - left_px;
        for (int k = 0; k < 3; ++k)
          seen[side].at(u, v)[k] =
              static_cast<uint8_t>(std::lround((1 - share) * plain[side].at(left_px, v)[k] +
                                               share * plain[side].at(left_px + 1, v)[k]));
      }
  }
  PoseRefiner refiner(Marker(), kRig);
  const auto refined = refiner.Refine(seen, kWhole, far);
  ASSERT_TRUE(refined);
  EXPECT_GT(refined->support[1], 0.9);
}

// Tukey's weights: what is off by most of what is still believed pulls less than what is off by
// half of it. Least squares would let it pull more.
TEST(PoseRefiner, BelievesOutliersTheLessTheFartherTheyAreOff) {
  PoseRefiner refiner(Marker(), kRig);
  const StereoImage plain = Painted(0, nullptr);
  const auto without = refiner.Refine(plain, kWhole, kTrue);
  ASSERT_TRUE(without);
  // The right half of the blue ball's outline lies farther out.
  const auto pull_m = [&](double out_px) {
    const double scale_px = kRig.left.fx_px / 0.6;
    MarkerParams swollen = Marker();
    swollen.balls[2].radius_m += out_px / scale_px;
    StereoImage seen = plain;
    const StereoImage larger = testing::PaintMarker(swollen, kRig, kTrue, {}, nullptr);
    for (const Side side : kSides) {
      const MountedCamera& camera = kRig[side];
      const double u_px =
          camera.Project(camera.X_HC.Inverse() * (kTrue * swollen.balls[2].p_MQ_m)).x();
      for (int v = 0; v < 480; ++v)
        for (int u = static_cast<int>(u_px); u < 640; ++u)
          for (int k = 0; k < 3; ++k) seen[side].at(u, v)[k] = larger[side].at(u, v)[k];
    }
    const auto refined = refiner.Refine(seen, kWhole, kTrue);
    EXPECT_TRUE(refined);
    return (refined->X_HM.p - without->X_HM.p).norm();
  };
  // The painted discs' own errors make the limit 1.3 px or so.
  EXPECT_LT(pull_m(1.5), 0.1 * pull_m(0.5));
  EXPECT_LT(pull_m(3), 0.1 * pull_m(0.5));
}

TEST(PoseRefiner, SaysHowFarItIsOff) {
  Rng rng = SeedTree(3).Stream("noise");
  PoseRefiner refiner(Marker(), kRig);
  Eigen::Vector3d claimed2 = Eigen::Vector3d::Zero(), found2 = claimed2, mean = claimed2;
  constexpr int kRuns = 60;
  for (int i = 0; i < kRuns; ++i) {
    // Places between pixels differ, and so does what discs and their sampling add.
    Pose X_HM = kTrue;
    for (int k = 0; k < 3; ++k) X_HM.p[k] += rng.Uniform(-0.01, 0.01);
    const auto refined = refiner.Refine(Painted(6, &rng, X_HM), kWhole, X_HM);
    ASSERT_TRUE(refined);
    const Eigen::Vector3d error = refined->X_HM.p - X_HM.p;
    mean += error / kRuns;
    found2 += error.cwiseAbs2() / kRuns;
    claimed2 += refined->covariance.diagonal().head<3>() / kRuns;
  }
  // The discs add 1 mm of depth wherever they are, which no estimator can know.
  const Eigen::Vector3d scatter2 = found2 - mean.cwiseAbs2();
  for (int k = 0; k < 3; ++k) {
    EXPECT_GT(std::sqrt(claimed2[k] / scatter2[k]), 0.4) << k;
    EXPECT_LT(std::sqrt(claimed2[k] / found2[k]), 4) << k;
  }
}

// The mean of all channels over a square about each pixel.
Image3u8 Blurred(int reach_px, const Image3u8& image) {
  Image3u8 blurred = image;
  for (int v = reach_px; v < image.height() - reach_px; ++v)
    for (int u = reach_px; u < image.width() - reach_px; ++u)
      for (int k = 0; k < 3; ++k) {
        int sum = 0;
        for (int y = v - reach_px; y <= v + reach_px; ++y)
          for (int x = u - reach_px; x <= u + reach_px; ++x) sum += image.at(x, y)[k];
        blurred.at(u, v)[k] = static_cast<uint8_t>(sum / ((2 * reach_px + 1) * (2 * reach_px + 1)));
      }
  return blurred;
}

// The colour of one image with the brightness of another.
Image3u8 Coloured(const Image3u8& colour, const Image3u8& brightness) {
  Image3u8 image = brightness;
  const auto of = [](const uint8_t* rgb) {
    return 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2];
  };
  for (int v = 0; v < image.height(); ++v)
    for (int u = 0; u < image.width(); ++u) {
      const double more = of(brightness.at(u, v)) - of(colour.at(u, v));
      for (int k = 0; k < 3; ++k)
        image.at(u, v)[k] =
            static_cast<uint8_t>(std::clamp(std::lround(colour.at(u, v)[k] + more), 0L, 255L));
    }
  return image;
}

// Compression that keeps colour coarser than brightness moves outlines as a whole, and sharp
// brightness beside wide edges of colour tells of it. Where both are as wide it is blur, which
// moves nothing.
TEST(PoseRefiner, ClaimsLessWhereColourIsCoarserThanBrightness) {
  Rng rng = SeedTree(5).Stream("colour");
  PoseRefiner refiner(Marker(), kRig);
  for (int i = 0; i < 4; ++i) {
    Pose X_HM = kTrue;
    for (int k = 0; k < 3; ++k) X_HM.p[k] += rng.Uniform(-0.02, 0.02);
    const StereoImage plain = Painted(2, &rng, X_HM);
    StereoImage coarse, blurred;
    for (const Side side : kSides) {
      blurred[side] = Blurred(2, plain[side]);
      coarse[side] = Coloured(blurred[side], plain[side]);
    }
    const auto variance = [&](const StereoImage& seen) {
      const auto refined = refiner.Refine(seen, kWhole, X_HM);
      return refined ? refined->covariance.topLeftCorner<3, 3>().trace() : 0;
    };
    EXPECT_GT(variance(coarse), 1.5 * variance(blurred)) << i;
    EXPECT_GT(variance(blurred), variance(plain)) << i;
  }
}

TEST(PoseRefiner, FindsNothingWhereNothingIs) {
  PoseRefiner refiner(Marker(), kRig);
  const StereoImage blank{{Image3u8(640, 480, 30), Image3u8(640, 480, 30)}};
  EXPECT_FALSE(refiner.Refine(blank, kWhole, kTrue));
  // Nor behind the cameras or off the images.
  const StereoImage seen = Painted(0, nullptr);
  EXPECT_FALSE(refiner.Refine(seen, kWhole, Pose::Translation(-0.6, 0, 0)));
  EXPECT_FALSE(refiner.Refine(seen, kWhole, Pose::Translation(0.6, 5, 0)));
  EXPECT_FALSE(refiner.Refine(seen, {{0, 0, 0, 0}, {0, 0, 0, 0}}, kTrue));
}

TEST(PoseRefiner, ABallBehindAnotherOrBehindTheBoxLosesItsHiddenEdges) {
  // Seen along x, the second ball is half behind the first; the third is beside a box.
  MarkerParams marker = Marker();
  marker.balls[0].p_MQ_m = {-0.1, 0, 0};
  marker.balls[1].p_MQ_m = {0.05, 0.015, 0};
  marker.balls[2].p_MQ_m = {0, -0.09, 0.05};
  const Pose X_HM = Pose::Translation(0.7, 0, 0);
  const StereoImage seen = testing::PaintMarker(marker, kRig, X_HM, {}, nullptr);
  PoseRefiner plain(marker, kRig);
  const auto without_box = plain.Refine(seen, kWhole, X_HM);
  ASSERT_TRUE(without_box);
  EXPECT_LT(without_box->edges, 6 * 32 - 20);  // of ball 1
  EXPECT_LT((without_box->X_HM.p - X_HM.p).norm(), 0.003);
  marker.box_m = {0.02, 0.16, 0.06};  // in front of half of ball 2, and of ball 1
  PoseRefiner boxed(marker, kRig);
  const auto with_box = boxed.Refine(seen, kWhole, X_HM);
  ASSERT_TRUE(with_box);
  EXPECT_LT(with_box->edges, without_box->edges - 20);
}

// Nothing stands in front of ball 1 in the image, but the model says that ball 0 does: what it
// hides is not looked for, though it is there.
TEST(PoseRefiner, DoesNotLookForEdgesBehindAnotherBall) {
  MarkerParams marker = Marker();
  marker.balls[0].p_MQ_m = {-0.1, 0.15, 0};
  marker.balls[1].p_MQ_m = {0.05, 0.015, 0};
  marker.balls[2].p_MQ_m = {0, -0.09, 0.05};
  const Pose X_HM = Pose::Translation(0.7, 0, 0);
  const StereoImage seen = testing::PaintMarker(marker, kRig, X_HM, {}, nullptr);
  const auto beside = PoseRefiner(marker, kRig).Refine(seen, kWhole, X_HM);
  marker.balls[0].p_MQ_m = {-0.1, 0, 0};
  const auto in_front = PoseRefiner(marker, kRig).Refine(seen, kWhole, X_HM);
  ASSERT_TRUE(beside && in_front);
  EXPECT_GT(beside->edges, 6 * 32 - 12);
  EXPECT_LT(in_front->edges, 4 * 32 - 20);  // balls 1 and 2 without what is hidden of 1
}

TEST(PoseRefiner, NeedsTwelveEdges) {
  PoseRefiner refiner(Marker(), kRig);
  const StereoImage seen = Painted(0, nullptr);
  int fewest = 1000, refused = 0;
  for (int column = 150; column < 480; ++column) {
    const StereoRegion part{{column, 0, 640, 480}, {column, 0, 640, 480}};
    const auto refined = refiner.Refine(seen, part, kTrue);
    if (refined) fewest = std::min(fewest, refined->edges);
    refused += !refined;
  }
  EXPECT_EQ(fewest, 12);
  EXPECT_GT(refused, 20);
}

TEST(PoseRefiner, ReadsItsRegionOnly) {
  Rng rng = SeedTree(4).Stream("noise");
  const StereoImage seen = Painted(2, &rng);
  const StereoRegion part{{230, 150, 420, 300}, {150, 140, 330, 300}};
  StereoImage spoilt = seen;
  for (auto& [image, region] : {std::pair{&spoilt.left, part.left}, {&spoilt.right, part.right}})
    for (int v = 0; v < 480; ++v)
      for (int u = 0; u < 640; ++u)
        if (!region.Contains(u, v)) image->at(u, v)[rng.Below(3)] = 255;
  PoseRefiner refiner(Marker(), kRig);
  const auto a = refiner.Refine(seen, part, kTrue), b = refiner.Refine(spoilt, part, kTrue);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->X_HM.p, b->X_HM.p);
  EXPECT_EQ(a->X_HM.q.coeffs(), b->X_HM.q.coeffs());
}

}  // namespace
}  // namespace turbidock::vision
