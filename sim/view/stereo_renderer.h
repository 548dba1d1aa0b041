#pragma once
// Pictures of a scene by OpenGL: what the two cameras see (surface and depth, no light) and a lit
// view for people. A renderer keeps references to the GL context and the scene, which must outlive
// it; any number of renderers may share a context. All run in the context's thread.

#include <mujoco/mujoco.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "sim/base/image.h"
#include "sim/base/stage_timer.h"
#include "sim/vehicle/scene.h"
#include "sim/view/distractors.h"
#include "sim/view/gl_context.h"
#include "sim/view/rendered.h"
#include "sim/view/surface_canvas.h"
#include "sim/view/surface_list.h"

namespace turbidock::view {

// What the stereo rig's cameras see: which geom at each pixel, and how far.
class StereoRenderer {
 public:
  // The distractors' shapes; they are absent until they are placed.
  StereoRenderer(GlContext& context, const vehicle::Scene& scene,
                 const std::vector<Distractor>& distractors = {});

  // Where distractors are in the next pictures, in their order.
  void Place(std::vector<PlacedDistractor> distractors) { placed_ = std::move(distractors); }

  // Draws both views at the computed positions in `data` (after mj_forward or a step's position
  // stage). The images in `out` keep their memory from one frame to the next. A timer gets kRender
  // and kReadBack, and with it OpenGL ends its work where it would else put it off to the
  // read-back.
  void Render(const mjData& data, RenderedStereo* out, StageTimer* timer = nullptr);
  // The same for a region only; other pixels of `out` stay as they are.
  void Render(const mjData& data, const StereoRegion& region, RenderedStereo* out,
              StageTimer* timer = nullptr);

 private:
  void Read(Side side, const PixelRegion& region, RenderedView* out);

  const vehicle::Scene& scene_;
  float near_m_;
  SurfaceLister lister_;
  SurfaceCanvas canvas_;
  std::vector<PlacedDistractor> placed_;
  Stereo<SurfaceList> lists_;
};

// A lit, antialiased picture with MuJoCo's own lights, textures and fog: for videos, not for
// vision.
class SpectatorRenderer {
 public:
  SpectatorRenderer(GlContext& context, const vehicle::Scene& scene, int width_px, int height_px);
  ~SpectatorRenderer();
  SpectatorRenderer(const SpectatorRenderer&) = delete;
  SpectatorRenderer& operator=(const SpectatorRenderer&) = delete;

  // Draws what `camera` (a MuJoCo camera id, such as scene.spectator_camera) sees from so much
  // farther back; what is nearer to it than `cut_m`, such as a wall, is cut away.
  void Render(const mjData& data, int camera, Image3u8* out, double back_m = 0, double cut_m = 0);

 private:
  GlContext& context_;
  const mjModel& model_;
  mjvOption option_;
  mjvScene scene_;
  mjrContext gl_;  // with an offscreen buffer
  mjrRect viewport_;
  std::vector<uint8_t> rgb_;
};

}  // namespace turbidock::view
