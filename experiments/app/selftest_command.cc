#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "experiments/app/build_table.h"
#include "experiments/app/commands.h"
#include "experiments/config/data_files.h"
#include "experiments/report/json.h"
#include "experiments/system/subprocess.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/trial.h"
#include "sim/check/physics_checks.h"
#include "sim/vehicle/scene.h"
#include "sim/view/gl_context.h"

namespace turbidock::app {
namespace {

struct Check {
  std::string name;
  std::function<std::string()> run;  // says what it saw; throws what is wrong
};

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

// A choice, not a need. In a process of its own, because each keeps to one kind of context.
std::string DrawWithEgl() {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  system::Subprocess run({program, "run", "pool_active", "--set", "renderer=egl", "--set",
                          "duration_s=0.01", "--quiet", "--json"},
                         "turbidock");
  const std::string renderer = report::ParseJson(run.Finish(), "turbidock run").at("renderer");
  return renderer.starts_with("EGL") ? renderer : "not usable here, would draw with " + renderer;
}

std::string RunOneSecond() {
  const trial::TrialResult result =
      trial::RunTrial(trial::LoadScenario("pool_active", {"duration_s=1", "docked_hold_s=0"}));
  if (result.outcome == trial::Outcome::kDiverged) throw SimulatorFault(result.reason);
  return fmt::format("1 s of pool_active: digest {}, {:.1f} x real time", result.digest,
                     result.real_time_factor);
}

std::string Expectation(const check::PhysicsCheck& check) {
  if (check.relation == check::Relation::kNear)
    return fmt::format("{:.6g} +- {:.2g}", check.expected, check.tolerance);
  return fmt::format("{} {:.5g}",
                     check.relation == check::Relation::kAtMost ? "<=" : ">=", check.expected);
}

// The dynamics against what they must do, as a table or as JSON.
int PhysicsSelftest(bool json) {
  std::vector<check::PhysicsCheck> checks = check::RunPhysicsChecks();
  for (check::PhysicsCheck& check : check::MeasurePhysicsCost(config::ModelPath("sea_active.xml")))
    checks.push_back(std::move(check));
  bool all_well = true;
  auto list = report::Json::array();
  if (!json)
    fmt::print("      {:52} {:>12}  {:22} {:6} {}\n", "check", "measured", "expected", "unit",
               "reference");
  for (const check::PhysicsCheck& check : checks) {
    all_well = all_well && check.pass();
    if (json)
      list.push_back({{"check", check.name},
                      {"pass", check.pass()},
                      {"measured", check.measured},
                      {"relation", check.relation},
                      {"expected", check.expected},
                      {"tolerance", check.tolerance},
                      {"unit", check.unit},
                      {"reference", check.reference}});
    else
      fmt::print("{}  {:52} {:12.6g}  {:22} {:6} {}\n", check.pass() ? "ok  " : "FAIL", check.name,
                 check.measured, Expectation(check), check.unit, check.reference);
  }
  if (json) fmt::print("{}", report::JsonText(list));
  return all_well ? kExitDone : kExitCheckFailed;
}

int Selftest(bool json) {
  const std::vector<Check> checks = {
      {"render", [] { return view::MakeGlContext(view::GlBackend::kOsmesa)->description(); }},
      {"egl", DrawWithEgl},
      {"scenarios", LoadEveryScenario},
      {"trial", RunOneSecond},
      {"figures",
       [] {
         return FirstLine({"gnuplot", "--version"}, "gnuplot-nox");
       }},
      {"video",
       [] {
         return FirstLine({"ffmpeg", "-version"}, "ffmpeg");
       }},
  };
  auto list = report::Json::array();
  for (const auto& [name, value] : BuildTable())
    if (!json) fmt::print("      {:10} {}\n", name, value);
  bool all_well = true;
  for (const Check& check : checks) {
    bool well = true;
    std::string saw;
    try {
      saw = check.run();
    } catch (const std::exception& error) {
      well = false;
      saw = error.what();
    }
    all_well = all_well && well;
    if (json)
      list.push_back({{"check", check.name}, {"pass", well}, {"saw", saw}});
    else
      fmt::print("{}  {:10} {}\n", well ? "ok  " : "FAIL", check.name, saw);
  }
  if (json) fmt::print("{}", report::JsonText(list));
  return all_well ? kExitDone : kExitSimulatorFault;
}

struct SelftestArguments {
  bool json = false, physics = false;
};

int RunSelftest(const SelftestArguments& arguments) {
  return arguments.physics ? PhysicsSelftest(arguments.json) : Selftest(arguments.json);
}

}  // namespace

void AddSelftest(CommandLine& line) {
  auto [selftest, arguments] =
      line.Add("selftest", "Show what this machine runs on, and that it can", &RunSelftest);
  selftest.Flag("--json", arguments.json, "As JSON");
  selftest.Flag("--physics", arguments.physics,
                "Instead: the vehicle's dynamics against closed forms, and their cost");
}

}  // namespace turbidock::app
