#pragma once
// A scene with the vehicle put where a test wants it.

#include <algorithm>
#include <iterator>
#include <string>

#include "sim/vehicle/scene.h"

namespace turbidock::testing {

inline std::string ModelPath(const std::string& name) {
  return TURBIDOCK_TEST_DATA "/../../models/" + name + ".xml";
}

struct PosedScene {
  explicit PosedScene(const std::string& name, const RigParams& rig = {})
      : scene(vehicle::LoadScene({ModelPath(name)}, rig)), data(mj_makeData(scene.model.get())) {}

  // Puts the vehicle where the camera head sees the marker at X_HM, and computes all positions.
  void Place(const Pose& X_HM) {
    const Pose X_WB = scene.X_WM * X_HM.Inverse() * scene.X_BH.Inverse();
    const mjModel& m = *scene.model;
    mjtNum* qpos = data->qpos + m.jnt_qposadr[m.body_jntadr[scene.vehicle_body]];
    const double values[] = {X_WB.p.x(), X_WB.p.y(), X_WB.p.z(), X_WB.q.w(),
                             X_WB.q.x(), X_WB.q.y(), X_WB.q.z()};
    std::copy(std::begin(values), std::end(values), qpos);
    mj_forward(&m, data.get());
  }

  int Geom(const std::string& name) const {
    return mj_name2id(scene.model.get(), mjOBJ_GEOM, name.c_str());
  }
  std::string GeomName(int geom) const {
    return geom < 0 ? "nothing" : mj_id2name(scene.model.get(), mjOBJ_GEOM, geom);
  }

  vehicle::Scene scene;
  vehicle::MjDataPtr data;
};

// What a ray from p_WQ hits first among the geoms that are drawn (or, if `contact_only`, among
// those that are not), and how far away; geom -1 if nothing.
struct RayHit {
  int geom = -1;
  double range_m = -1;
};
inline RayHit CastRay(const PosedScene& posed, const Eigen::Vector3d& p_WQ,
                      const Eigen::Vector3d& direction_W, bool contact_only = false) {
  const Eigen::Vector3d unit = direction_W.normalized();
  const mjtByte drawn[mjNGROUP] = {1, 1, 1, 0, 1, 1}, hidden[mjNGROUP] = {0, 0, 0, 1, 0, 0};
  RayHit hit;
  hit.range_m =
      mj_ray(posed.scene.model.get(), posed.data.get(), p_WQ.data(), unit.data(),
             contact_only ? hidden : drawn, /*flg_static=*/1, /*bodyexclude=*/-1, &hit.geom);
  return hit;
}

}  // namespace turbidock::testing
