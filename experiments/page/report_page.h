#pragma once
// The page of a report (report/report.h), whatever study it is of.

#include <map>
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
  // Names of parts of the page: a trial's model (trial_model.h), and its series where the model has
  // none itself. Empty: no traces.
  std::string model = {}, series = {};
};

struct Link {
  std::string title, note = {};
  std::vector<LinkedTrial> trials = {};
};

// `document`: what report::Document made, or a file of it; `where` stands for it in messages.
// ConfigError for any other JSON.
Page ReportPage(const report::Json& document, const std::string& where);

// Makes cells and points that name the link `id` open it.
void AddLink(const std::string& id, const Link& link, Page* page);

// Makes each trial's folder in `folder` that a cell of the report's tables names by its link what
// that link opens; others, such as those of an earlier run, stay out. What cannot be read is said
// in the page. No such folder: no links.
void AddTrialsIn(const std::string& folder, const trial::Plugins& plugins, Page* page);

// A part that linked trials name.
void AddPart(const std::string& name, const report::Json& part, bool has_3d, Page* page);

}  // namespace turbidock::page
