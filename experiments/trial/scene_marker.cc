#include "experiments/trial/scene_marker.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/vehicle/tags.h"
#include "vision/hue_labels.h"
#include "vision/tag_codes.h"

namespace turbidock::trial {
namespace {

// To a micrometre: what sums of positions leave in the last digits is gone.
Eigen::Vector3d Rounded(const Eigen::Vector3d& p_m) {
  return (p_m * 1e6).array().round().matrix() / 1e6;
}

// Hue of HSV. ConfigError for grey.
double HueOf(const Eigen::Vector3d& rgb, const std::string& ball) {
  const double most = rgb.maxCoeff(), chroma = most - rgb.minCoeff();
  if (chroma <= 0.1 * most)
    throw ConfigError("marker.balls",
                      "ball " + ball + " of the scene is grey: the estimator knows balls by hue");
  const double sextant = rgb[0] == most   ? (rgb[1] - rgb[2]) / chroma
                         : rgb[1] == most ? 2 + (rgb[2] - rgb[0]) / chroma
                                          : 4 + (rgb[0] - rgb[1]) / chroma;
  const double turn = 2 * std::numbers::pi;
  return std::fmod(sextant * std::numbers::pi / 3 + turn, turn);
}

// The edges of the box that carries the balls; 0 where none is centred on the marker's origin, or
// where it is turned.
Eigen::Vector3d BoxOf(const vehicle::Scene& scene) {
  const mjModel& m = *scene.model;
  const vehicle::MjDataPtr d(mj_makeData(&m));
  mj_kinematics(&m, d.get());
  const Pose X_MW = vehicle::SitePose(*d, scene.marker_site).Inverse();
  for (int geom = 0; geom < m.ngeom; ++geom) {
    if (m.geom_bodyid[geom] != scene.marker_body || m.geom_type[geom] != mjGEOM_BOX) continue;
    const Pose X_WG = {Eigen::Quaterniond(Eigen::Matrix3d(
                           Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
                               d->geom_xmat + 9 * geom))),
                       Eigen::Vector3d::Map(d->geom_xpos + 3 * geom)};
    const Pose X_MG = X_MW * X_WG;
    if (X_MG.p.norm() < 1e-6 && AngleBetween(X_MG.q, Eigen::Quaterniond::Identity()) < 1e-6)
      return Rounded(2 * Eigen::Vector3d::Map(m.geom_size + 3 * geom));
  }
  return Eigen::Vector3d::Zero();
}

// A ball or a tag of a marker.
struct MarkerPart {
  std::string name;  // "ball red", "tag 3"
  Eigen::Vector3d p_m;
  double size_m;
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();

  std::string Place() const {
    return fmt::format("[{:.4g}, {:.4g}, {:.4g}] m with a size of {:.4g} m", p_m.x(), p_m.y(),
                       p_m.z(), size_m);
  }
};

// ConfigError naming the key when one that is known does not stand so in the scene.
void RequireInScene(const std::vector<MarkerPart>& known, const std::vector<MarkerPart>& real,
                    const std::string& key, const std::string& model) {
  constexpr double kTol_m = 1e-3, kTol_rad = 0.02;
  for (const MarkerPart& part : known) {
    const auto fail = [&](const std::string& problem) {
      throw ConfigError(key, fmt::format("{} {} ({}); set marker.may_differ to run all the same",
                                         part.name, problem, model));
    };
    const auto found = std::ranges::find(real, part.name, &MarkerPart::name);
    if (found == real.end()) fail("is not in the scene");
    if ((found->p_m - part.p_m).norm() > kTol_m || std::abs(found->size_m - part.size_m) > kTol_m)
      fail("is known at " + part.Place() + ", but in the scene it is at " + found->Place());
    if (const double off_rad = AngleBetween(found->q, part.q); off_rad > kTol_rad)
      fail(fmt::format("is turned by {:.2g} rad from what is known", off_rad));
  }
}

// Whether a tag is painted in the scene as a family has it. Of a few cells one may be hidden.
bool IsOf(vision::TagFamily family, const vehicle::TagInScene& tag, const vehicle::Scene& scene) {
  if (tag.id >= vision::TagCount(family)) return false;
  const vision::TagCells cells = vision::CellsOf(family, tag.id);
  const std::vector<float> seen = vehicle::BrightnessOf(scene, tag, cells.across);
  const float middle = 0.5F * (std::ranges::max(seen) + std::ranges::min(seen));
  size_t wrong = 0;
  for (size_t i = 0; i < seen.size(); ++i) wrong += (seen[i] > middle) != cells.white[i];
  return wrong * 20 < seen.size();
}

// ConfigError for a family of which the scene's tags are not, but of another.
void RequireFamily(vision::TagFamily known, const std::vector<vehicle::TagInScene>& tags,
                   const vehicle::Scene& scene) {
  for (const vehicle::TagInScene& tag : tags) {
    if (IsOf(known, tag, scene)) continue;
    for (const auto& [family, name] : EnumNames<vision::TagFamily>::kNames)
      if (IsOf(family, tag, scene))
        throw ConfigError("estimator.fiducial.family",
                          fmt::format("tag {} of the scene is one of {}; set marker.may_differ to "
                                      "run all the same",
                                      tag.id, name));
  }
}

const std::vector<vision::TagParams>& KnownTags(const Scenario& scenario) {
  return scenario.plugins.ParamsOf<vision::FiducialParams>().tags;
}

}  // namespace

