#pragma once
// The water model: turns visibility (sim/view/rendered.h) into the linear radiance that reaches the
// cameras. Deferred shading: position, normal and albedo of a pixel are known, all light is
// computed here.
//
// Per pixel at range r, per channel, with a, b, c, G as in sim/light/scattering.h:
//   L = exp(-c r) (L_emitted + albedo / pi (E_lamps + E_balls)) + veil of the lamps + halos of the
//   balls, of marker and station in the lamps' light.
// Light's way to a surface is attenuated with G, since scattering by small angles still lights a
// surface; its way to the camera with c, since it no longer makes an image (it makes veil and
// halo). The forward peak of sea water is no loss: it spreads the balls' own light
// (sim/light/forward_peak.h) and leaves all other as it is.
//
// The marker's shadow is cut out of the lamps' light on surfaces and (the box's only) out of the
// halos. Left out: shadows in the veil, halos of far walls and of surfaces in the balls' light,
// light between surfaces.
//
// Light is computed at few pixels, many at a time (sim/light/point_batch.h), and spread from there
// over tiles (sim/light/tiles.h).

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sim/base/camera.h"
#include "sim/base/image.h"
#include "sim/light/forward_peak.h"
#include "sim/light/optics_params.h"
#include "sim/light/point_batch.h"
#include "sim/light/radiance.h"
#include "sim/light/reflectors.h"
#include "sim/light/scattering.h"
#include "sim/light/surfaces.h"
#include "sim/light/tiles.h"
#include "sim/view/rendered.h"

namespace turbidock::light {

class Water {
 public:
  // X_HE: poses of the lamps in the head, beam along x. Checks the parameters, and that every lit
  // ball is a sphere named "ball_..." in the table (ConfigError). `lamp_factors` are on each lamp's
  // intensity; none: 1.
  Water(const OpticsParams& params, const StereoRig& rig, const SurfaceTable& surfaces,
        const std::vector<Pose>& X_HE, const std::vector<double>& lamp_factors = {});

  // Light from above in the images prepared next, as the irradiance of a surface that faces up
  // where the vehicle is. A surface with normal n has the share (1 + n . up) / 2 of it, as under
  // an even sky; the water itself is seen as L (1 - exp(-c r)), L = b / c E / (2 pi): what scatters
  // of that sky's light once, in all directions alike.
  void SetDaylight(const Eigen::Array3d& irradiance_w_m2);

  // The radiance of both images. Allocates only when `out` does not have their size.
  void Apply(const view::RenderedStereo& rendered, RadianceStereo* out);

  // The same a band of rows at a time, which stays in cache until the sensor has it: after Prepare,
  // PaintRows writes rows [row_begin, row_end) of one camera, each its red values, then green and
  // blue. Row_begin is a multiple of TiledLight::kBandRows, of which at most as many are painted.
  // Only pixels in the region are sure to be written; they are the same whatever the region.
  void Prepare(const view::RenderedStereo& rendered, const StereoRegion& region);
  void PaintRows(Side side, int row_begin, int row_end, float* rgb) const;

  // Of the instant prepared last:
  // Radiance of a lattice of pixels of both views by channel, W m^-2 sr^-1, until the next call.
  // Needs whole views.
  std::span<const Eigen::Array3f> MeteredRadiance(const view::RenderedStereo& rendered);

  // Irradiance of small things in the water, from all sides, of lamps and lit balls [W/m^2 each
  // channel].
  void IrradianceFromAllSides(std::span<const Eigen::Vector3f> p_HQ,
                              std::span<Eigen::Array3f> out_w_m2);

  // All pixels of both cameras.
  StereoRegion whole() const { return WholeImages(rig_); }
  // What Prepare looks at of the rendered views: the region, grown to whole tiles.
  StereoRegion Seen(const StereoRegion& region) const;
  // Points at which light was computed for the images prepared last.
  int64_t points() const;
  const Medium& medium() const { return medium_; }
  const ShadingParams& shading() const { return params_.shading; }
  const StereoRig& rig() const { return rig_; }

 private:
  struct Camera : MountedCamera {
    RayFrame rays;
    std::optional<VeilTable> veil;  // none with the lamps off or nothing that scatters
    SurfacePyramid pyramid;
    TiledLight surface_light, water_light;
    std::vector<SpreadImage> spread;  // by lit ball, of the instant; empty without a forward peak
  };
  struct LitBall {
    int geom = -1;
    Glow glow;
    BallDisc disc;
    size_t halo = 0;  // in halos_, if something scatters
  };

  Lamp LampOf(const Pose& X_HE_of_scene, double factor) const;
  PixelRegion WholeTiles(const PixelRegion& region, const CameraIntrinsics& camera) const;
  void Place(const view::RenderedStereo& rendered);
  bool IsPresent(const LitBall& ball) const { return present_[static_cast<size_t>(ball.geom)]; }
  void PrepareView(const view::RenderedView& view, const PixelRegion& region, Camera* camera);
  void ShineFromSurfaces(const Camera& camera, std::span<const LightPoint> points, Light* light);
  void ShineFromSurface(const Camera& camera, int geom, PointBatch* batch) const;
  void Spread(Camera* camera);
  void ShineFromWater(const Camera& camera, std::span<const LightPoint> points, Light* light);
  void CastShadows(int lit_geom, int source_geom, const Eigen::Vector3f& p_HSource,
                   const Bounds& lit, PointBatch* batch) const;

  PointBatch batch_;
  OpticsParams params_;
  StereoRig rig_;
  SurfaceTable surfaces_;
  Medium medium_;
  Eigen::Array3f image_loss_per_m_, lighting_loss_per_m_, halo_loss_per_m_;
  bool scatters_ = false;
  std::vector<Lamp> lamps_;  // empty when off
  std::vector<LitBall> lit_balls_;
  std::vector<std::pair<double, HaloTable>> halos_;  // of unit intensity, by the ball's radius
  std::vector<SpreadBall> spread_balls_;             // likewise; empty without a forward peak
  Reflectors reflectors_;  // none with the lamps off or nothing that scatters
  std::vector<int> casters_;
  int shadow_box_ = -1;  // the geom that casts shadows in halos, -1: none
  Stereo<Camera> cameras_;
  std::vector<PlacedSurface> placed_;  // by geom id, at the current instant
  std::vector<bool> present_;          // likewise: whether it is there
  bool day_ = false;
  Eigen::Array3f daylight_w_m2_ = Eigen::Array3f::Zero();
  Eigen::Array3f day_veil_w_m2_sr_ = Eigen::Array3f::Zero();  // of endless water
  Eigen::Vector3f up_H_ = Eigen::Vector3f::UnitZ();
  std::vector<int> first_of_surface_, order_;  // points sorted by surface
  std::vector<LightPoint> metered_;
  std::vector<Light> metered_light_;
  std::vector<Eigen::Array3f> metered_radiance_;
  std::vector<float> band_;  // radiance of some rows
};

}  // namespace turbidock::light
