#include "experiments/app/replaced.h"

#include <map>

namespace turbidock::app {
namespace {

// "command" or "command --option", and what took its place.
const std::map<std::string, std::string> kReplaced = {
    {"scenarios", "turbidock list scenarios, list keys, list --show SCENARIO"},
    {"plans", "turbidock list plans"},
    {"studies", "turbidock list studies"},
    {"selftest",
     "--version for what it was built from; run pool_active --out FOLDER --video uses all it "
     "needs"},
    {"slurm", "turbidock batch PLAN --out FILE --slurm TASKS, or --shard I/N and merge"},
    {"curve", "turbidock status FILE --over KEY, report FILE --figure PNG --over KEY"},
    {"report --trial", "turbidock replay FILE TRIAL --out FOLDER, report FOLDER"},
    {"export --format", "CSV alone; as JSON: sqlite3 -json FILE 'SELECT * FROM results'"},
    {"run --resolution", "--set rig.width_px=320 --set rig.height_px=240"},
    {"bench --resolution", "--set rig.width_px=320 --set rig.height_px=240"},
    {"view --quality", "nothing: pictures have a JPEG quality of 80"},
    {"gate --simulate", "gate GATE.yaml, whose report says exactly which loss it would have seen"},
    {"gate --max-trials", "max_trials in the gate's file"},
    {"gate --rate", "gate GATE.yaml: margin, alpha and beta are those of the file"},
    {"gate --margin", "gate GATE.yaml, with the file's margins.success_rate"},
    {"gate --alpha", "gate GATE.yaml, with the file's alpha"},
    {"gate --beta", "gate GATE.yaml, with the file's beta"},
    {"gate --design", "gate GATE.yaml, whose report says which loss each condition would have seen"},
    {"gate --plan-size", "gate GATE.yaml, whose report says which loss it would have seen"},
    {"gate --figure", "gate --out FOLDER, whose report.html has the verdict; nothing is drawn"},
    {"compare --metrics", "time, tracking error, effort and final error, always"},
    {"step-response --cameras", "--set pose_source=cameras"},
    {"step-response --true-pose", "nothing: true poses are the default"},
    {"step-response --no-noise", "--set true_pose.noise=[0, 0, 0, 0]"},
    {"step-response --turn", "a step of 5 degrees, always"},
    {"step-response --step", "a step of 5 cm, always"},
    {"step-response --amplitude", "sinusoids of 12 % of what the vehicle can give, always"},
    {"step-response --sea", "nothing: it is measured in still water"},
    {"step-response --force", "a push of 1 N or 0.1 N m, always"},
    {"check-vehicle --names", "the table in models/names.md"},
    {"bench --workers",
     "turbidock batch with --workers, which says how many trials an hour it makes"},
    {"estimate --preset", "--set estimator.preset=published"},
    {"estimate --fps", "30 frames a second"},
    {"estimate --csv", "its records in --json, one a frame"},
    {"estimate --wall-clock", "--set estimator.generations_per_frame=20"},
    {"recognize --csv", "its cells in --json"},
    {"calibrate --seconds", "turbidock recognize --table FILE with the values found"},
    {"compare-estimators --marker", "scenarios: compare-estimators pool_active pool_passive"},
    {"compare-estimators --task", "one task: cold starts with all balls in sight"},
    {"compare-estimators --figure", "its table; cells in --json"},
    {"compare-estimators --csv", "each start in --json, under cells.each"},
    {"compare-estimators --found-mm", "--right-mm"},
    {"compare-estimators --found-deg", "--right-deg"},
};

}  // namespace

std::string ReplacedOn(int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i], option = word.substr(0, word.find('='));
    const auto found = kReplaced.find(i == 1 ? word : argv[1] + (" " + option));
    if (found != kReplaced.end()) return found->first + " is gone; now: " + found->second;
  }
  return "";
}

}  // namespace turbidock::app
