#pragma once
// What a frame of the closed loop takes in instructions, stage by stage, under valgrind's
// callgrind: the same on every machine whose processor has AVX2, however loaded it is, so that they
// can be compared with a table of theirs. Of the last frames of a short trial. valgrind counts what
// `rep movs` and `rep stos` write by the element.
// Or, of the same trials and stages, traffic: accesses to data, and the bytes that go between
// memory and valgrind's model of a core's caches.

#include <array>
#include <map>
#include <string>
#include <vector>

#include "experiments/report/report.h"

namespace turbidock::bench {

// The rows of the table: stages of seeing and moving, what is left, and all together.
inline constexpr std::array kCountedStages = {"render",  "water",   "sensor", "labels", "estimate",
                                              "control", "physics", "rest",   "frame"};

// By column (what was run), by stage, instructions (accesses, bytes) a frame.
using Instructions = std::map<std::string, std::map<std::string, double>>;

// What each of callgrind's events counts for.
using Weights = std::map<std::string, double>;

// By stage, of all that callgrind's files hold, one after the other. ConfigError when a stage's
// function is in none.
std::map<std::string, double> CountStages(const std::string& callgrind_text,
                                          const Weights& weights = {{"Ir", 1}});

// Runs the trials. SimulatorFault without valgrind, with its package.
Instructions CountInstructions(bool traffic);

// A table of assets/measured; ConfigError with the line for what is none.
Instructions ReadInstructions(const std::string& path);
// Puts numbers into it in place of those that are there; what it says of itself stays.
void WriteInstructions(const std::string& path, const Instructions& instructions);

// More than the table's by more than this share fails, of stages that are a hundredth of a frame or
// more.
inline constexpr double kAllowedGrowth = 0.05;
// The stages that fail, "COLUMN: STAGE".
std::vector<std::string> Grown(const Instructions& now, const Instructions& table);
report::Report ReportOf(const Instructions& now, const Instructions& table);

}  // namespace turbidock::bench
