#pragma once
// What a frame of the closed loop takes in instructions, stage by stage, under valgrind's
// callgrind: the same on every machine whose processor has AVX2, however loaded it is, so that they
// can be compared with a table of theirs. Of the last frames of a short trial. valgrind counts what
// `rep movs` and `rep stos` write by the element.

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "experiments/report/report.h"

namespace turbidock::bench {

// The rows of the table: stages of seeing and moving, what is left, and all together.
inline constexpr std::array kCountedStages = {"render",  "water",   "sensor", "labels", "estimate",
                                              "control", "physics", "rest",   "frame"};

// By column (what was run), by stage, instructions a frame.
using Instructions = std::map<std::string, std::map<std::string, double>>;

// By stage, of all that callgrind's files hold, one after the other. ConfigError when a stage's
// function is in none.
std::map<std::string, double> CountStages(const std::string& callgrind_text);

// Runs the trials; says how many of them all are done. Nothing when `stop` asks for an end
// meanwhile. SimulatorFault without valgrind, with its package.
std::optional<Instructions> CountInstructions(const std::function<void(int done, int of)>& on_trial,
                                              const std::function<bool()>& stop);

// A table of this program. ConfigError with file and line for what is none, or has not its columns
// and rows.
Instructions ReadInstructions(const std::string& path);
// Writes it anew, with today's date. What an earlier one says of itself stays.
void WriteInstructions(const std::string& path, const Instructions& instructions);

// More than the table's by more than this share fails, of stages that are a hundredth of a frame or
// more.
inline constexpr double kAllowedGrowth = 0.05;
// The stages that fail, "COLUMN: STAGE".
std::vector<std::string> Grown(const Instructions& now, const Instructions& table);
report::Report ReportOf(const Instructions& now, const Instructions& table);

}  // namespace turbidock::bench
