#include "sim/vehicle/tags.h"

#include <algorithm>
#include <charconv>
#include <string>
#include <string_view>

#include "sim/base/check.h"

namespace turbidock::vehicle {

std::vector<TagInScene> TagsOf(const Scene& scene) {
  constexpr std::string_view kPrefix = "tag_";
  const mjModel& m = *scene.model;
  const MjDataPtr d(mj_makeData(&m));
  mj_kinematics(&m, d.get());
  const Pose X_MW = SitePose(*d, scene.marker_site).Inverse();
  std::vector<TagInScene> tags;
  for (int site = 0; site < m.nsite; ++site) {
    const char* text = mj_id2name(&m, mjOBJ_SITE, site);
    const std::string_view name = text ? text : "";
    if (!name.starts_with(kPrefix)) continue;
    const auto require = [&](bool condition, const char* problem) {
      if (!condition) throw ConfigError("site \"" + std::string(name) + "\"", problem);
    };
    TagInScene tag;
    const std::string_view number = name.substr(kPrefix.size());
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), tag.id);
    require(error == std::errc() && end == number.data() + number.size() && tag.id >= 0,
            "must be named by its number in the family, as tag_3");
    const mjtNum* half_m = m.site_size + 3 * site;
    require(m.site_type[site] == mjGEOM_BOX && half_m[1] == half_m[2],
            "must be a box as wide as it is high: the tag's black square");
    require(m.body_weldid[m.site_bodyid[site]] == m.body_weldid[scene.marker_body],
            "must be fixed to the marker");
    require(std::ranges::find(tags, tag.id, &TagInScene::id) == tags.end(),
            "is a second tag of this number");
    tag.X_MT = (X_MW * SitePose(*d, site)).Canonical();
    tag.size_m = 2 * half_m[1];
    tags.push_back(tag);
  }
  std::ranges::sort(tags, {}, &TagInScene::id);
  return tags;
}

std::vector<float> BrightnessOf(const Scene& scene, const TagInScene& tag, int across) {
  const mjModel& m = *scene.model;
  const MjDataPtr d(mj_makeData(&m));
  mj_kinematics(&m, d.get());
  const Pose X_WT = SitePose(*d, scene.marker_site) * tag.X_MT;
  const double cell_m = tag.size_m / (across - 2), middle = 0.5 * (across - 1);
  const Eigen::Vector3d way_W = X_WT.q * Eigen::Vector3d::UnitX();
  std::vector<float> brightness;
  for (int row = 0; row < across; ++row)
    for (int column = 0; column < across; ++column) {
      const Eigen::Vector3d p_W = X_WT * Eigen::Vector3d(-0.5 * cell_m, (middle - column) * cell_m,
                                                         (middle - row) * cell_m);
      int geom = -1;
      const mjtByte drawn[mjNGROUP] = {1, 1, 1, 0, 1, 1};
      mj_ray(&m, d.get(), p_W.data(), way_W.data(), drawn, /*flg_static=*/1, scene.vehicle_body,
             &geom);
      brightness.push_back(geom < 0 ? 0 : m.geom_rgba[4 * geom + 1]);
    }
  return brightness;
}

}  // namespace turbidock::vehicle
