#pragma once
// Reports of studies: a gate, the recognition experiment, estimators.
// They show the JSON that the study's command writes.

#include <string>

#include "experiments/page/page.h"
#include "experiments/trial/plugins.h"

namespace turbidock::page {

// Of a JSON document that `gate`, `recognize --json` or
// `compare-estimators --json` wrote. `where` stands for it in messages. ConfigError for any other.
Page StudyPage(const report::Json& result, const std::string& where);

// Whether a folder is what `gate --out` wrote, and its report: a gate's with the
// failures in it.
bool IsStudyFolder(const std::string& folder);
Page StudyFolderPage(const std::string& folder, const trial::Plugins& plugins = {});

}  // namespace turbidock::page
