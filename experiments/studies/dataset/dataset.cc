#include "experiments/studies/dataset/dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

#include "experiments/batch/job_pool.h"
#include "experiments/media/canvas.h"
#include "experiments/media/png.h"
#include "experiments/report/json.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/fixed_view.h"
#include "sim/base/check.h"
#include "sim/base/units.h"
#include "sim/light/surfaces.h"
#include "vision/marker_model.h"

namespace turbidock::dataset {
namespace {

namespace fs = std::filesystem;
using report::Json;

constexpr int kMarkerId = 1;  // BOP's and COCO's number of the only object
constexpr const char* kSplit = "train_pbr";
constexpr uint8_t kInside = 255;

cv::Mat MatOf(const Image1u8& mask) {
  return {mask.height(), mask.width(), CV_8UC1, const_cast<uint8_t*>(mask.data())};
}

// BOP: x, y, width, height of the least rectangle about all set pixels; -1 where there are none.
Json BoxOf(const Image1u8& mask) {
  std::vector<cv::Point> set;
  cv::findNonZero(MatOf(mask), set);
  if (set.empty()) return {-1, -1, -1, -1};
  const auto [left, right] = std::ranges::minmax(set, {}, &cv::Point::x);
  const auto [top, bottom] = std::ranges::minmax(set, {}, &cv::Point::y);
  return {left.x, top.y, right.x - left.x + 1, bottom.y - top.y + 1};
}

int CountOf(const Image1u8& mask) { return cv::countNonZero(MatOf(mask)); }

// One camera's image with all that is known of it.
struct Labelled {
  Pose X_CM;
  Image1u8 whole, visible;
  std::vector<int64_t> ball_pixels;  // seen of each ball, in the marker's order
};

Labelled Label(const trial::Scenario& scenario, const trial::FixedView& view, Side side) {
  const MountedCamera& camera = view.rig[side];
  const Image1u16& surface_at = view.rendered[side].surface;
  Labelled out{.X_CM = camera.X_HC.Inverse() * view.X_HM,
               .whole = Image1u8(camera.width_px, camera.height_px),
               .visible = Image1u8(camera.width_px, camera.height_px),
               .ball_pixels = {}};

  const Pose X_WC = view.rendered.X_WH * camera.X_HC;
  std::vector<bool> is_marker(static_cast<size_t>(view.surfaces.size()) + 1, false);
  const double far_m = 2 * out.X_CM.p.norm() + 1;
  for (int geom = 0; geom < view.surfaces.size(); ++geom) {
    const light::Surface& surface = view.surfaces[geom];
    if (!surface.name.starts_with("marker_") && !surface.name.starts_with("ball_")) continue;
    is_marker[static_cast<size_t>(geom) + 1] = true;
    // The whole of it by rays, one a pixel, as if nothing else were there.
    const bool moored = surface.fixed_to == light::FixedTo::kMooredBody;
    const Pose X_SC =
        surface.X_AS.Inverse() * (moored ? view.rendered.X_WK.Inverse() * X_WC : X_WC);
    for (int v = 0; v < camera.height_px; ++v)
      for (int u = 0; u < camera.width_px; ++u) {
        if (*out.whole.at(u, v) != 0) continue;
        const Eigen::Vector3d ray_C((u - camera.cx_px) / camera.fx_px,
                                    (v - camera.cy_px) / camera.fy_px, 1);
        if (light::SegmentHits(surface, X_SC.p, X_SC * (far_m * ray_C)))
          *out.whole.at(u, v) = kInside;
      }
  }
  for (const vision::BallParams& ball : scenario.marker.balls) {
    const int geom = view.surfaces.Find("ball_" + ball.name);
    out.ball_pixels.push_back(
        geom < 0
            ? 0
            : std::count(surface_at.data(), surface_at.data() + surface_at.pixels(), geom + 1));
  }
  for (size_t i = 0; i < surface_at.pixels(); ++i)
    if (is_marker[surface_at.data()[i]]) out.visible.data()[i] = kInside;
  return out;
}

// The balls' centres: x, y, and 2 where some of the ball is seen, 1 where it is hidden, 0 (and no
// place) outside the image.
Json KeypointsOf(const trial::Scenario& scenario, const MountedCamera& camera,
                 const Labelled& labelled, int* seen) {
  Json points = Json::array();
  *seen = 0;
  for (size_t b = 0; b < scenario.marker.balls.size(); ++b) {
    const Eigen::Vector3d p_CQ = labelled.X_CM * scenario.marker.balls[b].p_MQ_m;
    const bool in_front = p_CQ.z() > vision::kNearestDepth_m;
    const Eigen::Vector2d at = in_front ? camera.Project(p_CQ) : Eigen::Vector2d(-1, -1);
    const bool inside = in_front && at.x() >= -0.5 && at.y() >= -0.5 &&
                        at.x() < camera.width_px - 0.5 && at.y() < camera.height_px - 0.5;
    const int visibility = !inside ? 0 : labelled.ball_pixels[b] > 0 ? 2 : 1;
    // COCO counts from the corner of the first pixel
    points.push_back(inside ? at.x() + 0.5 : 0);
    points.push_back(inside ? at.y() + 0.5 : 0);
    points.push_back(visibility);
    *seen += visibility > 0;
  }
  return points;
}

// The files of a shard's images, as far as they are made.
struct Shard {
  Json scene_camera = Json::object(), scene_gt = Json::object(), scene_gt_info = Json::object();
  Json images = Json::array(), annotations = Json::array();
};

void Add(const trial::Scenario& scenario, const batch::TrialSpec& spec,
         const trial::FixedView& view, Side side, const Image3u8& image, int number,
         const fs::path& folder, Shard* shard) {
  const MountedCamera& camera = view.rig[side];
  const Labelled labelled = Label(scenario, view, side);
  const std::string id = fmt::format("{:06}", number), key = std::to_string(number);
  media::WritePng((folder / "rgb" / (id + ".png")).string(), image);
  media::WritePng((folder / "mask" / (id + "_000000.png")).string(), labelled.whole);
  media::WritePng((folder / "mask_visib" / (id + "_000000.png")).string(), labelled.visible);

  shard->scene_camera[key] = {
      {"cam_K", {camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1}},
      {"depth_scale", 1},
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
  const int all = CountOf(labelled.whole), seen = CountOf(labelled.visible);
  const Json box = BoxOf(labelled.visible);
  shard->scene_gt_info[key] =
      Json::array({{{"bbox_obj", BoxOf(labelled.whole)},
                    {"bbox_visib", box},
                    {"px_count_all", all},
                    {"px_count_valid", all},
                    {"px_count_visib", seen},
                    {"visib_fract", all > 0 ? static_cast<double>(seen) / all : 0}}});

  shard->images.push_back({{"id", number},
                           {"file_name", "rgb/" + id + ".png"},
                           {"width", camera.width_px},
                           {"height", camera.height_px}});
  int keypoints = 0;
  const Json points = KeypointsOf(scenario, camera, labelled, &keypoints);
  if (seen == 0) return;  // nothing of it is seen: an image without an annotation
  const double left = box[0], top = box[1], right = left + box[2].get<double>(),
               bottom = top + box[3].get<double>();
  shard->annotations.push_back(
      {{"id", number + 1},
       {"image_id", number},
       {"category_id", kMarkerId},
       {"iscrowd", 0},
       {"area", seen},
       {"bbox", box},
       {"segmentation", {{left, top, right, top, right, bottom, left, bottom}}},
       {"num_keypoints", keypoints},
       {"keypoints", points}});
}

void MakeShard(const batch::Plan& plan, const fs::path& folder, int64_t first, int64_t count) {
  const fs::path part = folder.parent_path() / (".part-" + folder.filename().string());
  fs::remove_all(part);
  for (const char* kind : {"rgb", "mask", "mask_visib"}) fs::create_directories(part / kind);
  Shard shard;
  Json names = Json::array();
  for (int64_t i = 0; i < count; ++i) {
    const batch::TrialSpec spec = plan.Trial(first + i);
    const trial::Scenario scenario = plan.ScenarioOf(spec);
    const Pose X_HM = trial::DrawStart(scenario).Inverse();
    const std::vector<trial::FixedView> views = trial::DrawFixedViews(scenario, {X_HM});
    StereoImage seen;
    trial::HoldView(views[0], scenario, SeedTree(static_cast<uint64_t>(scenario.seed)))
        .ExposeHeld(0, &seen);
    for (const Side side : kSides)
      Add(scenario, spec, views[0], side, seen[side],
          static_cast<int>(2 * i) + (side == Side::kRight), part, &shard);
    if (names.empty())
      for (const vision::BallParams& ball : scenario.marker.balls) names.push_back(ball.name);
  }
  const auto write = [&](const char* name, const Json& json) {
    system::WriteWhole(part / name, report::JsonText(json));
  };
  write("scene_camera.json", shard.scene_camera);
  write("scene_gt.json", shard.scene_gt);
  write("scene_gt_info.json", shard.scene_gt_info);
  write("coco_keypoints.json", {{"info", {{"description", plan.settings().description}}},
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
  return {{"description", plan.settings().description},
          {"plan_hash", plan.hash()},
          {"build", system::BuildId()},
          {"pairs", plan.trials()},
          {"pairs_per_shard", options.pairs_per_shard},
          {"plan", plan.resolved()}};
}

void RequireSame(const fs::path& file, const Json& header) {
  const Json before = report::ParseJson(system::ReadWhole(file), file.string());
  for (const char* key : {"plan_hash", "pairs_per_shard", "build"})
    if (!before.is_object() || !before.contains(key) || before[key] != header[key])
      throw ConfigError(fmt::format(
          "{}: {} differs: the images there are of {}, these would be of {}", file.string(), key,
          before.is_object() ? before.value(key, Json()).dump() : "", header[key].dump()));
}

void WriteCommon(const batch::Plan& plan, const fs::path& folder) {
  const trial::Scenario scenario = plan.ScenarioOf(plan.Trial(0));
  const MountedCamera camera = scenario.rig.MakeRig().left;
  system::WriteWhole(folder / "camera.json", report::JsonText({{"cx", camera.cx_px},
                                                               {"cy", camera.cy_px},
                                                               {"depth_scale", 1},
                                                               {"fx", camera.fx_px},
                                                               {"fy", camera.fy_px},
                                                               {"height", camera.height_px},
                                                               {"width", camera.width_px}}));
  // The box of the box and the balls, in mm about the marker's origin.
  Eigen::Vector3d low = Eigen::Vector3d::Constant(-0.05), high = -low;
  for (const vision::BallParams& ball : scenario.marker.balls) {
    low = low.cwiseMin((ball.p_MQ_m.array() - ball.radius_m).matrix());
    high = high.cwiseMax((ball.p_MQ_m.array() + ball.radius_m).matrix());
  }
  const Eigen::Vector3d size = high - low;
  Json balls = Json::array();
  for (const vision::BallParams& ball : scenario.marker.balls)
    balls.push_back({{"name", ball.name},
                     {"center", Eigen::Vector3d(1000 * ball.p_MQ_m)},
                     {"radius", units::MmFromM(ball.radius_m)}});
  fs::create_directories(folder / "models");
  system::WriteWhole(folder / "models/models_info.json",
                     report::JsonText({{std::to_string(kMarkerId),
                                        {{"diameter", units::MmFromM(size.norm())},
                                         {"min_x", units::MmFromM(low.x())},
                                         {"min_y", units::MmFromM(low.y())},
                                         {"min_z", units::MmFromM(low.z())},
                                         {"size_x", units::MmFromM(size.x())},
                                         {"size_y", units::MmFromM(size.y())},
                                         {"size_z", units::MmFromM(size.z())},
                                         {"balls", balls}}}}));
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

DatasetSummary MakeDataset(const batch::Plan& plan, const std::string& folder,
                           const DatasetOptions& options) {
  const fs::path root(folder), split = root / kSplit, header_file = root / "dataset.json";
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
  std::vector<std::string> missing;
  const auto folder_of = [&](int64_t shard) { return split / fmt::format("{:06}", shard); };
  for (int64_t shard = 0; shard < summary.shards; ++shard)
    if (!fs::exists(folder_of(shard))) missing.push_back(std::to_string(shard));
  summary.shards_before = summary.shards - std::ssize(missing);
  const auto make = [&](const std::string& input) -> std::string {
    const int64_t shard = std::stoll(input), first = shard * per_shard;
    MakeShard(plan, folder_of(shard), first, std::min(per_shard, plan.trials() - first));
    return "";
  };
  const auto pool =
      batch::MakePool({.workers = options.workers}, batch::kJobTimeLimit_s, {"dataset", make});
  int done = 0;
  const auto count = [&](size_t, const std::string&) {
    if (options.on_progress) options.on_progress(++done, static_cast<int>(missing.size()));
  };
  summary.complete = batch::MapEach(pool.get(), missing, count, options.stop_requested);
  if (summary.complete)
    WriteContactSheet(root / "contact_sheet.png", plan.settings().description, folder_of,
                      summary.images, 2 * per_shard);
  return summary;
}

}  // namespace turbidock::dataset
