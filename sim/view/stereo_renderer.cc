#include "sim/view/stereo_renderer.h"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <string>

#include "sim/base/check.h"
#include "sim/base/vector_clones.h"

namespace turbidock::view {
namespace {

// More than the model's geoms ever need: MuJoCo drops what does not fit.
int MaxDrawn(const mjModel& m) { return m.ngeom + m.nsite + 16; }

float NearPlane(const mjModel& m) { return static_cast<float>(m.vis.map.znear * m.stat.extent); }

// near / depth to depth; 0, where there is nothing, to infinity.
TURBIDOCK_VECTOR_CLONES void DepthFromNearness(float near_m, int count, float* values) {
  for (int i = 0; i < count; ++i) values[i] = near_m / values[i];
}

// What a region has besides a part of it.
std::array<PixelRegion, 4> Beside(const PixelRegion& part, const PixelRegion& region) {
  if (part.empty()) return {region};
  return {{{region.column_begin, region.row_begin, region.column_end, part.row_begin},
           {region.column_begin, part.row_end, region.column_end, region.row_end},
           {region.column_begin, part.row_begin, part.column_begin, part.row_end},
           {part.column_end, part.row_begin, region.column_end, part.row_end}}};
}

}  // namespace

StereoRenderer::StereoRenderer(GlContext& context, const vehicle::Scene& scene,
                               const std::vector<Distractor>& distractors)
    : scene_(scene),
      near_m_(NearPlane(*scene.model)),
      lister_(*scene.model, distractors, vehicle::kContactsOnlyGroup, near_m_),
      canvas_(context, scene.rig.left.width_px, scene.rig.left.height_px, /*views=*/2,
              scene.model->ngeom + static_cast<int>(distractors.size()), near_m_) {
  TD_CHECK(static_cast<size_t>(scene.model->ngeom) + distractors.size() <
               std::numeric_limits<uint16_t>::max(),
           "surface ids are 16 bits wide");
}

void StereoRenderer::Render(const mjData& data, RenderedStereo* out, StageTimer* timer) {
  Render(data, WholeImages(scene_.rig), out, timer);
}

void StereoRenderer::Render(const mjData& data, const StereoRegion& region, RenderedStereo* out,
                            StageTimer* timer) {
  out->X_WH = vehicle::SitePose(data, scene_.camera_head_site);
  if (scene_.moored_body.body >= 0) out->X_WK = vehicle::BodyPose(data, scene_.moored_body.body);
  out->distractors = placed_;
  canvas_.Begin();
  for (const Side side : kSides) {
    if (region[side].empty()) continue;
    const MountedCamera& camera = scene_.rig[side];
    SurfaceList& list = lists_[side];
    lister_.List(data, placed_, camera, out->X_WH * camera.X_HC, region[side], &list);
    if (!list.drawn.empty()) canvas_.Draw(static_cast<int>(side), list.drawn, list);
  }
  if (timer) canvas_.Finish();
  Lap(timer, LoopStage::kRender);

  for (const Side side : kSides) Read(side, region[side], &(*out)[side]);
  canvas_.End();
  Lap(timer, LoopStage::kReadBack);
}

void StereoRenderer::Read(Side side, const PixelRegion& region, RenderedView* out) {
  out->surface.Resize(canvas_.width_px(), canvas_.height_px());
  out->depth_m.Resize(canvas_.width_px(), canvas_.height_px());
  if (region.empty()) return;
  const SurfaceList& list = lists_[side];
  std::span<const SeenPlane> planes = list.planes;
  // what OpenGL has drawn nothing of is a plane or nothing
  for (const PixelRegion& part : Beside(list.drawn, region)) {
    if (!planes.empty()) {
      PaintPlane(planes[0], part, Onto::kNothing, &out->surface, &out->depth_m);
      continue;
    }
    for (int v = part.row_begin; v < part.row_end; ++v) {
      std::fill_n(out->surface.at(part.column_begin, v), part.width(), uint16_t{0});
      std::fill_n(out->depth_m.at(part.column_begin, v), part.width(), 0.0f);
    }
  }
  if (!list.drawn.empty())
    canvas_.Read(static_cast<int>(side), list.drawn, &out->surface, &out->depth_m);
  for (size_t i = 0; i < planes.size(); ++i)
    PaintPlane(planes[i], i == 0 ? list.drawn : region, Onto::kWhatIsThere, &out->surface,
               &out->depth_m);
  for (int v = region.row_begin; v < region.row_end; ++v)
    DepthFromNearness(near_m_, region.width(), out->depth_m.at(region.column_begin, v));
}

SpectatorRenderer::SpectatorRenderer(GlContext& context, const vehicle::Scene& scene, int width_px,
                                     int height_px)
    : context_(context),
      model_(*scene.model),
      viewport_{0, 0, width_px, height_px},
      rgb_(static_cast<size_t>(3) * width_px * height_px) {
  context_.MakeCurrent();
  mjv_defaultOption(&option_);
  std::fill_n(option_.geomgroup, mjNGROUP, mjtByte{1});
  option_.geomgroup[vehicle::kContactsOnlyGroup] = 0;
  std::fill_n(option_.sitegroup, mjNGROUP, mjtByte{0});
  std::fill_n(option_.actuatorgroup, mjNGROUP, mjtByte{0});
  mjv_defaultScene(&scene_);
  mjv_makeScene(&model_, &scene_, MaxDrawn(model_));
  scene_.flags[mjRND_FOG] = 1;

  // The size of the drawing is part of the model; the scene's own stays untouched.
  const vehicle::MjModelPtr sized(mj_copyModel(nullptr, &model_));
  sized->vis.global.offwidth = width_px;
  sized->vis.global.offheight = height_px;
  mjr_defaultContext(&gl_);
  mjr_makeContext(sized.get(), &gl_, mjFONTSCALE_100);
  mjr_setBuffer(mjFB_OFFSCREEN, &gl_);
  if (gl_.currentBuffer != mjFB_OFFSCREEN || gl_.offWidth != width_px ||
      gl_.offHeight != height_px) {
    mjr_freeContext(&gl_);
    mjv_freeScene(&scene_);
    throw SimulatorFault("OpenGL gives no offscreen buffer of " + std::to_string(width_px) + " x " +
                         std::to_string(height_px) + " pixels (" + context_.description() + ")");
  }
}

SpectatorRenderer::~SpectatorRenderer() {
  context_.MakeCurrent();
  mjr_freeContext(&gl_);
  mjv_freeScene(&scene_);
}

void SpectatorRenderer::Render(const mjData& data, int camera, Image3u8* out, double back_m,
                               double cut_m) {
  mjvCamera fixed;
  mjv_defaultCamera(&fixed);
  fixed.type = mjCAMERA_FIXED;
  fixed.fixedcamid = camera;
  // MuJoCo asks for mutable data only to borrow its stack and give it back.
  mjv_updateScene(&model_, const_cast<mjData*>(&data), &option_, nullptr, &fixed, mjCAT_ALL,
                  &scene_);
  for (mjvGLCamera& c : scene_.camera) {
    for (int i = 0; i < 3; ++i) c.pos[i] -= static_cast<float>(back_m) * c.forward[i];
    const float wider = std::max(1.0F, static_cast<float>(cut_m) / c.frustum_near);
    for (float* at : {&c.frustum_near, &c.frustum_center, &c.frustum_bottom, &c.frustum_top})
      *at *= wider;
  }
  context_.MakeCurrent();
  mjr_setBuffer(mjFB_OFFSCREEN, &gl_);
  mjr_render(viewport_, &scene_, &gl_);
  mjr_readPixels(rgb_.data(), nullptr, viewport_, &gl_);
  const int width = viewport_.width, height = viewport_.height;
  out->Resize(width, height);
  const size_t row = static_cast<size_t>(3) * width;
  for (int v = 0; v < height; ++v)
    std::copy_n(rgb_.data() + row * (height - 1 - v), row, out->row(v));
}

}  // namespace turbidock::view
