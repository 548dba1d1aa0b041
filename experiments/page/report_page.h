#pragma once
// The page of a report (report/report.h), whatever study it is of, and of whatever a command left
// behind.

#include <optional>
#include <string>
#include <vector>

#include "experiments/page/page.h"
#include "experiments/report/report.h"
#include "experiments/trial/plugins.h"

namespace turbidock::page {

// A trial that a link of a report opens below it. Trials of one link are shown on one clock.
struct LinkedTrial {
  std::string title;            // "A: trial 12 of before.db"
  std::string outcome, reason;  // as its record has them
  std::vector<report::Fact> facts = {};
  std::string note = {};  // why it has no traces
  std::vector<report::Command> commands = {};
  // Names of parts of the page: a trial's model (trial_page.h), and its series where the model has
  // none itself. Empty: no traces.
  std::string model = {}, series = {};
  TURBIDOCK_FIELDS(title, outcome, reason, facts, note, commands, model, series)
};

// What cells and points of a report open that name its id: page.model["links"][id].
struct Link {
  std::string title, note = {};
  std::vector<LinkedTrial> trials = {};
  TURBIDOCK_FIELDS(title, note, trials)
};

// `document`: what report::Document made, or a file of it; `where` stands for it in messages.
// ConfigError for any other JSON.
Page ReportPage(const report::Json& document, const std::string& where);

// Makes each trial's folder in `folder` that has a link's name what that link opens; others, such
// as those of an earlier run, stay out. What cannot be read is said in the page.
void AddTrialsIn(const std::string& folder, const trial::Plugins& plugins, Page* page);

// A part that linked trials name.
void AddPart(const std::string& name, const report::Json& part, bool has_3d, Page* page);

// Whether a path is to be read as a batch::ResultStore, whose page is in batch_page.h: by its
// content, or, of a file that is not there or still empty, by its name.
bool IsFileOfTrials(const std::string& path);

// Of the folder of a trial, a gate or a tuning study, or of the JSON that a command printed or
// saved. ConfigError for anything else.
Page ResultPage(const std::string& path, const trial::Plugins& plugins = {});

// The file of trials in a folder of `tune --out`, whose report is written anew as the study goes
// on. Nothing for any other folder.
std::optional<std::string> TrialsOfStudy(const std::string& folder);

}  // namespace turbidock::page
