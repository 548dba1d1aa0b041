#include "sim/stereo_renderer.h"

#include <GL/gl.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>

#include "sim/base/check.h"

namespace turbidock::sim {
namespace {

constexpr int kHiddenGroup = 3;  // geoms that take part in contacts only

// One sample a pixel, because ids must not be averaged; no shadows. Facets cost time: with these a
// ball is round to 0.3 % of its radius.
constexpr GlCanvas::Quality kVisibilityQuality{
    .shadowsize = 0, .offsamples = 0, .numslices = 40, .numstacks = 24, .numquads = 4};

// More than the model's geoms ever need: MuJoCo drops what does not fit.
int MaxDrawn(const mjModel& m) { return m.ngeom + m.nsite + 16; }

// GL depth in [0, 1] of a standard perspective projection to metres along the optical axis. The
// usual z = n f / (f - d (f - n)) loses its digits where d is near 1; this form does not.
float DepthFromGl(float d, float near_m, float far_m) {
  return near_m * far_m / (near_m + (1 - d) * (far_m - near_m));
}

// Whether a sphere around a point, given in the optical frame, lies wholly outside a camera's view.
bool OutsideView(const CameraIntrinsics& camera, const Eigen::Vector3d& p_CQ, double radius_m) {
  // Half extents of the image plane at depth 1; a side plane's normal has length hypot(1, extent).
  const double x_max = 0.5 * camera.width_px / camera.fx_px;
  const double y_max = 0.5 * camera.height_px / camera.fy_px;
  return p_CQ.z() < -radius_m ||
         std::abs(p_CQ.x()) - x_max * p_CQ.z() > radius_m * std::hypot(1, x_max) ||
         std::abs(p_CQ.y()) - y_max * p_CQ.z() > radius_m * std::hypot(1, y_max);
}

}  // namespace

GlCanvas::GlCanvas(GlContext& context, const mjModel& model, int width_px, int height_px,
                   const Quality& quality)
    : context_(context), model_(model), viewport_{0, 0, width_px, height_px} {
  context_.MakeCurrent();
  const auto load = [&](const char* name, auto* function) {
    *function =
        reinterpret_cast<std::remove_pointer_t<decltype(function)>>(context_.Function(name));
    if (*function == nullptr) throw SimulatorFault(std::string("OpenGL has no ") + name);
  };
  load("glEnable", &gl_enable_);
  load("glDisable", &gl_disable_);
  load("glScissor", &gl_scissor_);
  mjv_defaultOption(&option_);
  std::fill_n(option_.geomgroup, mjNGROUP, mjtByte{1});
  option_.geomgroup[kHiddenGroup] = 0;
  std::fill_n(option_.sitegroup, mjNGROUP, mjtByte{0});
  std::fill_n(option_.actuatorgroup, mjNGROUP, mjtByte{0});
  mjv_defaultScene(&scene_);
  mjv_makeScene(&model_, &scene_, MaxDrawn(model_));

  // Size and quality of the drawing are part of the model; the scene's own stays untouched.
  const MjModelPtr sized(mj_copyModel(nullptr, &model_));
  sized->vis.global.offwidth = width_px;
  sized->vis.global.offheight = height_px;
  sized->vis.quality = quality;
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

GlCanvas::~GlCanvas() {
  context_.MakeCurrent();
  mjr_freeContext(&gl_);
  mjv_freeScene(&scene_);
}

void GlCanvas::Update(const mjData& data) {
  // MuJoCo asks for mutable data only to borrow its stack and give it back.
  mjv_updateScene(&model_, const_cast<mjData*>(&data), &option_, nullptr, nullptr, mjCAT_ALL,
                  &scene_);
}

void GlCanvas::Draw(const mjData& data, int camera) {
  mjvCamera fixed;
  mjv_defaultCamera(&fixed);
  fixed.type = mjCAMERA_FIXED;
  fixed.fixedcamid = camera;
  mjv_updateCamera(&model_, const_cast<mjData*>(&data), &fixed, &scene_);
  context_.MakeCurrent();
  mjr_setBuffer(mjFB_OFFSCREEN, &gl_);
  mjr_render(viewport_, &scene_, &gl_);
}

void GlCanvas::Draw(const mjData& data, int camera, const PixelRegion& region) {
  context_.MakeCurrent();
  gl_enable_(GL_SCISSOR_TEST);
  gl_scissor_(region.column_begin, viewport_.height - region.row_end, region.width(),
              region.height());
  Draw(data, camera);
  gl_disable_(GL_SCISSOR_TEST);
}

void GlCanvas::Read(uint8_t* rgb, float* depth) { mjr_readPixels(rgb, depth, viewport_, &gl_); }

void GlCanvas::Read(const PixelRegion& region, uint8_t* rgb, float* depth) {
  const mjrRect part = {region.column_begin, viewport_.height - region.row_end, region.width(),
                        region.height()};
  mjr_readPixels(rgb, depth, part, &gl_);
}

StereoRenderer::StereoRenderer(GlContext& context, const Scene& scene)
    : scene_(scene),
      canvas_(context, *scene.model, scene.rig.left.width_px, scene.rig.left.height_px,
              kVisibilityQuality) {
  // Colours are ids: nothing may blend or shade them.
  std::fill_n(canvas_.scene().flags, mjNRNDFLAG, mjtByte{0});
  canvas_.scene().flags[mjRND_SEGMENT] = 1;
  canvas_.scene().flags[mjRND_IDCOLOR] = 1;
  canvas_.scene().flags[mjRND_CULL_FACE] = 1;

  const mjModel& m = *scene.model;
  TD_CHECK(m.ngeom < std::numeric_limits<uint16_t>::max(), "surface ids are 16 bits wide");
  near_m_ = static_cast<float>(m.vis.map.znear * m.stat.extent);
  far_m_ = static_cast<float>(m.vis.map.zfar * m.stat.extent);
  surface_of_color_.resize(MaxDrawn(m) + 1);
  const size_t pixels = static_cast<size_t>(canvas_.width_px()) * canvas_.height_px();
  rgb_.resize(3 * pixels);
  depth_.resize(pixels);
}

void StereoRenderer::Render(const mjData& data, int64_t tick, RenderedStereo* out,
                            StageTimer* timer) {
  const PixelRegion all = {0, 0, canvas_.width_px(), canvas_.height_px()};
  Render(data, tick, {all, all}, out, timer);
}

void StereoRenderer::Render(const mjData& data, int64_t tick, const StereoRegion& region,
                            RenderedStereo* out, StageTimer* timer) {
  canvas_.Update(data);

  out->tick = tick;
  out->X_WH = SitePose(data, scene_.camera_head_site);
  RenderView(data, scene_.left_camera, scene_.rig.left, out->X_WH * scene_.rig.X_HL, region.left,
             timer, &out->left);
  RenderView(data, scene_.right_camera, scene_.rig.right, out->X_WH * scene_.rig.X_HR, region.right,
             timer, &out->right);
}

void StereoRenderer::NameColors(const CameraIntrinsics& intrinsics, const Pose& X_WC) {
  const mjModel& m = *scene_.model;
  const Pose X_CW = X_WC.Inverse();
  std::fill(surface_of_color_.begin(), surface_of_color_.end(), uint16_t{0});
  mjvScene& drawn = canvas_.scene();
  for (int i = 0; i < drawn.ngeom; ++i) {
    mjvGeom& geom = drawn.geoms[i];
    geom.segid = -1;
    if (geom.objtype != mjOBJ_GEOM) continue;
    const double radius_m = m.geom_rbound[geom.objid];  // 0 for planes, which have no bound
    const Eigen::Vector3d p_WQ = Eigen::Vector3f::Map(geom.pos).cast<double>();
    if (radius_m > 0 && OutsideView(intrinsics, X_CW * p_WQ, radius_m)) continue;
    geom.segid = i;
    surface_of_color_[i + 1] = static_cast<uint16_t>(geom.objid + 1);
  }
}

void StereoRenderer::RenderView(const mjData& data, int camera, const CameraIntrinsics& intrinsics,
                                const Pose& X_WC, const PixelRegion& region, StageTimer* timer,
                                RenderedView* out) {
  out->surface.Resize(canvas_.width_px(), canvas_.height_px());
  out->depth_m.Resize(canvas_.width_px(), canvas_.height_px());
  if (region.empty()) return;
  NameColors(intrinsics, X_WC);
  canvas_.Draw(data, camera, region);
  if (timer) mjr_finish();
  Lap(timer, LoopStage::kRender);
  canvas_.Read(region, rgb_.data(), depth_.data());

  const int width = region.width();
  for (int v = region.row_begin; v < region.row_end; ++v) {
    // GL's first row is the lowest.
    const size_t from = static_cast<size_t>(region.row_end - 1 - v) * width;
    const uint8_t* rgb = rgb_.data() + 3 * from;
    const float* depth = depth_.data() + from;
    uint16_t* surface = out->surface.at(region.column_begin, v);
    float* depth_m = out->depth_m.at(region.column_begin, v);
    for (int u = 0; u < width; ++u) {
      const size_t color = rgb[3 * u] + 256u * rgb[3 * u + 1] + 65536u * rgb[3 * u + 2];
      surface[u] = color < surface_of_color_.size() ? surface_of_color_[color] : uint16_t{0};
    }
    for (int u = 0; u < width; ++u) {
      const float z_m = DepthFromGl(depth[u], near_m_, far_m_);
      depth_m[u] = surface[u] != 0 ? z_m : std::numeric_limits<float>::infinity();
    }
  }
  Lap(timer, LoopStage::kReadBack);
}

SpectatorRenderer::SpectatorRenderer(GlContext& context, const Scene& scene, int width_px,
                                     int height_px)
    : canvas_(context, *scene.model, width_px, height_px, scene.model->vis.quality),
      rgb_(static_cast<size_t>(3) * width_px * height_px) {
  canvas_.scene().flags[mjRND_FOG] = 1;
}

void SpectatorRenderer::Render(const mjData& data, int camera, Image3u8* out) {
  canvas_.Update(data);
  canvas_.Draw(data, camera);
  canvas_.Read(rgb_.data(), nullptr);
  const int width = canvas_.width_px(), height = canvas_.height_px();
  out->Resize(width, height);
  const size_t row = static_cast<size_t>(3) * width;
  for (int v = 0; v < height; ++v)
    std::copy_n(rgb_.data() + row * (height - 1 - v), row, out->row(v));
}

}  // namespace turbidock::sim
