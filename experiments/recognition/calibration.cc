#include "experiments/recognition/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <pagmo/algorithm.hpp>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>

#include "experiments/yaml_fields.h"
#include "sim/base/random.h"
#include "vision/fitness.h"
#include "vision/hue_labels.h"

namespace turbidock::experiments {
namespace {

// Reach of the marker's outermost sample points from its origin, and room for the climb.
constexpr double kMarkerReach_m = 0.105;
constexpr int kMargin_px = 8;

constexpr int kClimbSteps = 80, kRandomPoses = 150;

constexpr int kTiles_px = 32;

PixelRegion RegionAround(const CameraIntrinsics& camera, const Eigen::Vector3d& p_CM) {
  const Eigen::Vector2d center_px = camera.Project(p_CM);
  const double half_px = camera.fx_px * kMarkerReach_m / p_CM.z() + kMargin_px;
  // light is interpolated in tiles: with corners at multiples of their largest they are the whole's
  const auto low = [&](double center) {
    return std::max(0, static_cast<int>(center - half_px)) / kTiles_px * kTiles_px;
  };
  const auto high = [&](double center, int size) {
    return std::min(size, static_cast<int>(center + half_px) + 1);
  };
  return {low(center_px.x()), low(center_px.y()), high(center_px.x(), camera.width_px),
          high(center_px.y(), camera.height_px)};
}

template <class T, int kChannels>
void Crop(const PixelRegion& region, Image<T, kChannels>* image) {
  Image<T, kChannels> part(region.width(), region.height());
  for (int v = 0; v < region.height(); ++v)
    std::copy_n(image->at(region.column_begin, region.row_begin + v), region.width() * kChannels,
                part.row(v));
  *image = std::move(part);
}

void CropCamera(const PixelRegion& region, CameraIntrinsics* camera, sim::RenderedView* view) {
  camera->width_px = region.width();
  camera->height_px = region.height();
  camera->cx_px -= region.column_begin;
  camera->cy_px -= region.row_begin;
  Crop(region, &view->surface);
  Crop(region, &view->depth_m);
}

// A pose that only improves, by random steps from a tenth of a ball's radius to most of it.
struct Climber {
  Pose X_HM;
  double fitness = -1;

  void Climb(const vision::Fitness& f, int steps, Rng* rng) {
    fitness = f.Evaluate(X_HM);
    for (int i = 0; i < steps; ++i) {
      const double size_m = 0.0005 * std::pow(30.0, rng->Uniform());
      const double depth = 1 + 3 * size_m * rng->Normal() / X_HM.p.x();
      Eigen::Vector3d eps = X_HM.Canonical().q.vec();
      for (double& e : eps) e += 3 * size_m * rng->Normal();
      const Eigen::Vector3d shift_m(0, size_m * rng->Normal(), size_m * rng->Normal());
      const Pose next = Pose::FromVectorPart(depth * X_HM.p + shift_m, eps);
      const double value = f.Evaluate(next);
      if (value >= fitness) *this = {next, value};
    }
  }
};

Pose RandomPose(const vision::SearchRange& range, Rng* rng) {
  const auto draw = [&](double most) { return rng->Uniform(-most, most); };
  const double x_m = rng->Uniform(range.x_min_m, range.x_max_m);
  // within the region: the marker's direction is known to it
  const double lateral_m = 0.1 * x_m;
  return Pose::FromVectorPart({x_m, draw(lateral_m), draw(lateral_m)},
                              {draw(range.eps_max), draw(range.eps_max), draw(range.eps_max)});
}

double Rmse(const std::vector<double>& fitness, const std::vector<TableRow>& rows) {
  double sum = 0;
  for (size_t i = 0; i < rows.size(); ++i) {
    const double residual = fitness[i] - rows[i].fitness_mean;
    sum += residual * residual;
  }
  return std::sqrt(sum / static_cast<double>(rows.size()));
}

// The problem as pagmo sees it: places in [0, 1] in, RMSE out.
struct TableFit {
  std::function<double(const std::vector<double>&)> rmse;
  size_t dimension = 0;

  pagmo::vector_double fitness(const pagmo::vector_double& places) const { return {rmse(places)}; }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return {pagmo::vector_double(dimension, 0.0), pagmo::vector_double(dimension, 1.0)};
  }
};

struct Stopped {};

}  // namespace

