#include "experiments/studies/dataset/dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <span>
#include <utility>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "experiments/media/canvas.h"
#include "experiments/media/png.h"
#include "experiments/report/json.h"
#include "experiments/studies/dataset/mesh.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/fixed_view.h"
#include "experiments/trial/identity.h"
#include "experiments/trial/world.h"
#include "sim/base/check.h"
#include "sim/base/units.h"
#include "sim/light/surfaces.h"
#include "vision/marker_model.h"

namespace turbidock::dataset {
namespace {

namespace fs = std::filesystem;
using report::Json;

constexpr const char* kSplit = "train_pbr";
constexpr uint8_t kInside = 255;
constexpr double kDepthUnit_mm = 0.1;  // of a depth image: up to 6.5 m

// Of masks, nonzero inside.
int CountOf(const Image1u8& mask) {
  return static_cast<int>(std::ranges::count_if(std::span(mask.data(), mask.pixels()),
                                                [](uint8_t v) { return v != 0; }));
}

// BOP: x, y, width, height of the least rectangle about all set pixels; -1 where there are none.
// Pixel (0, 0) of the image is the mask's (left, top).
Json BoxOf(const Image1u8& mask, int left = 0, int top = 0) {
  int low_u = mask.width(), low_v = mask.height(), high_u = -1, high_v = -1;
  for (int v = 0; v < mask.height(); ++v)
    for (int u = 0; u < mask.width(); ++u) {
      if (*mask.at(u, v) == 0) continue;
      low_u = std::min(low_u, u), high_u = std::max(high_u, u);
      low_v = std::min(low_v, v), high_v = v;
    }
  if (high_u < 0) return {-1, -1, -1, -1};
  return {low_u - left, low_v - top, high_u - low_u + 1, high_v - low_v + 1};
}

// COCO's run lengths of a mask: down its columns, outside first.
Json RunsOf(const Image1u8& mask) {
  Json counts = Json::array();
  bool inside = false;
  int run = 0;
  for (int u = 0; u < mask.width(); ++u)
    for (int v = 0; v < mask.height(); ++v, ++run) {
      if ((*mask.at(u, v) != 0) == inside) continue;
      counts.push_back(std::exchange(run, 0));
      inside = !inside;
    }
  counts.push_back(run);
  return {{"counts", counts}, {"size", {mask.height(), mask.width()}}};
}

// One camera's image with all that is known of it.
struct Labelled {
  Pose X_CM;
  // The marker as if nothing else were there: as far as an image of three times the width and
  // height about this one reaches, as BOP counts it, and in the image.
  Image1u8 silhouette, whole;
  Image1u8 visible;
  std::vector<int> ball_geoms;  // in the marker's order
};

// From low to high, both included, of where a body of this radius about p_C may be seen.
std::pair<int, int> SpanOf(double across, double along, double radius, double f_px, double c_px,
                           int least, int most) {
  if (along - radius < vision::kNearestDepth_m) return {least, most};
  const auto at = [&](double side, double depth) {
    return c_px + f_px * (across + side * radius) / (along + depth * radius);
  };
  return {std::max(least, static_cast<int>(std::floor(std::min(at(-1, -1), at(-1, 1))))),
          std::min(most, static_cast<int>(std::ceil(std::max(at(1, -1), at(1, 1)))))};
}

// Adds a surface to the silhouette, by rays, one a pixel.
void AddSilhouette(const light::Surface& surface, const Pose& X_SC, const MountedCamera& camera,
                   Image1u8* silhouette) {
  const Eigen::Vector3d p_CS = X_SC.Inverse().p;
  const double radius = surface.size_m.sum(), far_m = 2 * (p_CS.norm() + radius);
  const int w = camera.width_px, h = camera.height_px;
  const auto [left, right] =
      SpanOf(p_CS.x(), p_CS.z(), radius, camera.fx_px, camera.cx_px, -w, 2 * w - 1);
  const auto [top, bottom] =
      SpanOf(p_CS.y(), p_CS.z(), radius, camera.fy_px, camera.cy_px, -h, 2 * h - 1);
  for (int v = top; v <= bottom; ++v)
    for (int u = left; u <= right; ++u) {
      uint8_t& pixel = *silhouette->at(u + w, v + h);
      const Eigen::Vector3d ray_C((u - camera.cx_px) / camera.fx_px,
                                  (v - camera.cy_px) / camera.fy_px, 1);
      if (pixel == 0 && light::SegmentHits(surface, X_SC.p, X_SC * (far_m * ray_C)))
        pixel = kInside;
    }
}

Labelled Label(const trial::Scenario& scenario, const trial::FixedView& view, Side side) {
  const MountedCamera& camera = view.rig[side];
  const int w = camera.width_px, h = camera.height_px;
  Labelled out{.X_CM = camera.X_HC.Inverse() * view.X_HM,
               .silhouette = Image1u8(3 * w, 3 * h),
               .whole = Image1u8(w, h),
               .visible = Image1u8(w, h),
               .ball_geoms = {}};

  const Pose X_WC = view.rendered.X_WH * camera.X_HC;
  std::vector<bool> is_marker(static_cast<size_t>(view.surfaces.size()) + 1, false);
  for (int geom = 0; geom < view.surfaces.size(); ++geom) {
    const light::Surface& surface = view.surfaces[geom];
    if (!surface.name.starts_with("marker_") && !surface.name.starts_with("ball_")) continue;
    is_marker[static_cast<size_t>(geom) + 1] = true;
    const bool moored = surface.fixed_to == light::FixedTo::kMooredBody;
    AddSilhouette(surface,
                  surface.X_AS.Inverse() * (moored ? view.rendered.X_WK.Inverse() * X_WC : X_WC),
                  camera, &out.silhouette);
  }
  for (const vision::BallParams& ball : scenario.marker.balls)
    out.ball_geoms.push_back(view.surfaces.Find("ball_" + ball.name));
  for (int v = 0; v < h; ++v)
    for (int u = 0; u < w; ++u) {
      uint8_t& all = *out.silhouette.at(u + w, v + h);
      // OpenGL and rays differ in pixels that the outline cuts
      if (is_marker[*view.rendered[side].surface.at(u, v)]) all = *out.visible.at(u, v) = kInside;
      *out.whole.at(u, v) = all;
    }
  return out;
}

// The balls' centres: x, y, and 2 where the image shows the ball there, 1 where something hides it,
// 0 (and no place) outside the image.
Json KeypointsOf(const trial::Scenario& scenario, const MountedCamera& camera,
                 const Image1u16& surface, const Labelled& labelled, int* seen) {
  Json points = Json::array();
  *seen = 0;
  for (size_t b = 0; b < scenario.marker.balls.size(); ++b) {
    const Eigen::Vector3d p_CQ = labelled.X_CM * scenario.marker.balls[b].p_MQ_m;
    const bool in_front = p_CQ.z() > vision::kNearestDepth_m;
    const Eigen::Vector2d at = in_front ? camera.Project(p_CQ) : Eigen::Vector2d(-1, -1);
    const bool inside = in_front && at.x() >= -0.5 && at.y() >= -0.5 &&
                        at.x() < camera.width_px - 0.5 && at.y() < camera.height_px - 0.5;
    const bool shown =
        inside && *surface.at(static_cast<int>(std::lround(at.x())),
                              static_cast<int>(std::lround(at.y()))) == labelled.ball_geoms[b] + 1;
    const int visibility = !inside ? 0 : shown ? 2 : 1;
    // COCO counts from the corner of the first pixel
    points.push_back(inside ? at.x() + 0.5 : 0);
    points.push_back(inside ? at.y() + 0.5 : 0);
    points.push_back(visibility);
    *seen += visibility > 0;
  }
  return points;
}

// In units of kDepthUnit_mm; 0 where there is nothing or it is too far.
Image1u16 DepthOf(const Image1f& depth_m) {
  Image1u16 depth(depth_m.width(), depth_m.height());
  for (size_t i = 0; i < depth.pixels(); ++i) {
    const double units = std::round(units::MmFromM(depth_m.data()[i]) / kDepthUnit_mm);
    depth.data()[i] = units <= UINT16_MAX ? static_cast<uint16_t>(units) : 0;
  }
  return depth;
}

// The files of a shard's images, as far as they are made.
struct Shard {
  Json scene_camera = Json::object(), scene_gt = Json::object(), scene_gt_info = Json::object();
  Json images = Json::array(), annotations = Json::array();
};

void Add(const trial::Scenario& scenario, const batch::TrialSpec& spec,
         const trial::FixedView& view, Side side, const Image3u8& image, int number,
         const fs::path& folder, bool depth, Shard* shard) {
  const MountedCamera& camera = view.rig[side];
  const Labelled labelled = Label(scenario, view, side);
  const std::string id = fmt::format("{:06}", number), key = std::to_string(number);
  media::WritePng((folder / "rgb" / (id + ".png")).string(), image);
  media::WritePng((folder / "mask" / (id + "_000000.png")).string(), labelled.whole);
  media::WritePng((folder / "mask_visib" / (id + "_000000.png")).string(), labelled.visible);
  if (depth)
    media::WritePng((folder / "depth" / (id + ".png")).string(),
                    DepthOf(view.rendered[side].depth_m));
  shard->scene_camera[key] = {
      {"cam_K", {camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1}},
      {"depth_scale", kDepthUnit_mm},
      {"camera", side == Side::kLeft ? "left" : "right"},
      {"trial", spec.trial},
      {"seed", spec.seed}};
  const Eigen::Matrix3d R_CM = labelled.X_CM.q.toRotationMatrix();
  Json rotation = Json::array(), translation = Json::array();
  for (int row = 0; row < 3; ++row)
    for (int col = 0; col < 3; ++col) rotation.push_back(R_CM(row, col));
  for (int row = 0; row < 3; ++row) translation.push_back(units::MmFromM(labelled.X_CM.p[row]));
  shard->scene_gt[key] =
      Json::array({{{"cam_R_m2c", rotation}, {"cam_t_m2c", translation}, {"obj_id", kMarkerId}}});
  const int all = CountOf(labelled.silhouette), seen = CountOf(labelled.visible);
  const Json box = BoxOf(labelled.visible);
  shard->scene_gt_info[key] =
      Json::array({{{"bbox_obj", BoxOf(labelled.silhouette, camera.width_px, camera.height_px)},
                    {"bbox_visib", box},
                    {"px_count_all", all},
                    {"px_count_valid", CountOf(labelled.whole)},
                    {"px_count_visib", seen},
                    {"visib_fract", all > 0 ? static_cast<double>(seen) / all : 0}}});

  shard->images.push_back({{"id", number},
                           {"file_name", "rgb/" + id + ".png"},
                           {"width", camera.width_px},
                           {"height", camera.height_px}});
  int keypoints = 0;
  const Json points =
      KeypointsOf(scenario, camera, view.rendered[side].surface, labelled, &keypoints);
  if (seen == 0) return;  // nothing of it is seen: an image without an annotation
  shard->annotations.push_back({{"id", number + 1},
                                {"image_id", number},
                                {"category_id", kMarkerId},
                                {"iscrowd", 0},
                                {"area", seen},
                                {"bbox", box},
                                {"segmentation", RunsOf(labelled.visible)},
                                {"num_keypoints", keypoints},
                                {"keypoints", points}});
}

// Of a dataset whose first trial's marker is this.
void RequireLabels(const trial::Scenario& scenario, const batch::TrialSpec& spec,
                   const std::string& marker) {
  if (scenario.lens.k1 != 0 || scenario.lens.k2 != 0)
    throw ConfigError("cameras.lens", "must be 0: labels are those of pinhole cameras");
  if (config::SaveYaml(scenario.marker) != marker)
    throw ConfigError(
        fmt::format("marker: that of trial {} is another one than that of trial 0; a "
                    "dataset has one",
                    spec.trial));
}

void MakeShard(const batch::Plan& plan, const fs::path& folder, int64_t first, int64_t count,
               bool depth) {
  const fs::path part = folder.parent_path() / (".part-" + folder.filename().string());
  fs::remove_all(part);
  for (const char* kind : {"rgb", "mask", "mask_visib"}) fs::create_directories(part / kind);
  if (depth) fs::create_directories(part / "depth");
  Shard shard;
  const std::string marker = config::SaveYaml(plan.ScenarioOf(plan.Trial(0)).marker);
  Json names = Json::array();
  for (int64_t i = 0; i < count; ++i) {
    const batch::TrialSpec spec = plan.Trial(first + i);
    const trial::Scenario scenario = plan.ScenarioOf(spec);
    trial::RequireSameFiles(scenario);
    RequireLabels(scenario, spec, marker);
    const auto views = trial::DrawFixedViews(scenario, {trial::StartPose(scenario).Inverse()});
    StereoImage seen;
    trial::HoldView(views[0], scenario, SeedTree(static_cast<uint64_t>(scenario.seed)))
        .ExposeHeld(0, &seen);
    for (const Side side : kSides)
      Add(scenario, spec, views[0], side, seen[side],
          static_cast<int>(2 * i) + (side == Side::kRight), part, depth, &shard);
    if (names.empty())
      for (const vision::BallParams& ball : scenario.marker.balls) names.push_back(ball.name);
  }
  const auto write = [&](const char* name, const Json& json) {
    system::WriteWhole(part / name, report::JsonText(json));
  };
  write("scene_camera.json", shard.scene_camera);
  write("scene_gt.json", shard.scene_gt);
  write("scene_gt_info.json", shard.scene_gt_info);
  write("coco_keypoints.json", {{"info", {{"description", plan.title()}}},
                                {"images", shard.images},
                                {"annotations", shard.annotations},
                                {"categories",
                                 {{{"id", kMarkerId},
                                   {"name", "marker"},
                                   {"supercategory", "dock"},
                                   {"keypoints", names},
                                   {"skeleton", {{1, 2}, {2, 3}, {3, 1}}}}}}});
  fs::rename(part, folder);
}

// What a folder's shards all have in common, and must have when it is gone on with.
Json HeaderOf(const batch::Plan& plan, const DatasetOptions& options) {
  return {{"description", plan.title()},
          {"plan_hash", plan.hash()},
          {"build", system::BuildId()},
          {"pairs", plan.trials()},
          {"pairs_per_shard", options.pairs_per_shard},
          {"depth", options.depth},
          {"plan", plan.resolved()}};
}

void RequireSame(const fs::path& file, const Json& header) {
  const Json before = report::ParseJson(system::ReadWhole(file), file.string());
  for (const char* key : {"plan_hash", "pairs_per_shard", "depth", "build"})
    if (!before.is_object() || !before.contains(key) || before[key] != header[key])
      throw ConfigError(fmt::format(
          "{}: {} differs: the images there are of {}, these would be of {}", file.string(), key,
          before.is_object() ? before.value(key, Json()).dump() : "", header[key].dump()));
}

void WriteCommon(const batch::Plan& plan, const fs::path& folder) {
  const trial::Scenario scenario = plan.ScenarioOf(plan.Trial(0));
  const MountedCamera camera = scenario.rig.MakeRig().left;
  system::WriteWhole(folder / "camera.json",
                     report::JsonText({{"baseline_mm", units::MmFromM(scenario.rig.baseline_m)},
                                       {"cx", camera.cx_px},
                                       {"cy", camera.cy_px},
                                       {"depth_scale", kDepthUnit_mm},
                                       {"fx", camera.fx_px},
                                       {"fy", camera.fy_px},
                                       {"height", camera.height_px},
                                       {"width", camera.width_px}}));
  WriteModel(scenario.marker, folder / "models");
}

// An image with what is seen of the marker tinted and the balls' centres circled.
void DrawLabelled(const fs::path& shard, size_t image, const media::PixelRect& into,
                  media::Canvas* sheet) {
  constexpr Rgb kSeen{80, 255, 120}, kHidden{255, 150, 60};
  const fs::path file = shard / "coco_keypoints.json";
  const Json coco = report::ParseJson(system::ReadWhole(file), file.string());
  Image3u8 picture = media::ReadPng(shard / coco["images"][image]["file_name"].get<std::string>());
  const Image3u8 mask = media::ReadPng(shard / fmt::format("mask_visib/{:06}_000000.png", image));
  for (size_t i = 0; i < 3 * picture.pixels(); ++i)
    if (mask.data()[i] != 0)
      picture.data()[i] = static_cast<uint8_t>((2 * picture.data()[i] + kSeen[i % 3]) / 3);
  const media::PixelRect drawn = sheet->DrawImage(picture, into);
  const double scale = static_cast<double>(drawn.width) / picture.width();
  for (const Json& annotation : coco["annotations"]) {
    if (annotation["image_id"] != image) continue;
    const auto points = annotation["keypoints"].get<std::vector<double>>();
    for (size_t k = 0; k < points.size(); k += 3) {
      if (points[k + 2] == 0) continue;
      const Eigen::Vector2d at(drawn.x + scale * points[k] - 0.5,
                               drawn.y + scale * points[k + 1] - 0.5);
      sheet->Circle(at, 5, 1.5, points[k + 2] == 2 ? kSeen : kHidden);
    }
  }
}

// A few images, evenly over all, as a person would check them.
void WriteContactSheet(const fs::path& file, const std::string& title,
                       const std::function<fs::path(int64_t)>& folder_of, int64_t images,
                       int64_t images_per_shard) {
  constexpr int kColumns = 4, kMost = 24, kWidth = 320, kHeight = 240, kText = 22;
  const auto shown = static_cast<int>(std::min<int64_t>(images, kMost));
  media::Canvas sheet(kColumns * kWidth, kText + (kHeight + kText) * ((shown - 1) / kColumns + 1));
  constexpr Rgb kInk{225, 230, 235};
  sheet.Text({8, 16}, title + ": seen of the marker green, hidden balls orange", 14, kInk);
  for (int i = 0; i < shown; ++i) {
    const int64_t image = i * images / shown, shard = image / images_per_shard;
    const int x = i % kColumns * kWidth, y = kText + i / kColumns * (kHeight + kText);
    DrawLabelled(folder_of(shard), static_cast<size_t>(image % images_per_shard),
                 {x, y, kWidth, kHeight}, &sheet);
    sheet.Text({x + 8.0, y + kHeight + 16.0},
               fmt::format("{:06}/rgb/{:06}.png", shard, image % images_per_shard), 12, kInk);
  }
  media::WritePng(file.string(), sheet.ToImage());
}

}  // namespace

std::vector<batch::PlanKey> RefusedKeys() {
  return {batch::kNoRanges,
          {"precision", "a dataset has `seeds` pairs of images in each cell; give --seeds"},
          {"trial_time_limit_s", "no trial runs: images are made"},
          {"series_every_frames", "no trial runs: there is no log"}};
}

batch::Work ShardWork(const trial::Plugins& plugins) {
  return {"dataset", [plugins](const std::string& input) -> std::string {
            const Json job = report::ParseJson(input, "a shard");
            const batch::Plan plan(job["plan"], "plan", {.plugins = plugins});
            MakeShard(plan, job["folder"].get<std::string>(), job["first"], job["count"],
                      job["depth"]);
            return "";
          }};
}

DatasetSummary MakeDataset(const batch::Plan& plan, const std::string& folder,
                           const DatasetOptions& options) {
  // absolute, for whoever makes a shard
  const fs::path root = fs::absolute(folder), split = root / kSplit,
                 header_file = root / "dataset.json";
  const std::string marker = config::SaveYaml(plan.ScenarioOf(plan.Trial(0)).marker);
  for (int64_t cell = 0; cell < plan.cells(); ++cell) {
    const batch::TrialSpec spec = plan.FirstOf(cell);
    RequireLabels(plan.ScenarioOf(spec), spec, marker);
  }
  const Json header = HeaderOf(plan, options);
  fs::create_directories(split);
  if (fs::exists(header_file)) {
    RequireSame(header_file, header);
  } else {
    WriteCommon(plan, root);
    system::WriteWhole(header_file, report::JsonText(header));
  }

  const int64_t per_shard = options.pairs_per_shard;
  DatasetSummary summary{.shards = (plan.trials() + per_shard - 1) / per_shard,
                         .images = 2 * plan.trials()};
  const std::string resolved = plan.resolved();
  std::vector<std::string> missing;
  const auto folder_of = [&](int64_t shard) { return split / fmt::format("{:06}", shard); };
  for (int64_t shard = 0; shard < summary.shards; ++shard) {
    const int64_t first = shard * per_shard;
    if (!fs::exists(folder_of(shard)))
      missing.push_back(report::JsonLine({{"plan", resolved},
                                          {"folder", folder_of(shard).string()},
                                          {"first", first},
                                          {"count", std::min(per_shard, plan.trials() - first)},
                                          {"depth", options.depth}}));
  }
  summary.shards_before = summary.shards - std::ssize(missing);
  const auto pool =
      batch::MakePool(options.jobs, batch::kJobTimeLimit_s, ShardWork(plan.plugins()));
  int done = 0;
  const auto count = [&](size_t, const std::string&) {
    if (options.on_progress) options.on_progress(++done, static_cast<int>(missing.size()));
  };
  summary.complete = batch::MapEach(pool.get(), missing, count, options.stop_requested);
  if (summary.complete)
    WriteContactSheet(root / "contact_sheet.png", plan.title(), folder_of, summary.images,
                      2 * per_shard);
  return summary;
}

}  // namespace turbidock::dataset
