#include "experiments/studies/recognition/recognition.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <set>

#include "experiments/farm/farm.h"
#include "experiments/report/json.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/random.h"
#include "vision/rm_ga.h"

namespace turbidock::recognition {
namespace {

// The experiment's own limits, beside those of the water's milk.
constexpr double kNearest_m = 0.2, kFarthest_m = 10;

}  // namespace

std::vector<MarkerKind> MarkersOf(const std::string& name) {
  std::vector<MarkerKind> markers;
  for (const auto& [marker, known] : EnumNames<MarkerKind>::kNames)
    if (name == known || name == "both") markers.push_back(marker);
  return markers;
}

Area AreaOf(double fitness_mean) {
  constexpr trial::ViewCriteria kPublished;
  if (fitness_mean >= kPublished.docking_fitness) return Area::kI;
  return fitness_mean >= kPublished.detection_fitness ? Area::kII : Area::kIII;
}

void SetFitness(std::vector<float> fitness, CellResult* result) {
  const auto frames = static_cast<double>(fitness.size());
  double sum = 0, squares = 0;
  for (const float f : fitness) sum += static_cast<double>(f);
  result->fitness_mean = sum / frames;
  for (const float f : fitness) {
    const double difference = static_cast<double>(f) - result->fitness_mean;
    squares += difference * difference;
  }
  result->fitness_std = std::sqrt(squares / frames);
  result->area = AreaOf(result->fitness_mean);
  result->fitness = std::move(fitness);
}

std::vector<double> PublishedMilk(MarkerKind marker) {
  std::vector<double> milk;
  const auto add = [&](int steps, double step) {
    const double start = milk.empty() ? -step : milk.back();
    for (int i = 1; i <= steps; ++i) milk.push_back(start + i * step);
  };
  add(16, 2.435);
  add(17, 4.87);
  if (marker == MarkerKind::kActive) add(13, 9.74);
  return milk;
}

std::vector<double> PublishedDistances() { return {0.4, 0.6, 0.8, 1.0}; }

trial::Scenario RecognitionScenario(MarkerKind marker,
                                    const std::vector<std::string>& assignments) {
  std::vector<std::string> all = {fmt::format("model=tank_{}.xml", NameOf(marker)),
                                  "optics=published"};
  all.insert(all.end(), assignments.begin(), assignments.end());
  return trial::LoadScenario(fmt::format("pool_{}", NameOf(marker)), all);
}

Recognition::Recognition(std::map<MarkerKind, trial::Scenario> scenarios,
                         std::vector<RecognitionCell> cells)
    : scenarios_(std::move(scenarios)), cells_(std::move(cells)) {
  std::map<MarkerKind, std::set<double>> distances_m;
  for (const RecognitionCell& cell : cells_) {
    if (!(cell.milk_ml_m3 >= 0 && cell.milk_ml_m3 <= light::kMaxMilk_ml_m3))
      throw ConfigError("milk_ml_m3", FormatNumber(cell.milk_ml_m3) + " " +
                                          InRange(0, light::kMaxMilk_ml_m3).Sentence());
    if (!(cell.distance_m >= kNearest_m && cell.distance_m <= kFarthest_m))
      throw ConfigError(
          "distance_mm",
          FormatNumber(units::MmFromM(cell.distance_m)) + " " +
              InRange(units::MmFromM(kNearest_m), units::MmFromM(kFarthest_m)).Sentence());
    distances_m[cell.marker].insert(cell.distance_m);
  }
  for (const auto& [marker, distances] : distances_m) {
    std::vector<Pose> X_HM;
    for (const double distance_m : distances) X_HM.push_back(Pose::Translation(distance_m, 0, 0));
    for (trial::FixedView& view : trial::DrawFixedViews(scenarios_.at(marker), X_HM)) {
      const double distance_m = view.X_HM.p.x();
      views_.emplace(std::pair{marker, distance_m}, std::move(view));
    }
  }
}

SeedTree Recognition::SeedsOf(const RecognitionCell& cell) const {
  const SeedTree root(static_cast<uint64_t>(scenario(cell.marker).seed));
  return SeedTree(
      root.Stream(fmt::format("recognition {} {} {}", NameOf(cell.marker),
                              FormatNumber(cell.milk_ml_m3), FormatNumber(cell.distance_m)))
          .NextU64());
}

camera::StereoCamera Recognition::CamerasOf(const RecognitionCell& cell) const {
  trial::Scenario scenario = scenarios_.at(cell.marker);
  scenario.light.water.milk_ml_m3 = cell.milk_ml_m3;
  return trial::HoldView(view(cell), scenario, SeedsOf(cell));
}

StereoImage Recognition::Image(const RecognitionCell& cell, int64_t frame) const {
  StereoImage image;
  CamerasOf(cell).ExposeHeld(frame, &image);
  return image;
}

CellResult Recognition::RunCell(const RecognitionCell& cell,
                                const RecognitionOptions& options) const {
  const trial::FixedView& view = this->view(cell);
  const trial::Scenario& scenario = scenarios_.at(cell.marker);
  camera::StereoCamera cameras = CamerasOf(cell);
  vision::RmGa estimator(scenario.estimator, scenario.marker, scenario.hue, view.rig,
                         SeedsOf(cell).Stream("vision.rm_ga"));

  const int64_t settled = scenario.clock.FramesFor(options.settle_s);
  const int64_t last = settled + std::max<int64_t>(1, scenario.clock.FramesFor(options.seconds));
  StereoImage seen;
  CellResult result{.cell = cell};
  std::vector<float> fitness;
  for (int64_t frame = 0; frame < last; ++frame) {
    const std::optional<StereoRegion> region = estimator.Reach();
    if (region)
      cameras.ExposeHeld(*region, frame, &seen);
    else
      cameras.ExposeHeld(frame, &seen);
    const PoseEstimate& estimate = estimator.Update(seen);
    if (frame < settled) continue;
    fitness.push_back(static_cast<float>(estimate.fitness));
    result.position_error_mean_m += (estimate.X_HM.p - view.X_HM.p).norm();
    result.last_X_HM = estimate.X_HM;
  }
  result.position_error_mean_m /= static_cast<double>(last - settled);
  SetFitness(std::move(fitness), &result);
  return result;
}

std::string InputOf(const trial::Scenario& scenario, const RecognitionCell& cell,
                    const RecognitionOptions& options) {
  return report::JsonLine({{"scenario", trial::SaveScenario(scenario)},
                           {"marker", cell.marker},
                           {"milk_ml_m3", cell.milk_ml_m3},
                           {"distance_m", cell.distance_m},
                           {"seconds", options.seconds},
                           {"settle_s", options.settle_s}});
}

CellResult ResultOf(const RecognitionCell& cell, const std::string& output) {
  const report::Json json = report::ParseJson(output, "a worker's result");
  CellResult result{.cell = cell, .position_error_mean_m = json.at("error_m")};
  SetFitness(json.at("fitness").get<std::vector<float>>(), &result);
  json.at("q").get_to(result.last_X_HM.q);
  json.at("p").get_to(result.last_X_HM.p);
  return result;
}

farm::Work CellWork(const Recognition* drawn) {
  return {
      "recognition cell", [drawn](const std::string& input) {
        const report::Json json = report::ParseJson(input, "a cell");
        const RecognitionCell cell{.marker = MarkersOf(json["marker"]).front(),
                                   .milk_ml_m3 = json["milk_ml_m3"],
                                   .distance_m = json["distance_m"]};
        const RecognitionOptions options{.seconds = json["seconds"], .settle_s = json["settle_s"]};
        const auto run = [&] {
          if (drawn) return drawn->RunCell(cell, options);
          const Recognition alone(
              {{cell.marker, trial::ParseScenario(json["scenario"], "a cell's scenario")}}, {cell});
          return alone.RunCell(cell, options);
        };
        const CellResult result = run();
        return report::JsonLine({{"error_m", result.position_error_mean_m},
                                 {"fitness", result.fitness},
                                 {"q", result.last_X_HM.q},
                                 {"p", result.last_X_HM.p}});
      }};
}

std::vector<CellResult> Recognition::Run(const RecognitionOptions& options) const {
  std::vector<std::string> inputs;
  for (const RecognitionCell& cell : cells_)
    inputs.push_back(InputOf(scenario(cell.marker), cell, options));
  std::vector<CellResult> results(cells_.size());
  int done = 0;
  const auto take = [&](size_t i, const std::string& output) {
    results[i] = ResultOf(cells_[i], output);
    if (options.on_progress) options.on_progress(++done, static_cast<int>(cells_.size()));
  };
  const auto pool = farm::MakePool(options.farm, farm::kJobTimeLimit_s, CellWork(this));
  if (!farm::MapEach(pool.get(), inputs, take, options.stop_requested)) return {};
  return results;
}

}  // namespace turbidock::recognition