void FreeParameter::Check(const std::string& path) const {
  if (!(low < high)) throw ConfigError(path + ".high", FormatNumber(high) + " must be > low");
  if (logarithmic && !(low > 0))
    throw ConfigError(path + ".low", FormatNumber(low) + " must be > 0 with logarithmic");
  if (!(low <= start && start <= high))
    throw ConfigError(path + ".start", FormatNumber(start) + " must lie from low to high");
}

double FreeParameter::ValueAt(double place) const {
  const double value = logarithmic ? low * std::pow(high / low, place) : low + (high - low) * place;
  return integer ? std::round(value) : value;
}

double FreeParameter::PlaceOf(double value) const {
  const double place =
      logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  return std::clamp(place, 0.0, 1.0);
}

std::string FreeParameter::Assignment(double value) const {
  const std::string number = FormatNumber(value);
  if (repeat == 1) return key + "=" + number;
  std::string list = key + "=[" + number;
  for (int i = 1; i < repeat; ++i) list += ", " + number;
  return list + "]";
}

void CalibrationPlan::Check(const std::string& path) const {
  if (parameters.empty())
    throw ConfigError(path.empty() ? "parameters" : path + ".parameters",
                      "there is nothing to calibrate");
}

CalibrationPlan LoadCalibrationPlan(const std::string& path) {
  return LoadLayers<CalibrationPlan>({path}, {});
}

FixedView CropToMarker(const FixedView& view) {
  FixedView crop = view;
  for (auto [camera, X_HC, seen] :
       {std::tuple{&crop.rig.left, crop.rig.X_HL, &crop.rendered.left},
        std::tuple{&crop.rig.right, crop.rig.X_HR, &crop.rendered.right}})
    CropCamera(RegionAround(*camera, X_HC.Inverse() * view.X_HM.p), camera, seen);
  return crop;
}

Surrogate::Surrogate(const CalibrationPlan& plan, const TableByMarker& tables) : plan_(plan) {
  for (const auto& [marker, table] : tables) {
    std::map<double, std::vector<TableRow>> columns;
    for (const TableRow& row : table) columns[row.cell.distance_m].push_back(row);
    std::vector<Pose> X_HM;
    for (auto& [distance_m, column] : columns) {
      X_HM.push_back(Pose::Translation(distance_m, 0, 0));
      std::sort(column.begin(), column.end(), [](const TableRow& a, const TableRow& b) {
        return a.cell.milk_ml_m3 < b.cell.milk_ml_m3;
      });
      const auto cells = static_cast<double>(column.size());
      const int chosen = std::max(1, static_cast<int>(std::lround(plan.cell_share * cells)));
      for (int i = 0; i < chosen; ++i)
        rows_.push_back(column[static_cast<size_t>((i + 0.5) * cells / chosen)]);
    }
    for (const FixedView& view : DrawFixedViews(RecognitionScenario(marker, {}), X_HM))
      views_.emplace(std::pair{marker, view.X_HM.p.x()}, Views{view, CropToMarker(view)});
  }
}

double Surrogate::CellFitness(const Scenario& base, const RecognitionCell& cell) const {
  const auto& [whole, view] = views_.at({cell.marker, cell.distance_m});
  Scenario scenario = base;
  scenario.optics.water.milk_ml_m3 = cell.milk_ml_m3;
  const SeedTree seeds(static_cast<uint64_t>(scenario.seed));
  FixedCameras cameras(view, scenario, seeds, &whole);
  Rng rng = seeds.Stream("calibration");
  vision::HueLabeller labeller(scenario.hue, scenario.marker);
  Image1u8 left, right;
  StereoImage seen;
  left.Resize(view.rig.left.width_px, view.rig.left.height_px);
  right.Resize(view.rig.right.width_px, view.rig.right.height_px);
  const vision::Fitness fitness(scenario.marker, view.rig, left, right);
  Climber near{view.X_HM}, anywhere{view.X_HM};
  double sum = 0;
  for (int frame = 0; frame < plan_.frames; ++frame) {
    cameras.Expose(frame, &seen);
    labeller.Label(seen.left, &left);
    labeller.Label(seen.right, &right);
    near.Climb(fitness, kClimbSteps, &rng);
    anywhere.fitness = fitness.Evaluate(anywhere.X_HM);
    for (int i = 0; i < kRandomPoses; ++i) {
      const Pose X_HM = RandomPose(scenario.estimator.range, &rng);
      const double value = fitness.Evaluate(X_HM);
      if (value > anywhere.fitness) anywhere = {X_HM, value};
    }
    anywhere.Climb(fitness, kClimbSteps, &rng);
    sum += std::max(near.fitness, anywhere.fitness);
  }
  return sum / plan_.frames;
}