void TakeBalls(const vehicle::Scene& scene, Scenario* scenario) {
  const vision::MarkerParams before = scenario->marker;
  vision::MarkerParams& marker = scenario->marker;
  marker.balls.clear();
  const light::BallLightParams& lights = scenario->light.ball_lights;
  std::vector<std::string> unlit;
  for (const vehicle::BallInScene& real : scene.balls) {
    vision::BallParams& ball = marker.balls.emplace_back();
    const auto known = std::ranges::find(before.balls, real.name, &vision::BallParams::name);
    if (known != before.balls.end()) {
      ball = *known;
    } else {
      const float* rgba = scene.model->geom_rgba + 4 * real.geom;
      Eigen::Vector3d color(rgba[0], rgba[1], rgba[2]);
      const auto lit = std::ranges::find(lights.balls, real.name, &light::BallLight::name);
      if (lights.enabled && lit != lights.balls.end()) color = lit->color;
      if (lights.enabled && lit == lights.balls.end()) unlit.push_back(real.name);
      ball.name = real.name;
      ball.hue_rad = HueOf(color, real.name);
      for (size_t k = 0; k < 3; ++k)
        ball.display_rgb[k] = color[static_cast<Eigen::Index>(k)] / color.maxCoeff();
    }
    ball.p_MQ_m = Rounded(real.p_MQ);
    ball.radius_m = std::round(real.radius_m * 1e6) / 1e6;
  }
  marker.box_m = BoxOf(scene);
  if (unlit.empty()) return;
  try {
    vision::CheckHues(marker, scenario->hue);
  } catch (const ConfigError& error) {
    throw ConfigError("lights.marker.balls",
                      fmt::format("has no light for {}, which is known by its paint: {}",
                                  fmt::join(unlit, ", "), error.problem()));
  }
}

bool TakesTags(const Scenario& scenario) {
  return scenario.plugins.ParamsOf<vision::FiducialParams>().tags_from_scene;
}

void TakeTags(const vehicle::Scene* scene, Scenario* scenario) {
  auto& tags = scenario->plugins.ParamsOf<vision::FiducialParams>().tags;
  tags.clear();
  if (!scene) return;
  for (const vehicle::TagInScene& real : vehicle::TagsOf(*scene)) {
    vision::TagParams& tag = tags.emplace_back();
    tag.id = real.id;
    tag.p_MT_m = Rounded(real.X_MT.p);
    const Eigen::Quaterniond& q = real.X_MT.q;
    tag.q_MT_wxyz = {q.w(), q.x(), q.y(), q.z()};
    // sums of rotations leave as much
    if (AngleBetween(q, Eigen::Quaterniond::Identity()) < 1e-6) tag.q_MT_wxyz = {1, 0, 0, 0};
    tag.size_m = std::round(real.size_m * 1e6) / 1e6;
  }
  if (tags.empty())
    throw ConfigError("estimator.fiducial.tags",
                      "there is no tag to read in " + scenario->model.path +
                          ": it has no site tag_*, as fiducial.xml has them");
}

