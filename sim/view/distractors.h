#pragma once
// Things that come into the cameras' view and are no part of the model: they are seen, lit and hide
// what is behind them, but nothing touches them, they cast no shadow, and the outside view for
// people does not show them.
//
// All of them are balls and boxes. In pictures of surfaces a distractor's number follows those of
// the model's geoms.

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/base/fault.h"
#include "sim/base/pose.h"
#include "sim/vehicle/scene.h"
#include "sim/view/rendered.h"

namespace turbidock::view {

// A plate before the marker, upright and square to it.
struct ScreenFault : FaultSpan {
  // hides what is right of the marker's middle: the blue ball and half of the others
  Eigen::Vector3d p_MQ_m{-0.12, -0.15, 0};
  Eigen::Vector3d size_m{0.004, 0.3, 0.4};
  Eigen::Vector3d albedo{0.1, 0.1, 0.1};

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("p_MQ_m", self.p_MQ_m, InRange(-10, 10),
          "middle of the plate that hides the marker: x, y, z in the marker's frame M");
    field("size_m", self.size_m, InRange(0.0001, 10),
          "edges of the plate that hides the marker: x, y, z in the marker's frame M");
    field("albedo", self.albedo, InRange(0, 1),
          "share of light that the plate throws back: red, green, blue");
  }
};

// Something round that swims by, as large as one of the balls.
struct FishFault : FaultSpan {
  Eigen::Vector3d p_MQ_m{-0.25, 0.4, 0.03};
  Eigen::Vector3d velocity_mps{0, -0.05, 0};
  double radius_m = 0.02;
  Eigen::Vector3d albedo{0.5, 0.015, 0.015};
  std::string shines_as;

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("p_MQ_m", self.p_MQ_m, InRange(-10, 10),
          "point where the fish begins: x, y, z in the marker's frame M");
    field("velocity_mps", self.velocity_mps, InRange(-10, 10),
          "velocity of the fish: x, y, z in the marker's frame M");
    field("radius_m", self.radius_m, InRange(0.001, 1), "radius of the fish");
    field("albedo", self.albedo, InRange(0, 1),
          "share of light that the fish throws back: red, green, blue");
    field("shines_as", self.shines_as, Finite(), "ball whose light the fish has; empty: none");
  }
};

// The same marker once more, turned as the first.
struct SecondMarkerFault : FaultSpan {
  Eigen::Vector3d p_MQ_m{0, 0.35, 0};

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("p_MQ_m", self.p_MQ_m, InRange(-10, 10),
          "place of the second marker: x, y, z in the marker's frame M");
  }
};

// The marker's image in the surface of the water, which reflects all light that comes from far
// enough aside. Of the water's own level nothing else follows.
struct MirrorFault : FaultSpan {
  double surface_above_m = 0.2;

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("surface_above_m", self.surface_above_m, InRange(0.05, 10),
          "height of the water's surface above the marker's middle");
  }
};

// A column of air bubbles that rise, without end.
struct BubblesFault : FaultSpan {
  int count = 60;
  double radius_m = 0.004;
  double rise_mps = 0.25;  // of bubbles of some millimetres (Clift, Grace & Weber 1978)
  Eigen::Vector3d p_MQ_m{-0.25, 0, 0};
  Eigen::Vector3d size_m{0.1, 0.5, 0.6};
  double albedo = 0.7;

  static void Fields(auto& self, auto&& field) {
    FaultSpan::Fields(self, field);
    field("count", self.count, InRange(1, 2000), "number of air bubbles at a time");
    field("radius_m", self.radius_m, InRange(0.0005, 0.1), "radius of an air bubble");
    field("rise_mps", self.rise_mps, InRange(0, 2), "speed at which the air bubbles rise");
    field("p_MQ_m", self.p_MQ_m, InRange(-10, 10),
          "middle of the column of bubbles: x, y, z in the marker's frame M");
    field("size_m", self.size_m, InRange(0.01, 10),
          "edges of the column of bubbles: x, y, z in the marker's frame M");
    field("albedo", self.albedo, InRange(0, 1), "share of light that the bubbles throw back");
  }
};

struct DistractorFaults {
  std::vector<ScreenFault> screens;
  std::vector<FishFault> fish;
  std::vector<SecondMarkerFault> second_markers;
  std::vector<MirrorFault> mirrors;
  std::vector<BubblesFault> bubbles;

  bool any() const {
    return !screens.empty() || !fish.empty() || !second_markers.empty() || !mirrors.empty() ||
           !bubbles.empty();
  }
  static void Fields(auto& self, auto&& field) {
    field("screens", self.screens, Finite(), "plates that hide a part of the marker");
    field("fish", self.fish, Finite(), "red things that swim by");
    field("second_markers", self.second_markers, Finite(), "markers beside the true one");
    field("mirrors", self.mirrors, Finite(), "the marker's image in the water's surface");
    field("bubbles", self.bubbles, Finite(), "air bubbles that rise before the marker");
  }
};

// A ball or a box, and how it moves while it is there.
struct Distractor {
  std::string name;
  FaultSpan span;
  bool ball = true;
  Eigen::Vector3d half_size_m = Eigen::Vector3d::Zero();  // of a ball: its radius, three times
  Eigen::Vector3d albedo = Eigen::Vector3d::Zero();
  std::string shines_as{};  // the ball whose light it has; empty: none
  Pose X_WV{};              // when it begins
  Eigen::Vector3d v_W_mps = Eigen::Vector3d::Zero();
  // what rises beyond the height `wrap_top_m` in W begins anew so much below; 0: it does not
  double wrap_m = 0, wrap_top_m = 0;

  PlacedDistractor At(double time_s) const;
};

// What all of these faults bring. Places of bubbles are drawn from the key. ConfigError for a
// marker that is not made of balls and boxes.
std::vector<Distractor> DistractorsOf(const DistractorFaults& faults, const vehicle::Scene& scene,
                                      uint64_t key);

}  // namespace turbidock::view
