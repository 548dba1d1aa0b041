#include "experiments/studies/recognition/recognition.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <set>

#include "experiments/batch/job_options.h"
#include "experiments/trial/trial_view.h"
#include "sim/base/random.h"
#include "vision/rm_ga.h"

namespace turbidock::recognition {

Area AreaOf(double fitness_mean) {
  constexpr trial::ViewCriteria kPublished;
  if (fitness_mean >= kPublished.docking_fitness) return Area::kI;
  return fitness_mean >= kPublished.detection_fitness ? Area::kII : Area::kIII;
}

RecognitionCell CellOf(const report::Json& json) {
  const bool is_active = json["marker"] == NameOf(MarkerKind::kActive);
  return {is_active ? MarkerKind::kActive : MarkerKind::kPassive, json["milk_ml_m3"],
          json["distance_m"]};
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
  for (const RecognitionCell& cell : cells_) distances_m[cell.marker].insert(cell.distance_m);
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
    cameras.ExposeHeld(estimator.RegionOfInterest().value_or(WholeImages(view.rig)), frame, &seen);
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
                           {"cell", cell},
                           {"seconds", options.seconds},
                           {"settle_s", options.settle_s}});
}

batch::Work CellWork(const Recognition* drawn) {
  return {
      "recognition cell", [drawn](const std::string& input) {
        const report::Json json = report::ParseJson(input, "a cell");
        const RecognitionCell cell = CellOf(json["cell"]);
        const RecognitionOptions options{.seconds = json["seconds"], .settle_s = json["settle_s"]};
        std::optional<Recognition> alone;
        if (!drawn)
          alone.emplace(
              std::map{std::pair{cell.marker, trial::ParseScenario(json["scenario"], "a cell")}},
              std::vector{cell});
        const CellResult result = (alone ? *alone : *drawn).RunCell(cell, options);
        return report::JsonLine({{"error_m", result.position_error_mean_m},
                                 {"fitness", result.fitness},
                                 {"q", result.last_X_HM.q},
                                 {"p", result.last_X_HM.p}});
      }};
}

CellResult ResultOf(const RecognitionCell& cell, const std::string& output) {
  const report::Json json = report::ParseJson(output, "a worker's result");
  CellResult result{.cell = cell, .position_error_mean_m = json["error_m"]};
  SetFitness(json["fitness"], &result);
  json["q"].get_to(result.last_X_HM.q);
  json["p"].get_to(result.last_X_HM.p);
  return result;
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
  const auto pool = batch::MakePool(options.jobs, batch::kJobTimeLimit_s, CellWork(this));
  if (!batch::MapEach(pool.get(), inputs, take, options.stop_requested)) return {};
  return results;
}

}  // namespace turbidock::recognition
