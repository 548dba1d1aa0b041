#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <opencv2/core/version.hpp>
#include <string>
#include <vector>

#include "experiments/app/commands.h"
#include "experiments/app/print_report.h"
#include "experiments/config/data_files.h"
#include "experiments/report/json.h"
#include "experiments/system/build_info.h"
#include "experiments/system/subprocess.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "sim/check/physics_checks.h"
#include "sim/vehicle/scene.h"
#include "sim/view/gl_context.h"

namespace turbidock::app {
namespace {

// The first line that a program of that package prints.
std::string FirstLine(const std::vector<std::string>& command, const std::string& package) {
  const std::string text = system::Subprocess(command, package).Finish();
  return text.substr(0, text.find('\n'));
}

std::string LoadEveryScenario() {
  const auto names = config::BundledNames("scenarios");
  for (const std::string& name : names)
    vehicle::LoadScene(trial::SceneFilesOf(trial::LoadScenario(name, {})), {});
  return fmt::format("{} bundled scenarios and their models load", names.size());
}

std::string RunOneSecond() {
  const trial::TrialResult result =
      trial::RunTrial(trial::LoadScenario("pool_active", {"duration_s=1", "docked_hold_s=0"}));
  if (result.outcome == trial::Outcome::kDiverged) throw SimulatorFault(result.reason);
  return fmt::format("1 s of pool_active: digest {}, {:.1f} x real time", result.digest,
                     result.real_time_factor);
}

// Checks as a table for people and a list for programs.
struct Checks {
  report::Table table;
  report::Json list = report::Json::array();
  bool all_pass = true;

  void Add(bool pass, std::vector<report::Cell> cells, report::Json json) {
    using report::Tone;
    cells.insert(cells.begin(),
                 pass ? report::Cell("ok", Tone::kGood, "") : report::Cell("FAIL", Tone::kBad, ""));
    table.Row(cells);
    json["pass"] = pass;
    list.push_back(json);
    all_pass = all_pass && pass;
  }
  // Passes with what `run` returns, unless it throws what is wrong.
  void AddRun(const std::string& name, std::string (*run)()) {
    const auto add = [&](bool pass, const std::string& saw) {
      Add(pass, {name, saw}, {{"name", name}, {"saw", saw}});
    };
    try {
      add(true, run());
    } catch (const std::exception& error) {
      add(false, error.what());
    }
  }
};

Checks CheckMachine() {
  Checks checks{report::Table({"<", "<check", "<saw"})};
  checks.AddRun("render",
                [] { return view::MakeGlContext(view::GlBackend::kOsmesa)->description(); });
  checks.AddRun("scenarios", LoadEveryScenario);
  checks.AddRun("trial", RunOneSecond);
  checks.AddRun("figures", [] { return FirstLine({"gnuplot", "--version"}, "gnuplot-nox"); });
  checks.AddRun("video", [] { return FirstLine({"ffmpeg", "-version"}, "ffmpeg"); });
  return checks;
}

std::string Expectation(const check::PhysicsCheck& check) {
  if (check.relation == check::Relation::kNear)
    return fmt::format("{:.6g} +- {:.2g}", check.expected, check.tolerance);
  return fmt::format("{} {:.5g}",
                     check.relation == check::Relation::kAtMost ? "<=" : ">=", check.expected);
}

// The dynamics against what they must do.
Checks CheckPhysics() {
  Checks checks{report::Table({"<", "<check", "measured", "<expected", "<unit", "<reference"})};
  for (const auto& part :
       {check::RunPhysicsChecks(), check::MeasurePhysicsCost(config::ModelPath("sea_active.xml"))})
    for (const check::PhysicsCheck& check : part)
      checks.Add(check.pass(),
                 {check.name, fmt::format("{:.6g}", check.measured), Expectation(check), check.unit,
                  check.reference},
                 check);
  return checks;
}

struct SelftestArguments {
  bool json = false, physics = false;
};

int Selftest(const SelftestArguments& arguments) {
  const Checks checks = arguments.physics ? CheckPhysics() : CheckMachine();
  report::Report report{.kind = "selftest", .title = "What this machine runs on"};
  for (const auto& [name, value] : BuildTable()) report.facts.push_back({name, value});
  report.sections = {{.title = "Checks", .table = checks.table}};
  PrintReport(report, {{"checks", checks.list}}, arguments.json);
  if (checks.all_pass) return kExitDone;
  return arguments.physics ? kExitCheckFailed : kExitSimulatorFault;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> BuildTable() {
  std::string mesa;
  try {
    mesa = view::MakeGlContext(view::GlBackend::kOsmesa)->description();
  } catch (const std::exception& error) {
    mesa = error.what();
  }
  return {{"turbidock", system::Version()},
          {"git", system::Commit()},
          {"compiler", system::Compiler()},
          {"build", system::BuildType()},
          {"MuJoCo", mj_versionString()},
          {"Mesa", mesa},
          {"OpenCV", CV_VERSION}};
}

void AddSelftest(CommandLine& line) {
  auto [selftest, arguments] =
      line.Add("selftest", "Show what this machine runs on, and that it can", &Selftest);
  selftest.Flag("--json", arguments.json, "As JSON");
  selftest.Flag("--physics", arguments.physics,
                "Instead: the vehicle's dynamics against closed forms, and their cost");
}

}  // namespace turbidock::app
