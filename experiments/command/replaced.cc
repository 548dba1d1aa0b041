#include <map>
#include <string>
#include <utility>

#include "experiments/command/command_line.h"

namespace turbidock::command {
namespace {

// What follows the program's name, by command.
const std::map<std::string, std::pair<const char*, const char*>> kExamples = {
    {"batch",
     {"batch turbidity_sweep --seeds 6 --out sweep.db",
      "batch turbidity_sweep --set sea.state=calm --out sweep.db --slurm 20 --workers 4"}},
    {"bench", {"bench", "bench sea_night_active --frames 300 --repeats 5 --json"}},
    {"calibrate", {"calibrate", "calibrate --generations 40 --workers 4 --out found.yaml"}},
    {"check-vehicle", {"check-vehicle vehicle.xml", "check-vehicle mine.xml --out report"}},
    {"compare",
     {"compare before.db after.db", "compare a.db b.db --ignore controller --figure compare.pdf"}},
    {"dataset",
     {"dataset detector_images --seeds 2 --out images",
      "dataset detector_images --workers 4 --out images"}},
    {"estimate",
     {"estimate --left left.mp4 --right right.mp4 --rig rig.yaml",
      "estimate --left 'left_*.png' --right 'right_*.png' --overlay seen.mp4 --json"}},
    {"gate", {"gate gate.yaml --out report", "gate gate.yaml --set controller=lqg --json"}},
    {"list", {"list", "list keys | grep milk"}},
    {"merge",
     {"merge all.db part1.db part2.db", "merge --complete all.db part1.db part2.db part3.db"}},
    {"recognize",
     {"recognize recognition_active --seconds 5 --out cells.db",
      "recognize recognition_passive --workers 4 --figure recognition.png"}},
    {"replay", {"replay sweep.db 17", "replay sweep.db 17 --no-video --out trial-17"}},
    {"report", {"report sweep.db --out sweep.html", "report out --out trial.html"}},
    {"run",
     {"run pool_active --seed 7",
      "run sea_night_active --set water.milk_ml_m3=20 --out out --video --report"}},
    {"status", {"status sweep.db", "status sweep.db --by sea.state --over water.milk_ml_m3"}},
    {"step-response", {"step-response", "step-response pool_active --axis yaw --out response"}},
    {"tune", {"tune tryout --out tuned", "tune mine.yaml --out tuned --workers 4"}},
    {"view", {"view pool_active", "view sea_night_active --set water.milk_ml_m3=20 --port 8080"}},
};

// "command" or "command --option --option", and what took its place.
const std::pair<std::string, const char*> kReplaced[] = {
    {"scenarios", "turbidock list scenarios, list keys, list --show SCENARIO"},
    {"plans", "turbidock list plans"},
    {"studies", "turbidock list studies"},
    {"list --json", "the same as text; Python: turbidock.keys(), turbidock.scenarios()"},
    {"selftest",
     "--version for what it was built from; run pool_active --out FOLDER --video uses all it "
     "needs"},
    {"slurm", "turbidock batch PLAN --out FILE --slurm TASKS, or --shard I/N and merge"},
    {"curve", "turbidock status FILE --over KEY, report FILE --figure PNG --over KEY"},
    {"verify", "turbidock replay FILE TRIAL, which compares digests"},
    {"report --trial", "turbidock replay FILE TRIAL --out FOLDER, report FOLDER"},
    {"report --ignore", "turbidock compare A B --ignore KEY --out FILE.html"},
    {"export", "sqlite3 -header -csv FILE 'SELECT * FROM results'; Python: turbidock.read_results"},
    {"run --resolution", "--set rig.width_px=320 --set rig.height_px=240"},
    {"bench --resolution", "--set rig.width_px=320 --set rig.height_px=240"},
    {"view --quality", "nothing: pictures have a JPEG quality of 80"},
    {"gate --max-trials", "max_trials in the gate's file"},
    {"gate --rate --margin --alpha --beta",
     "margins.success_rate, alpha and beta in the gate's file"},
    {"gate --simulate --design --plan-size",
     "gate GATE.yaml, whose report says exactly which loss each condition would have seen"},
    {"gate --figure", "gate --out FOLDER, whose report.html has the verdict; nothing is drawn"},
    {"compare --metrics", "time, tracking error, effort and final error, always"},
    {"step-response --cameras", "--set pose_source=cameras"},
    {"step-response --true-pose", "nothing: true poses are the default"},
    {"step-response --no-noise", "--set true_pose.noise=[0, 0, 0, 0]"},
    {"step-response --turn --step --force",
     "a step of 5° and of 5 cm, a push of 1 N or 0.1 N m, always"},
    {"step-response --amplitude", "sinusoids of 12 % of what the vehicle can give, always"},
    {"step-response --sea", "nothing: it is measured in still water"},
    {"check-vehicle --names", "the table in models/names.md"},
    {"bench --workers", "turbidock batch with --workers, which says its trials an hour"},
    {"estimate --preset", "--set estimator.preset=published"},
    {"estimate --fps", "30 frames a second"},
    {"estimate --csv", "its records in --json, one a frame"},
    {"estimate --wall-clock", "--set estimator.generations_per_frame=20"},
    {"recognize --csv", "its cells in --json"},
    {"recognize --marker --distances --milk",
     "a plan: turbidock recognize recognition_active, or a copy of it with fewer cells"},
    {"recognize --table", "--active FILE or --passive FILE"},
    {"calibrate --seconds", "turbidock recognize PLAN --gains FILE with the values found"},
    {"compare-estimators",
     "turbidock recognize PLAN --set pose_estimator=NAME, once for each; right and wrong_and_sure "
     "in "
     "--json"},
};

}  // namespace

std::string ExamplesOf(const std::string& command) {
  const auto found = kExamples.find(command);
  if (found == kExamples.end()) return "";
  const auto& [first, second] = found->second;
  return std::string("Examples:\n  turbidock ") + first + "\n  turbidock " + second;
}

std::string ReplacedOn(int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i], option = " " + word.substr(0, word.find('=')) + " ";
    for (const auto& [gone, now] : kReplaced) {
      const bool is_option = gone.starts_with(std::string(argv[1]) + " --");
      if (i == 1 ? gone == word : is_option && (gone + " ").find(option) != std::string::npos)
        return (i == 1 ? word : argv[1] + option.substr(0, option.size() - 1)) +
               " is gone; now: " + now;
    }
  }
  return "";
}

}  // namespace turbidock::command
