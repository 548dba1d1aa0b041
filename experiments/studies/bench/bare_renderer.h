#pragma once
// MuJoCo's own pictures of the two cameras, drawn and read back as any program would: what the
// closed loop's speed is measured against. At its cheapest: one sample a pixel, no shadows.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "experiments/trial/scenario.h"
#include "sim/vehicle/scene.h"
#include "sim/view/gl_context.h"

namespace turbidock::bench {

class BareRenderer {
 public:
  // Of the scenario's scene, in a context of its own.
  explicit BareRenderer(const trial::Scenario& scenario);
  ~BareRenderer();
  BareRenderer(const BareRenderer&) = delete;
  BareRenderer& operator=(const BareRenderer&) = delete;

  // Puts the vehicle at X_WB and lists what there is to draw.
  void Place(const Pose& X_WB);
  // mjr_render and mjr_readPixels of colour and depth of both cameras.
  void Render();

  std::string description() const { return context_->description(); }

 private:
  vehicle::Scene scene_;
  std::unique_ptr<view::GlContext> context_;
  vehicle::MjDataPtr data_;
  mjvScene drawn_[2];  // left, right
  mjrContext gl_;
  mjrRect viewport_;
  std::vector<uint8_t> rgb_;
  std::vector<float> depth_;
};

}  // namespace turbidock::bench
