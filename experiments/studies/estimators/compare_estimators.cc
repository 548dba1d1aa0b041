#include "experiments/studies/estimators/compare_estimators.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>

#include "experiments/config/yaml_fields.h"
#include "experiments/report/json.h"
#include "experiments/studies/estimators/pagmo_estimator.h"
#include "experiments/trial/fixed_view.h"
#include "sim/base/random.h"
#include "vision/blob_estimator.h"
#include "vision/fiducial_estimator.h"
#include "vision/fitness.h"
#include "vision/rm_ga.h"

namespace turbidock::estimators {
namespace {

using report::Json;

constexpr const char* kFiducialName = "fiducial";

double ProcessorTime_s() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// What one start shows: its frames, and where the marker is in them.
struct Start {
  std::vector<StereoImage> frames;
  std::vector<Pose> true_X_HM;  // one, or one for each frame

  const Pose& TrueAt(size_t frame) const {
    return true_X_HM[std::min(frame, true_X_HM.size() - 1)];
  }
};

// What one estimator did with one start.
struct OneRun {
  double error_m = 0, rotation_rad = 0, detected = 0, fitness = 0, frame_s = 0, evaluations = 0;
  int found_frame = 0;  // the first of those found without a break to the end, from 1; 0: none
  Pose true_X_HM;       // at the end

