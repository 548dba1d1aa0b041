#include <fmt/format.h>

#include <array>
#include <utility>

#include "experiments/studies/estimate/estimate.h"
#include "experiments/system/build_info.h"
#include "sim/base/pose.h"
#include "sim/base/units.h"

namespace turbidock::estimate {
namespace {

using report::Fixed;
using report::Json;

// Standard deviations of three coordinates.
std::optional<Eigen::Vector3d> DeviationsOf(const PoseEstimate& estimate, int first) {
  if (!estimate.covariance) return std::nullopt;
  return Eigen::Vector3d(estimate.covariance->diagonal().segment<3>(first).cwiseSqrt());
}

Json ToJson(const PoseEstimate& estimate, const EstimateSettings& settings) {
  const auto by_ball = [&](const std::vector<double>& values) {
    Json balls;
    for (size_t b = 0; b < values.size(); ++b) balls[settings.marker.balls[b].name] = values[b];
    return balls;
  };
  Json second;  // null where there is one answer
  if (estimate.second)
    second = {{"position_m", estimate.second->X_HM.p},
              {"quaternion_wxyz", estimate.second->X_HM.q},
              {"weight", estimate.second->weight}};
  return {{"detected", estimate.detected},
          {"position_m", estimate.X_HM.p},
          {"quaternion_wxyz", estimate.X_HM.q},
          {"second", second},
          {"fitness", estimate.fitness},
          {"ball_fitness", by_ball(estimate.ball_fitness)},
          {"ball_support", by_ball(estimate.ball_support)},
          {"position_deviation_m", DeviationsOf(estimate, 0)},
          {"rotation_deviation_rad", DeviationsOf(estimate, 3)}};
}

// Position and F over frames.
report::Section OverFrames(const std::vector<Json>& records) {
  std::vector<report::Panel> panels;
  for (const char* label : {"x, mm", "y, mm", "z, mm"})
    panels.push_back({.y = {label}, .series = {{.color = report::CurveColor(panels.size())}}});
  panels.push_back({.x = {"frame"}, .y = {"F", -0.25, 1}, .series = {{}}});
  for (const Json& record : records) {
    const double frame = record["frame"];
    for (size_t i = 0; i < 3; ++i) {
      const double mm = units::MmFromM(record["position_m"][i].get<double>());
      panels[i].series[0].points.push_back({frame, record["detected"] ? mm : report::kOpen});
    }
    panels[3].series[0].points.push_back({frame, record["fitness"]});
  }
  return {.title = "Marker in the camera head",
          .note =
              "Where it was found, each axis on its own scale; F: how well the pixels agree with "
              "it there, 1 at best.",
          .panels = panels,
          .stacked = true,
          .wide = true};
}

}  // namespace

Json RecordOf(const EstimatedFrame& frame, const EstimateSettings& settings) {
  Json json = {{"frame", frame.estimate.frame}};
  json.update(ToJson(frame.estimate, settings));
  json["evaluations"] = frame.estimate.evaluations;
  return json;
}

report::Report ReportOf(const EstimateSummary& summary, const std::vector<Json>& records) {
  const PoseEstimate& e = summary.last;
  const Eigen::Vector3d p_mm = units::MmFromM(1) * e.X_HM.p;
  report::Report report{
      .kind = "estimate",
      .title = "Pose of the marker in images",
      .build = system::VersionAndCommit(),
      .verdict = {e.detected ? "detected" : "not detected",
                  e.detected ? report::Tone::kGood : report::Tone::kBad,
                  fmt::format("F {:.3f} after {} frames and {} evaluations.", e.fitness,
                              summary.frames, summary.evaluations)},
      .facts = {{"position, mm",
                 fmt::format("x {:.1f}, y {:.1f}, z {:.1f}", p_mm.x(), p_mm.y(), p_mm.z()),
                 fmt::format("in the camera head, of frame {}", e.frame)},
                {"quaternion, w x y z", fmt::format("{:.5f} {:.5f} {:.5f} {:.5f}", e.X_HM.q.w(),
                                                    e.X_HM.q.x(), e.X_HM.q.y(), e.X_HM.q.z())}}};
  if (const auto p_m = DeviationsOf(e, 0); p_m && e.detected)
    report.facts.push_back(
        {"standard deviations",
         fmt::format("{:.2f}, {:.2f}, {:.2f} mm", units::MmFromM(p_m->x()),
                     units::MmFromM(p_m->y()), units::MmFromM(p_m->z())),
         Fixed(units::DegFromRad(DeviationsOf(e, 3)->maxCoeff()), 2) + "° at most"});
  report.facts.push_back({"baseline, mm", Fixed(units::MmFromM(summary.baseline_m), 1),
                          fmt::format("both cameras see {:.0f} % of where the marker is looked for",
                                      100 * summary.range_seen)});
  if (!summary.incomplete.empty())
    report.missing.push_back("Incomplete: " + summary.incomplete + ".");
  for (const std::string& note : summary.notes) report.missing.push_back(note);
  if (!e.detected)
    report.missing.push_back("The marker was not found: the position is a guess, and so is F.");
  else if (!e.covariance)
    report.missing.push_back("The estimate was not refined: it has no standard deviations.");
  if (e.second)
    report.missing.push_back(
        fmt::format("Another pose fits the images, {:.0f} mm and {:.1f}° from this one, with a "
                    "probability of {:.2f}.",
                    units::MmFromM((e.second->X_HM.p - e.X_HM.p).norm()),
                    units::DegFromRad(AngleBetween(e.second->X_HM.q, e.X_HM.q)), e.second->weight));
  if (records.size() > 1) report.sections = {OverFrames(records)};
  return report;
}

Json ResultJson(const EstimateSummary& summary, const EstimateSettings& settings,
                const std::vector<Json>& records) {
  Json json = ToJson(summary.last, settings);
  json["covariance"] = summary.last.covariance;
  json["frames"] = summary.frames;
  json["evaluations"] = summary.evaluations;
  json["baseline_m"] = summary.baseline_m;
  json["range_seen"] = summary.range_seen;
  json["notes"] = summary.notes;
  json["complete"] = summary.incomplete.empty();
  json["incomplete_reason"] = summary.incomplete.empty() ? Json() : Json(summary.incomplete);
  json["records"] = records;
  return json;
}

}  // namespace turbidock::estimate
