#include "experiments/estimators/compare_estimators.h"

#include <ctime>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "experiments/estimators/pagmo_estimator.h"
#include "experiments/fixed_view.h"
#include "experiments/nearest_name.h"
#include "sim/base/random.h"
#include "vision/blob_estimator.h"
#include "vision/rm_ga.h"

namespace turbidock::experiments {
namespace {

using Json = nlohmann::json;

double ProcessorTime_s() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Poses about a distance, all balls in both images.
std::vector<Pose> DrawPoses(double distance_m, int count, Rng* rng) {
  std::vector<Pose> poses;
  const auto within = [&](double half) { return rng->Uniform(-half, half); };
  for (int i = 0; i < count; ++i) {
    const double x_m = distance_m * (1 + within(0.05));
    const double side_m = std::max(0.0, 0.4 * x_m - 0.12);
    poses.push_back({FromYawPitchRoll(within(0.15), within(0.1), within(0.1)),
                     {x_m, within(side_m), within(0.75 * side_m)}});
  }
  return poses;
}

// What one estimator did with one pose.
struct OneRun {
  double error_m, rotation_rad, fitness, frame_s, evaluations;
};

OneRun RunOne(vision::PoseEstimator* estimator, const std::vector<StereoImage>& frames,
              const Pose& true_X_HM) {
  std::vector<double> times_s;
  double evaluations = 0;
  PoseEstimate last;
  for (const StereoImage& seen : frames) {
    const double start_s = ProcessorTime_s();
    last = estimator->Update(seen);
    times_s.push_back(ProcessorTime_s() - start_s);
    evaluations += static_cast<double>(last.evaluations);
  }
  return {(last.X_HM.p - true_X_HM.p).norm(), AngleBetween(last.X_HM.q, true_X_HM.q), last.fitness,
          *Median(times_s), evaluations / static_cast<double>(frames.size())};
}

// All milks, starts and estimators of a marker at a distance: [milk][estimator][start] of numbers.
std::string RunJob(const CompareOptions& options, MarkerKind marker, double distance_m) {
  Scenario scenario = RecognitionScenario(marker, options.assignments);
  const SeedTree seeds(static_cast<uint64_t>(scenario.seed));
  Rng rng = seeds.Stream(std::string("compare.") + NameOf(marker) + FormatNumber(distance_m));
  const std::vector<Pose> poses = DrawPoses(distance_m, options.starts, &rng);
  const std::vector<FixedView> views = DrawFixedViews(scenario, poses);
  const uint64_t seed = rng.NextU64();
  Json out = Json::array();
  std::vector<StereoImage> frames(static_cast<size_t>(options.frames));
  for (const double milk : options.milk_ml_m3) {
    scenario.optics.water.milk_ml_m3 = milk;
    std::vector<Json> by_estimator(options.estimators.size(), Json::array());
    for (size_t start = 0; start < views.size(); ++start) {
      const SeedTree start_seeds(seed + start);
      FixedCameras cameras(views[start], scenario, start_seeds);
      for (int64_t frame = 0; frame < options.frames; ++frame) {
        frames[static_cast<size_t>(frame)].frame = frame;
        cameras.Expose(frame, &frames[static_cast<size_t>(frame)]);
      }
      for (size_t e = 0; e < options.estimators.size(); ++e) {
        const auto estimator = MakeEstimator(options.estimators[e], scenario, seed + start);
        const OneRun o = RunOne(estimator.get(), frames, views[start].X_HM);
        by_estimator[e].push_back({o.error_m, o.rotation_rad, o.fitness, o.frame_s, o.evaluations});
      }
    }
    out.push_back(by_estimator);
  }
  return out.dump();
}

// The ranks between which the median lies with 95 % confidence, by the binomial distribution's
// normal approximation.
Interval MedianInterval(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto n = static_cast<double>(values.size());
  const double half = 0.98 * std::sqrt(n);
  const auto at = [&](double rank) {
    return values[static_cast<size_t>(std::clamp(rank, 0.0, n - 1))];
  };
  return {at(std::floor(0.5 * n - half)), at(std::ceil(0.5 * n + half) - 1)};
}

CompareRow RowOf(const RecognitionCell& cell, const std::string& estimator, const Json& starts,
                 const CompareOptions& options) {
  CompareRow row;
  row.cell = cell;
  row.estimator = estimator;
  std::vector<double> rotations_rad, times_s;
  for (const Json& start : starts) {
    const double error_m = start[0], rotation_rad = start[1];
    row.errors_m.push_back(error_m);
    rotations_rad.push_back(rotation_rad);
    row.fitness.push_back(start[2]);
    times_s.push_back(start[3]);
    row.evaluations_per_frame += start[4].get<double>() / static_cast<double>(starts.size());
    row.fitness_mean += start[2].get<double>() / static_cast<double>(starts.size());
    row.found += error_m <= options.found_m && rotation_rad <= options.found_rad;
    ++row.starts;
  }
  row.found_interval = WilsonInterval(row.found, row.starts);
  row.error_median_m = *Median(row.errors_m);
  row.error_median_interval_m = MedianInterval(row.errors_m);
  row.error_95_m = *Quantile(row.errors_m, 0.95);
  row.rotation_median_rad = *Median(rotations_rad);
  row.frame_s = *Median(times_s);
  return row;
}

std::vector<double> RanksOf(const std::vector<double>& values) {
  std::vector<size_t> order(values.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (size_t i = 0; i < order.size();) {  // equal values share the mean of their ranks
    size_t end = i + 1;
    while (end < order.size() && values[order[end]] == values[order[i]]) ++end;
    for (size_t j = i; j < end; ++j) ranks[order[j]] = 0.5 * static_cast<double>(i + end - 1);
    i = end;
  }
  return ranks;
}

}  // namespace

std::vector<std::string> EstimatorNames() {
  return {"default", "search", "published", "de", "pso", "cmaes", "blobs"};
}

std::unique_ptr<vision::PoseEstimator> MakeEstimator(const std::string& name,
                                                     const Scenario& scenario, uint64_t seed) {
  const StereoRig rig = scenario.rig.MakeRig();
  const auto rm_ga = [&](const vision::RmGaOptions& options) {
    return std::make_unique<vision::RmGa>(options, scenario.marker, scenario.hue, rig,
                                          SeedTree(seed).Stream("vision.rm_ga"));
  };
  const auto pagmo = [&](PagmoMethod method) {
    return MakePagmoEstimator({.method = method, .range = scenario.estimator.range},
                              scenario.marker, scenario.hue, rig, static_cast<uint32_t>(seed));
  };
  if (name == "default") return rm_ga(scenario.estimator);
  if (name == "search") {
    vision::RmGaOptions options = scenario.estimator;
    options.refine.enabled = false;
    return rm_ga(options);
  }
  if (name == "published") {
    vision::RmGaOptions options = vision::RmGaOptions::Published();
    options.range = scenario.estimator.range;
    return rm_ga(options);
  }
  if (name == "de") return pagmo(PagmoMethod::kDe);
  if (name == "pso") return pagmo(PagmoMethod::kPso);
  if (name == "cmaes") return pagmo(PagmoMethod::kCmaes);
  if (name == "blobs")
    return std::make_unique<vision::BlobEstimator>(vision::BlobParams{}, scenario.marker,
                                                   scenario.hue, rig);
  std::string known;
  for (const std::string& one : EstimatorNames()) known += (known.empty() ? "" : ", ") + one;
  throw ConfigError("estimator '" + name + "' is not known; there are " + known);
}

std::vector<CompareRow> CompareEstimators(const CompareOptions& options) {
  for (const std::string& name : options.estimators)  // bad names now, not in a worker
    MakeEstimator(name, RecognitionScenario(options.markers.front(), options.assignments), 0);
  std::vector<std::pair<MarkerKind, double>> jobs;
  for (const MarkerKind marker : options.markers)
    for (const double distance_m : options.distances_m) jobs.emplace_back(marker, distance_m);
  const std::vector<std::string> texts = ForkMap(
      static_cast<int>(jobs.size()),
      [&](int i) {
        const auto& [marker, distance_m] = jobs[static_cast<size_t>(i)];
        return RunJob(options, marker, distance_m);
      },
      options.run);
  std::vector<CompareRow> rows;
  for (size_t job = 0; job < texts.size(); ++job) {
    const Json result = Json::parse(texts[job]);
    for (size_t m = 0; m < options.milk_ml_m3.size(); ++m)
      for (size_t e = 0; e < options.estimators.size(); ++e)
        rows.push_back(RowOf({jobs[job].first, options.milk_ml_m3[m], jobs[job].second},
                             options.estimators[e], result[m][e], options));
  }
  return rows;
}

double FitnessErrorCorrelation(const std::vector<CompareRow>& rows, MarkerKind marker,
                               const std::string& estimator) {
  std::vector<double> errors, fitness;
  for (const CompareRow& row : rows) {
    if (row.cell.marker != marker || row.estimator != estimator) continue;
    errors.insert(errors.end(), row.errors_m.begin(), row.errors_m.end());
    fitness.insert(fitness.end(), row.fitness.begin(), row.fitness.end());
  }
  const std::vector<double> a = RanksOf(errors), b = RanksOf(fitness);
  const double middle = 0.5 * (static_cast<double>(a.size()) - 1);
  double ab = 0, aa = 0, bb = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - middle) * (b[i] - middle);
    aa += (a[i] - middle) * (a[i] - middle);
    bb += (b[i] - middle) * (b[i] - middle);
  }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

}  // namespace turbidock::experiments