std::vector<double> Surrogate::Fitness(const std::vector<std::string>& assignments,
                                       const ForkMapOptions& run) const {
  std::map<MarkerKind, Scenario> scenarios;
  for (const auto& [key, view] : views_)
    if (!scenarios.contains(key.first))
      scenarios.emplace(key.first, RecognitionScenario(key.first, assignments));
  const std::vector<std::string> texts = ForkMap(
      static_cast<int>(rows_.size()),
      [&](int i) {
        const RecognitionCell& cell = rows_[static_cast<size_t>(i)].cell;
        return FormatNumber(CellFitness(scenarios.at(cell.marker), cell));
      },
      run);
  std::vector<double> fitness;
  fitness.reserve(texts.size());
  for (const std::string& text : texts) fitness.push_back(std::stod(text));
  return fitness;
}

std::string CalibratedYaml(const CalibrationPlan& plan, const std::vector<double>& values) {
  YAML::Node root(YAML::NodeType::Map);
  for (size_t i = 0; i < plan.parameters.size(); ++i) {
    const std::string assignment = plan.parameters[i].Assignment(values[i]);
    const size_t equals = assignment.find('=');
    // a chain of maps, made as it is followed
    YAML::Node node = root;
    std::string key = assignment.substr(0, equals);
    for (size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.')) {
      node.reset(node[key.substr(0, dot)]);
      key.erase(0, dot + 1);
    }
    node[key] = YAML::Load(assignment.substr(equals + 1));
  }
  return YAML::Dump(root) + "\n";
}

CalibrationResult Calibrate(const CalibrationPlan& plan, const Surrogate& surrogate,
                            const CalibrationOptions& options) {
  const size_t n = plan.parameters.size();
  CalibrationResult result{.rmse = 10};
  std::vector<double> best_places(n);
  const auto rmse_at = [&](const std::vector<double>& places) {
    if (options.stop_requested && options.stop_requested()) throw Stopped();
    std::vector<std::string> assignments;
    for (size_t i = 0; i < n; ++i)
      assignments.push_back(plan.parameters[i].Assignment(plan.parameters[i].ValueAt(places[i])));
    return Rmse(surrogate.Fitness(assignments, {.workers = options.workers}), surrogate.rows());
  };
  const auto evaluate = [&](const std::vector<double>& places) {
    const double rmse = rmse_at(places);
    ++result.evaluations;
    if (rmse < result.rmse) {
      result.rmse = rmse;
      best_places = places;
    }
    if (options.on_progress) options.on_progress(result.evaluations, result.rmse);
    return rmse;
  };

  std::vector<double> places(n);
  for (size_t i = 0; i < n; ++i) places[i] = plan.parameters[i].PlaceOf(plan.parameters[i].start);
  try {
    const pagmo::problem problem(TableFit{evaluate, n});
    pagmo::population population(problem, 0, options.seed);
    population.push_back(places);
    // the first generation about the start, from which CMA-ES takes its mean
    Rng rng(options.seed, 0);
    const int size = 4 + static_cast<int>(3 * std::log(static_cast<double>(n)));
    for (int i = 1; i < size; ++i) {
      std::vector<double> near = places;
      for (double& place : near) place = std::clamp(place + 0.15 * rng.Normal(), 0.0, 1.0);
      population.push_back(near);
    }
    pagmo::algorithm cmaes(pagmo::cmaes(static_cast<unsigned>(options.generations), -1, -1, -1, -1,
                                        /*sigma0=*/0.2, 1e-6, 1e-6, /*memory=*/false,
                                        /*force_bounds=*/true, options.seed));
    cmaes.evolve(population);
    for (size_t i = 0; i < n; ++i) {
      std::pair<double, double> beside;
      for (const bool higher : {false, true}) {
        std::vector<double> moved = best_places;
        moved[i] = std::clamp(moved[i] + (higher ? 0.05 : -0.05), 0.0, 1.0);
        (higher ? beside.second : beside.first) = rmse_at(moved);
      }
      result.rmse_beside.push_back(beside);
    }
  } catch (const Stopped&) {
  }
  for (size_t i = 0; i < n; ++i)
    result.values.push_back(plan.parameters[i].ValueAt(best_places[i]));
  return result;
}

}  // namespace turbidock::experiments
