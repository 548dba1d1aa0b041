#pragma once
// MuJoCo's own pictures of a scene, to compare and to race with.

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cstdint>

#include "sim/vehicle/scene.h"
#include "sim/view/gl_context.h"

namespace turbidock::testing {

// MuJoCo's list of things to draw and its GL objects, with an offscreen buffer of a fixed size.
class GlCanvas {
 public:
  using Quality = decltype(mjVisual::quality);  // samples per pixel, shadow map, facets

  GlCanvas(view::GlContext& context, const mjModel& model, int width_px, int height_px,
           const Quality& quality)
      : context_(context), model_(model), viewport_{0, 0, width_px, height_px} {
    constexpr int kHiddenGroup = 3;  // geoms that take part in contacts only
    context_.MakeCurrent();
    mjv_defaultOption(&option_);
    std::fill_n(option_.geomgroup, mjNGROUP, mjtByte{1});
    option_.geomgroup[kHiddenGroup] = 0;
    std::fill_n(option_.sitegroup, mjNGROUP, mjtByte{0});
    std::fill_n(option_.actuatorgroup, mjNGROUP, mjtByte{0});
    mjv_defaultScene(&scene_);
    mjv_makeScene(&model_, &scene_, model_.ngeom + model_.nsite + 16);
    const vehicle::MjModelPtr sized(mj_copyModel(nullptr, &model_));
    sized->vis.global.offwidth = width_px;
    sized->vis.global.offheight = height_px;
    sized->vis.quality = quality;
    mjr_defaultContext(&gl_);
    mjr_makeContext(sized.get(), &gl_, mjFONTSCALE_100);
    mjr_setBuffer(mjFB_OFFSCREEN, &gl_);
  }
  ~GlCanvas() {
    context_.MakeCurrent();
    mjr_freeContext(&gl_);
    mjv_freeScene(&scene_);
  }
  GlCanvas(const GlCanvas&) = delete;
  GlCanvas& operator=(const GlCanvas&) = delete;

  // Lists what there is to draw at the computed positions in `data`.
  void Update(const mjData& data) {
    mjv_updateScene(&model_, const_cast<mjData*>(&data), &option_, nullptr, nullptr, mjCAT_ALL,
                    &scene_);
  }
  // Draws the list as a fixed camera of the model sees it.
  void Draw(const mjData& data, int camera) {
    mjvCamera fixed;
    mjv_defaultCamera(&fixed);
    fixed.type = mjCAMERA_FIXED;
    fixed.fixedcamid = camera;
    mjv_updateCamera(&model_, const_cast<mjData*>(&data), &fixed, &scene_);
    context_.MakeCurrent();
    mjr_setBuffer(mjFB_OFFSCREEN, &gl_);
    mjr_render(viewport_, &scene_, &gl_);
  }
  // Copies the picture just drawn, bottom row first: RGB and the GL depth.
  void Read(uint8_t* rgb, float* depth) { mjr_readPixels(rgb, depth, viewport_, &gl_); }

  mjvScene& scene() { return scene_; }
  int width_px() const { return viewport_.width; }
  int height_px() const { return viewport_.height; }

 private:
  view::GlContext& context_;
  const mjModel& model_;
  mjvOption option_;
  mjvScene scene_;
  mjrContext gl_;
  mjrRect viewport_;
};

}  // namespace turbidock::testing
