#pragma once
// What the marker and its station throw back of the lamps' light, as sources of halos: near a
// bright surface the water glows, by light that is scattered once on its way from there to the
// camera (Jaffe's forward-scattered component; milk scatters by tens of degrees, so it is a glow
// and no blur).
//
// Large faces are divided into patches, each a Lambertian disc of the same area; a painted ball is
// a ball of light. Faces count as turned to the camera, which those that are seen at all nearly
// are.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sim/light/point_batch.h"
#include "sim/light/scattering.h"
#include "sim/light/surfaces.h"

namespace turbidock::light {

class Reflectors {
 public:
  Reflectors() = default;
  // Of the marker (all that casts shadows) and the plate it is mounted on.
  Reflectors(const SurfaceTable& surfaces, const Medium& medium);

  // Where they are now and how they are lit. `casters` throw shadows.
  void Illuminate(const SurfaceTable& surfaces, std::span<const PlacedSurface> placed,
                  std::span<const Lamp> lamps, std::span<const int> casters, PointBatch* batch);

  // Adds the halos along the batch's rays to `light`, of `count` rays.
  void AddHalos(const RayFrame& rays, int count, PointBatch* batch, Light* light) const;

  // Radiant intensity of all together towards the camera.
  Rgb intensity_w_sr() const;

 private:
  struct Reflector {
    int geom = -1;
    std::vector<Eigen::Vector3f> samples_S;  // points whose mean irradiance counts; none on a ball
    Eigen::Vector3f normal_S = Eigen::Vector3f::Zero();
    Eigen::Array3f per_irradiance_m2_sr;  // intensity over irradiance
    size_t halo = 0;                      // in halos_
    Eigen::Vector3f p_HQ = Eigen::Vector3f::Zero();
    Glow glow;
  };
  void AddFaces(int geom, const Surface& box);
  size_t Halo(double radius_m, bool disc);

  Medium medium_;
  std::vector<Reflector> reflectors_;
  struct KnownHalo {
    double radius_m;
    bool disc;
    HaloTable table;
  };
  std::vector<KnownHalo> halos_;  // of unit intensity
};

}  // namespace turbidock::light
