#pragma once
// The 3D marker as the search sees it: coloured balls at known places, each sampled at 60 points of
// its projection. Conventions: sim/base/frames.h.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/fields.h"
#include "sim/base/pose.h"

namespace turbidock::vision {

inline constexpr int kMaxBalls = 8;  // one bit of a label each
inline constexpr int kInnerPoints = 36;
inline constexpr int kOuterPoints = 24;
inline constexpr int kBallPoints = kInnerPoints + kOuterPoints;

// One ball of the marker.
struct BallParams {
  std::string name = "ball";
  Eigen::Vector3d p_MQ_m = Eigen::Vector3d::Zero();  // centre in the marker frame
  double radius_m = 0.02;
  double hue_rad = 0;                             // of HSV: red 0, green 2 pi / 3, blue 4 pi / 3
  std::array<double, 3> display_rgb = {1, 1, 1};  // for pictures only

  static void Fields(auto& self, auto&& field) {
    field("name", self.name, Range{}, "name of a ball of the marker");
    field("p_MQ_m", self.p_MQ_m, InRange(-1, 1),
          "centre of a ball of the marker: x, y, z in the marker's frame M");
    field("radius_m", self.radius_m, InRange(0.001, 1), "radius of a ball of the marker");
    field("hue_rad", self.hue_rad, InRange(0, 2 * std::numbers::pi),
          "hue (HSV) of a ball of the marker");
    field("display_rgb", self.display_rgb, InRange(0, 1),
          "colour that a ball of the marker is drawn in: red, green, blue");
  }
};

// The marker as a data file describes it. Balls and layout: the published marker, a 100 mm cube
// with a ball of 40 mm diameter touching three of its faces; which colour sits where, the ratio of
// the outer ring and the radii of the inner rings are not published.
struct MarkerParams {
  std::vector<BallParams> balls = {
      {"green", {-0.07, 0, 0}, 0.02, 2 * std::numbers::pi / 3, {0.1, 1, 0.1}},
      {"red", {0, 0, 0.07}, 0.02, 0, {1, 0.1, 0.1}},
      {"blue", {0, -0.07, 0}, 0.02, 4 * std::numbers::pi / 3, {0.2, 0.3, 1}}};
  // Edges of the box that carries the balls, centred on the origin with its faces across the axes;
  // it hides what is behind it. 0: no box.
  Eigen::Vector3d box_m = {0.1, 0.1, 0.1};
  std::array<double, 3> inner_ring_ratios = {1.0 / 3, 2.0 / 3, 0.95};  // rings of 6, 12, 18 points
  double outer_ring_ratio = 1.4;                                       // ring of 24 points

  static void Fields(auto& self, auto&& field) {
    field("balls", self.balls, Range{}, "balls of the marker, one to eight");
    field("box_m", self.box_m, InRange(0, 2),
          "edges of the box that carries the balls: x, y, z in the marker's frame M, centred on "
          "its origin; 0: no box");
    field("inner_ring_ratios", self.inner_ring_ratios, InRange(0, 1),
          "ratios of the radii of the rings of 6, 12 and 18 inner sample points to the ball's "
          "radius");
    field("outer_ring_ratio", self.outer_ring_ratio, InRange(1, 3),
          "ratio of the radius of the ring of 24 outer sample points to the ball's radius");
  }
  // A marker without a ball, or with more than eight, is a ConfigError.
  void Check(const std::string& path) const;
};

// The sample points of one ball relative to the projection of its centre, in units of the projected
// radius: first the inner points ring by ring, then the outer ones. Separate arrays, single
// precision: the layout a vector unit wants.
struct SamplePoints {
  alignas(64) std::array<float, kBallPoints> u{}, v{};

  explicit SamplePoints(const MarkerParams& marker);
};

// The circle that stands for a ball in an image: the projected centre and f R / z about it (the
// exact outline, an ellipse, differs by less than 2 % of the radius within 10 degrees of the
// optical axis).
struct BallCircle {
  double u_px = 0, v_px = 0;
  double radius_px = 0;
};

// Circle of a ball of that radius whose centre in the camera's optical frame is p_CQ, p_CQ.z() > 0.
inline BallCircle ProjectBall(const CameraIntrinsics& camera, const Eigen::Vector3d& p_CQ,
                              double radius_m) {
  const Eigen::Vector2d center_px = camera.Project(p_CQ);
  return {center_px.x(), center_px.y(), camera.fx_px * radius_m / p_CQ.z()};
}

// Balls whose centre is nearer to the camera's plane than this (or behind it) have no projection.
inline constexpr double kNearestDepth_m = 1e-3;

}  // namespace turbidock::vision