void CheckTags(const Scenario& scenario, const vehicle::Scene& scene) {
  std::vector<MarkerPart> known, real;
  for (const vision::TagParams& tag : KnownTags(scenario))
    known.push_back({fmt::format("tag {}", tag.id), tag.p_MT_m, tag.size_m, tag.X_MT().q});
  const std::vector<vehicle::TagInScene> tags = vehicle::TagsOf(scene);
  for (const vehicle::TagInScene& tag : tags)
    real.push_back({fmt::format("tag {}", tag.id), tag.X_MT.p, tag.size_m, tag.X_MT.q});
  RequireInScene(known, real, "estimator.fiducial.tags", scenario.model);
  RequireFamily(scenario.plugins.ParamsOf<vision::FiducialParams>().family, tags, scene);
}

std::string TagsMjcf(const vision::FiducialParams& fiducial) {
  constexpr const char *kWhite = "0.896 0.896 0.888 1", *kBlack = "0.034 0.034 0.034 1";
  std::string bodies;
  for (const vision::TagParams& tag : fiducial.tags) {
    const vision::TagCells cells = vision::CellsOf(fiducial.family, tag.id);
    const double cell_m = tag.size_m / (cells.across - 2);
    const auto geom = [&](const std::string& name, double x_m, double thick_m, double column,
                          double row, double width, double height, const char* rgba) {
      bodies += fmt::format(
          "      <geom name=\"tag_{}_{}\" type=\"box\" size=\"{:.6g} {:.6g} {:.6g}\" "
          "pos=\"{:.6g} {:.6g} {:.6g}\" material=\"paint\" rgba=\"{}\"/>\n",
          tag.id, name, thick_m / 2, width * cell_m / 2, height * cell_m / 2, x_m,
          (cells.across / 2.0 - column - width / 2) * cell_m,
          (cells.across / 2.0 - row - height / 2) * cell_m, rgba);
    };
    bodies += fmt::format(
        "    <body name=\"tag_{0}\" pos=\"{1}\" quat=\"{2}\">\n"
        "      <site name=\"tag_{0}\" type=\"box\" size=\"0.00025 {3} {3}\"/>\n",
        tag.id, fmt::join(tag.p_MT_m, " "), fmt::join(tag.q_MT_wxyz, " "), tag.size_m / 2);
    geom("plate", 0.003, 0.004, 0, 0, cells.across, cells.across, kWhite);
    geom("black", 0.00075, 0.0005, 1, 1, cells.across - 2, cells.across - 2, kBlack);
    for (int row = 2; row < cells.across - 2; ++row)
      for (int column = 2; column < cells.across - 2; ++column) {
        const int first = column;
        while (cells(row, column)) ++column;  // as far as the black border
        if (column > first)
          geom(fmt::format("white_{}_{}", row, first), 0.00025, 0.0005, first, row, column - first,
               1, kWhite);
      }
    bodies += "    </body>\n";
  }
  return "<mujoco>\n  <body name=\"tags\">\n" + bodies + "  </body>\n</mujoco>\n";
}

void CheckMarker(const Scenario& scenario, const vehicle::Scene& scene) {
  if (scenario.marker_may_differ) return;
  std::vector<MarkerPart> known, real;
  for (const vision::BallParams& ball : scenario.marker.balls)
    known.push_back({"ball " + ball.name, ball.p_MQ_m, ball.radius_m});
  for (const vehicle::BallInScene& ball : scene.balls)
    real.push_back({"ball " + ball.name, ball.p_MQ, ball.radius_m});
  RequireInScene(known, real, "marker.balls", scenario.model);
  for (const MarkerPart& ball : real)
    if (std::ranges::find(known, ball.name, &MarkerPart::name) == known.end())
      throw ConfigError("marker.balls", ball.name + " of the scene is not known (" +
                                            scenario.model.path +
                                            "); set marker.may_differ to run all the same");
  if (const auto check = scenario.plugins.scene_hooks().check) check(scenario, scene);
}

}  // namespace turbidock::trial