  TURBIDOCK_FIELDS(error_m, rotation_rad, detected, fitness, frame_s, evaluations, found_frame,
                   true_X_HM.p, true_X_HM.q)
};

bool IsFound(const CompareOptions& options, double error_m, double rotation_rad) {
  return error_m <= options.found_m && rotation_rad <= options.found_rad;
}

OneRun RunOne(const CompareOptions& options, vision::PoseEstimator* estimator, const Start& start) {
  const CompareTask task = options.task;
  const size_t frames = start.frames.size();
  const size_t first_judged = task == CompareTask::kAbsent ? 0
                              : task == CompareTask::kMoving
                                  ? static_cast<size_t>(kMovingSettleFrames)
                                  : frames - 1;
  std::vector<double> times_s;
  OneRun run;
  for (size_t i = 0; i < frames; ++i) {
    const double start_s = ProcessorTime_s();
    const PoseEstimate& estimate = estimator->Update(start.frames[i]);
    times_s.push_back(ProcessorTime_s() - start_s);
    run.evaluations += static_cast<double>(estimate.evaluations) / static_cast<double>(frames);
    run.fitness = estimate.fitness;
    const Pose& true_X_HM = start.TrueAt(i);
    const double error_m = (estimate.X_HM.p - true_X_HM.p).norm();
    const double rotation_rad = AngleBetween(estimate.X_HM.q, true_X_HM.q);
    if (!IsFound(options, error_m, rotation_rad))
      run.found_frame = 0;
    else if (run.found_frame == 0)
      run.found_frame = static_cast<int>(i) + 1;
    if (i < first_judged) continue;
    run.error_m = std::max(run.error_m, error_m);
    run.rotation_rad = std::max(run.rotation_rad, rotation_rad);
    run.detected += estimate.detected ? 1.0 / static_cast<double>(frames - first_judged) : 0;
  }
  run.frame_s = *statistics::Median(times_s);
  run.true_X_HM = start.true_X_HM.back();
  return run;
}

// Whether the image recognises the marker at its true pose as well as docking needs.
bool IsAreaI(const trial::Scenario& scenario, const StereoRig& rig, const Start& start) {
  vision::HueLabeller labeller(scenario.hue, scenario.marker);
  Stereo<Image1u8> labels;
  for (const Side side : kSides) labeller.Label(start.frames.front()[side], &labels[side]);
  const vision::Fitness fitness(scenario.marker, rig, labels);
  return recognition::AreaOf(fitness.Evaluate(start.TrueAt(0))) == recognition::Area::kI;
}

// Some starts of a marker at a distance.
struct Job {
  recognition::MarkerKind marker = recognition::MarkerKind::kActive;
  double distance_m = 0;  // 0: the task is not about one
  int first = 0, count = 0;
};

trial::Scenario PoolScenario(recognition::MarkerKind marker, const CompareOptions& options) {
  return trial::LoadScenario(fmt::format("pool_{}", NameOf(marker)), options.assignments, "",
                             options.plugins);
}

// Those that can find this marker.
std::vector<std::string> EstimatorsOf(recognition::MarkerKind marker,
                                      const CompareOptions& options) {
  std::vector<std::string> names = options.estimators;
  if (marker != recognition::MarkerKind::kFiducial) std::erase(names, kFiducialName);
  if (names.empty())
    throw ConfigError(fmt::format("estimator '{}' needs tags, which the {} marker does not have",
                                  kFiducialName, NameOf(marker)));
  return names;
}

// All milks, estimators and starts of a job: [milk][estimator][start].
std::string RunJob(const CompareOptions& options, const Job& job) {
  trial::Scenario scenario = PoolScenario(job.marker, options);
  const StereoRig rig = scenario.rig.MakeRig();
  Rng rng = SeedTree(static_cast<uint64_t>(scenario.seed))
                .Stream(std::string("compare.") + NameOf(job.marker) +
                        FormatNumber(job.distance_m) + "." + FormatNumber(job.first));
  const size_t milks = options.milk_ml_m3.size();
  const std::vector<std::string> estimators = EstimatorsOf(job.marker, options);
  std::vector<std::vector<std::vector<OneRun>>> out(
      milks, std::vector<std::vector<OneRun>>(estimators.size()));
  std::vector<int> done(milks, 0);
  // Where too little of the range is Area I, there are fewer starts.
  int candidates = 20 * job.count;
  while (candidates > 0 && std::ranges::any_of(done, [&](int n) { return n < job.count; })) {
    std::vector<std::vector<Pose>> starts;
    std::vector<Pose> poses;
    const int drawn = options.task == CompareTask::kMoving ? 1 : job.count;
    for (int i = 0; i < drawn; ++i, --candidates) {
      starts.push_back(
          DrawStart(options.task, job.distance_m, options.frames, scenario, rig, &rng));
      poses.insert(poses.end(), starts.back().begin(), starts.back().end());
    }
    const std::vector<trial::FixedView> views = trial::DrawFixedViews(scenario, poses);
    size_t first_view = 0;
    for (const std::vector<Pose>& true_X_HM : starts) {
      const uint64_t seed = rng.NextU64();
      for (size_t m = 0; m < milks; ++m) {
        if (done[m] == job.count) continue;
        scenario.light.water.milk_ml_m3 = options.milk_ml_m3[m];
        Start start{.frames = {}, .true_X_HM = true_X_HM};
        std::optional<camera::StereoCamera> cameras;
        for (int64_t frame = 0; frame < options.frames; ++frame) {
          const auto view = static_cast<size_t>(frame);
          if (view < true_X_HM.size())
            cameras.emplace(trial::HoldView(views[first_view + view], scenario, SeedTree(seed)));
          start.frames.emplace_back().frame = frame;
          cameras->ExposeHeld(frame, &start.frames.back());
          if (frame == 0 && options.task == CompareTask::kAnywhere &&
              !IsAreaI(scenario, rig, start))
            break;
        }
        if (start.frames.size() < static_cast<size_t>(options.frames)) continue;
        ++done[m];
        for (size_t e = 0; e < estimators.size(); ++e) {
          const auto estimator = MakeEstimator(estimators[e], scenario, seed);
          out[m][e].push_back(RunOne(options, estimator.get(), start));
        }
      }
      first_view += true_X_HM.size();
    }
  }
  return report::JsonLine(out);
}

// All that a task must know of a job.
std::string InputOf(const CompareOptions& options, const Job& job) {
  return report::JsonLine({{"task", options.task},
                           {"milk_ml_m3", options.milk_ml_m3},
                           {"estimators", options.estimators},
                           {"frames", options.frames},
                           {"found_m", options.found_m},
                           {"found_rad", options.found_rad},
                           {"assignments", options.assignments},
                           {"marker", job.marker},
                           {"distance_m", job.distance_m},
                           {"first", job.first},
                           {"count", job.count}});
}

// What jobs give, here or on a cluster.
std::vector<std::string> TextsOf(const CompareOptions& options, const std::vector<Job>& jobs) {
  if (!options.slurm)
    return farm::ForkMap(
        static_cast<int>(jobs.size()),
        [&](int i) { return RunJob(options, jobs[static_cast<size_t>(i)]); }, options.run);
  std::vector<std::string> inputs;
  inputs.reserve(jobs.size());
  for (const Job& job : jobs) inputs.push_back(InputOf(options, job));
  return farm::SlurmMap(CompareWork(options.plugins), inputs, *options.slurm, options.run);
}

// Where there are too few for one, between all values.
statistics::Interval MedianInterval(const std::vector<double>& values) {
  const auto [least, most] = std::ranges::minmax(values);
  return statistics::MedianInterval(values).value_or(statistics::Interval{least, most});
}

CompareRow RowOf(const recognition::RecognitionCell& cell, const std::string& estimator,
                 const std::vector<OneRun>& runs, const CompareOptions& options) {
  CompareRow row;
  row.cell = cell;
  row.estimator = estimator;
  row.starts = static_cast<int>(runs.size());
  std::vector<double> times_s;
  std::vector<int> found_frames;
  for (const OneRun& run : runs) {
    row.errors_m.push_back(run.error_m);
    row.rotations_rad.push_back(run.rotation_rad);
    row.fitness.push_back(run.fitness);
    row.detected += run.detected / row.starts;
    row.fitness_mean += run.fitness / row.starts;
    row.evaluations_per_frame += run.evaluations / row.starts;
    times_s.push_back(run.frame_s);
    const bool found = IsFound(options, run.error_m, run.rotation_rad);
    row.found += found;
    row.is_found.push_back(found);
    if (run.found_frame > 0) found_frames.push_back(run.found_frame);
    if (!found && options.task != CompareTask::kAbsent)
      row.misses.push_back({run.true_X_HM, run.error_m, run.rotation_rad, run.fitness});
  }
  if (row.starts == 0) return row;
  row.found_interval = statistics::WilsonInterval(row.found, row.starts);
  row.error_median_m = *statistics::Median(row.errors_m);
  row.error_median_interval_m = MedianInterval(row.errors_m);
  row.error_95_m = *statistics::Quantile(row.errors_m, 0.95);
  row.error_worst_m = *std::ranges::max_element(row.errors_m);
  row.rotation_median_rad = *statistics::Median(row.rotations_rad);
  row.rotation_median_interval_rad = MedianInterval(row.rotations_rad);
  row.rotation_95_rad = *statistics::Quantile(row.rotations_rad, 0.95);
  if (options.task == CompareTask::kStill || options.task == CompareTask::kAnywhere) {
    row.frames_median = FrameBy(0.5, found_frames, row.starts);
    row.frames_95 = FrameBy(0.95, found_frames, row.starts);
  }
  row.frame_s = *statistics::Median(times_s);
  return row;
}

}  // namespace

farm::Work CompareWork(const trial::Plugins& plugins) {
  return {"starts", [plugins](const std::string& input) {
            const Json json = report::ParseJson(input, "starts");
            CompareOptions options;
            options.plugins = plugins;
            for (const auto& [task, name] : EnumNames<CompareTask>::kNames)
              if (json["task"] == name) options.task = task;
            options.milk_ml_m3 = json["milk_ml_m3"].get<std::vector<double>>();
            options.estimators = json["estimators"].get<std::vector<std::string>>();
            options.frames = json["frames"];
            options.found_m = json["found_m"];
            options.found_rad = json["found_rad"];
            options.assignments = json["assignments"].get<std::vector<std::string>>();
            return RunJob(options, {.marker = recognition::MarkersOf(json["marker"]).front(),
                                    .distance_m = json["distance_m"],
                                    .first = json["first"],
                                    .count = json["count"]});
          }};
}

std::optional<int> FrameBy(double share, std::vector<int> found_frames, int starts) {
  const auto rank = static_cast<size_t>(std::ceil(share * starts));
  if (rank > found_frames.size()) return std::nullopt;
  std::sort(found_frames.begin(), found_frames.end());
  return found_frames[rank - 1];
}

std::vector<std::string> EstimatorNames() {
  return {"default", "search", "published", "de", "pso", "cmaes", "blobs"};
}

std::unique_ptr<vision::PoseEstimator> MakeEstimator(const std::string& name,
                                                     const trial::Scenario& scenario,
                                                     uint64_t seed) {
  const StereoRig rig = scenario.rig.MakeRig();
  const size_t slash = name.find('/');
  const std::string base = name.substr(0, slash);
  // Hands each of the name's assignments to `set`.
  const auto set_keys = [&](const std::function<void(const std::string&)>& set) {
    for (size_t first = slash; first != std::string::npos;) {
      const size_t end = name.find('/', first + 1);
      try {
        set(name.substr(first + 1, end - first - 1));
      } catch (const ConfigError& error) {
        throw ConfigError("estimator '" + name + "': " + error.what());
      }
      first = end;
    }
  };
  const auto rm_ga = [&](vision::RmGaOptions options) {
    set_keys([&](const std::string& key) { config::ApplySet(key, &options, nullptr); });
    return std::make_unique<vision::RmGa>(options, scenario.marker, scenario.hue, rig,
                                          SeedTree(seed).Stream("vision.rm_ga"));
  };
  if (base == "default") return rm_ga(scenario.estimator);
  if (base == "search") {
    vision::RmGaOptions options = scenario.estimator;
    options.refine = false;
    return rm_ga(options);
  }
  if (base == "published") {
    vision::RmGaOptions options = vision::RmGaOptions::Published();
    options.range = scenario.estimator.range;
    return rm_ga(options);
  }
  for (const auto& [method, known] : EnumNames<PagmoMethod>::kNames)
    if (name == known)
      return MakePagmoEstimator({.method = method, .range = scenario.estimator.range},
                                scenario.marker, scenario.hue, rig, static_cast<uint32_t>(seed));
  if (name == "blobs")
    return std::make_unique<vision::BlobEstimator>(vision::BlobParams{}, scenario.marker,
                                                   scenario.hue, rig);
  if (name == kFiducialName)
    return std::make_unique<vision::FiducialEstimator>(scenario.fiducial, rig);
  for (const std::string& own : scenario.plugins.estimators()) {
    if (base != own) continue;
    trial::Plugins plugins = scenario.plugins;
    set_keys([&](const std::string& key) { plugins.SetEstimatorKey(own, key); });
    return plugins.MakeEstimator(
        own, {scenario.marker, scenario.hue, rig, SeedTree(seed).Stream("vision." + own)});
  }
  std::vector<std::string> names = EstimatorNames();
  names.push_back(kFiducialName);
  for (const std::string& own : scenario.plugins.estimators()) names.push_back(own);
  throw ConfigError(fmt::format(
      "estimator '{}' is not known; there are {}, the first three also with keys of the "
      "search: default/creep_share=0",
      name, fmt::join(names, ", ")));
}

std::vector<CompareRow> CompareEstimators(const CompareOptions& options) {
  for (const recognition::MarkerKind marker : options.markers)  // bad names now, not in a worker
    for (const std::string& name : EstimatorsOf(marker, options))
      MakeEstimator(name, PoolScenario(marker, options), 0);
  if (options.task == CompareTask::kMoving && options.frames <= kMovingSettleFrames)
    throw ConfigError("frames " + FormatNumber(options.frames) + ", must be more than " +
                      FormatNumber(kMovingSettleFrames) + " for a moving marker");
  constexpr int kStartsOfJob = 25;
  const std::vector<double> distances_m =
      IsAboutDistance(options.task) ? options.distances_m : std::vector<double>{0};
  std::vector<Job> jobs;
  for (const recognition::MarkerKind marker : options.markers)
    for (const double distance_m : distances_m)
      for (int first = 0; first < options.starts; first += kStartsOfJob)
        jobs.push_back({marker, distance_m, first, std::min(kStartsOfJob, options.starts - first)});
  const std::vector<std::string> texts = TextsOf(options, jobs);
  // The starts of a marker at a distance, from one job or several.
  std::vector<CompareRow> rows;
  for (size_t first = 0, end; first < texts.size(); first = end) {
    std::vector<Json> parts;
    const Job& job = jobs[first];
    for (end = first; end < texts.size() && jobs[end].marker == job.marker &&
                      jobs[end].distance_m == job.distance_m;
         ++end)
      parts.push_back(report::ParseJson(texts[end], "runs of a worker"));
    const std::vector<std::string> estimators = EstimatorsOf(job.marker, options);
    for (size_t m = 0; m < options.milk_ml_m3.size(); ++m)
      for (size_t e = 0; e < estimators.size(); ++e) {
        std::vector<OneRun> runs;
        for (const Json& part : parts)
          for (const Json& run : part[m][e]) runs.push_back(run.get<OneRun>());
        rows.push_back(RowOf({job.marker, options.milk_ml_m3[m], job.distance_m}, estimators[e],
                             runs, options));
      }
  }
  return rows;
}

}  // namespace turbidock::estimators
