#include "tests/check/simple_scene.h"

#include <cstring>
#include <string_view>

#include "sim/base/check.h"
#include "sim/vehicle/mujoco_handlers.h"

namespace turbidock::check {

vehicle::Scene MakeScene(const std::string& world, const std::string& option) {
  vehicle::InstallMujocoHandlers();
  const std::string xml = "<mujoco><option " + option + "/><worldbody>" + world +
                          R"(</worldbody><actuator>
    <motor name="surge_left" site="surge_left"/><motor name="surge_right" site="surge_right"/>
    <motor name="sway" site="sway"/><motor name="heave" site="heave"/></actuator></mujoco>)";
  const auto vfs = std::make_unique<mjVFS>();
  mj_defaultVFS(vfs.get());
  mj_makeEmptyFileVFS(vfs.get(), "scene.xml", static_cast<int>(xml.size()));
  std::memcpy(vfs->filedata[0], xml.data(), xml.size());
  char error[500] = "";
  vehicle::Scene scene;
  scene.model.reset(mj_loadXML("scene.xml", vfs.get(), error, sizeof error));
  mj_deleteVFS(vfs.get());
  TD_CHECK(scene.model, error);

  const mjModel* m = scene.model.get();
  scene.vehicle_body = mj_name2id(m, mjOBJ_BODY, "vehicle");
  scene.pole_tip_site = mj_name2id(m, mjOBJ_SITE, "pole_tip");
  scene.dock_mouth_site = mj_name2id(m, mjOBJ_SITE, "dock_mouth");
  for (int actuator = 0; actuator < m->nu; ++actuator)
    scene.thrusters.push_back(vehicle::ThrusterAt(*m, actuator));
  for (int g = 0; g < m->ngeom; ++g) {
    const char* text = mj_id2name(m, mjOBJ_GEOM, g);
    const std::string_view name = text ? text : "";
    scene.geom_part.push_back(name == "pole"              ? vehicle::Part::kPole
                              : name.starts_with("dock_") ? vehicle::Part::kDock
                              : name.starts_with("hull")  ? vehicle::Part::kHull
                                                          : vehicle::Part::kEnvironment);
  }
  return scene;
}

vehicle::Scene OpenWater(const std::string& option) { return MakeScene(kVehicleBody, option); }

}  // namespace turbidock::check
