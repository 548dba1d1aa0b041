#pragma once
// MuJoCo's own pictures of the two cameras, drawn and read back as any program would: what the
// closed loop's speed is measured against.

#include <cstdint>
#include <vector>

#include "sim/vehicle/scene.h"
#include "sim/view/gl_context.h"

namespace turbidock::bench {

class BareRenderer {
 public:
  using Quality = decltype(mjVisual::quality);

  // Keeps references to the context and the scene, which must outlive it.
  BareRenderer(view::GlContext& context, const vehicle::Scene& scene, const Quality& quality);
  ~BareRenderer();
  BareRenderer(const BareRenderer&) = delete;
  BareRenderer& operator=(const BareRenderer&) = delete;

  // Puts the vehicle at X_WB and lists what there is to draw.
  void Place(const Pose& X_WB);
  // mjr_render and mjr_readPixels of colour and depth of both cameras.
  void Render();

  const std::vector<uint8_t>& rgb() const { return rgb_; }  // of the right camera, lowest row first

 private:
  view::GlContext& context_;
  const vehicle::Scene& scene_;
  vehicle::MjDataPtr data_;
  mjvScene drawn_[2];  // left, right
  mjrContext gl_;
  mjrRect viewport_;
  std::vector<uint8_t> rgb_;
  std::vector<float> depth_;
};

}  // namespace turbidock::bench
