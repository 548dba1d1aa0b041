#include "experiments/studies/bench/bare_renderer.h"

#include <algorithm>
#include <array>

namespace turbidock::bench {

BareRenderer::BareRenderer(const trial::Scenario& scenario)
    : scene_(vehicle::LoadScene(trial::SceneFilesOf(scenario), scenario.rig)),
      context_(view::MakeGlContext(scenario.renderer)),
      data_(mj_makeData(scene_.model.get())),
      viewport_{0, 0, scene_.rig.left.width_px, scene_.rig.left.height_px} {
  context_->MakeCurrent();
  const vehicle::MjModelPtr sized(mj_copyModel(nullptr, scene_.model.get()));
  sized->vis.global.offwidth = viewport_.width;
  sized->vis.global.offheight = viewport_.height;
  sized->vis.quality.offsamples = 0;
  sized->vis.quality.shadowsize = 0;
  mjr_defaultContext(&gl_);
  mjr_makeContext(sized.get(), &gl_, mjFONTSCALE_100);
  mjr_setBuffer(mjFB_OFFSCREEN, &gl_);
  for (mjvScene& drawn : drawn_) {
    mjv_defaultScene(&drawn);
    mjv_makeScene(scene_.model.get(), &drawn, 1000);
  }
  const size_t pixels = static_cast<size_t>(viewport_.width) * viewport_.height;
  rgb_.resize(3 * pixels);
  depth_.resize(pixels);
}

BareRenderer::~BareRenderer() {
  context_->MakeCurrent();
  mjr_freeContext(&gl_);
  for (mjvScene& drawn : drawn_) mjv_freeScene(&drawn);
}

void BareRenderer::Place(const Pose& X_WB) {
  const mjModel& m = *scene_.model;
  const std::array values = {X_WB.p.x(), X_WB.p.y(), X_WB.p.z(), X_WB.q.w(),
                             X_WB.q.x(), X_WB.q.y(), X_WB.q.z()};
  std::copy(values.begin(), values.end(),
            data_->qpos + m.jnt_qposadr[m.body_jntadr[scene_.vehicle_body]]);
  mj_forward(&m, data_.get());
  mjvOption option;
  mjv_defaultOption(&option);
  mjvCamera camera;
  mjv_defaultCamera(&camera);
  camera.type = mjCAMERA_FIXED;
  for (const bool right : {false, true}) {
    camera.fixedcamid = right ? scene_.right_camera : scene_.left_camera;
    mjv_updateScene(&m, data_.get(), &option, nullptr, &camera, mjCAT_ALL, &drawn_[right]);
  }
}

void BareRenderer::Render() {
  context_->MakeCurrent();
  mjr_setBuffer(mjFB_OFFSCREEN, &gl_);
  for (mjvScene& drawn : drawn_) {
    mjr_render(viewport_, &drawn, &gl_);
    mjr_readPixels(rgb_.data(), depth_.data(), viewport_, &gl_);
  }
}

}  // namespace turbidock::bench
