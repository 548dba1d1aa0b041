#pragma once
// The page of whatever a command left behind.

#include <optional>
#include <string>

#include "experiments/page/page.h"
#include "experiments/trial/plugins.h"

namespace turbidock::page {

// Whether a path is to be read as a farm::ResultStore, whose page is in batch_page.h: by its
// content, or, of a file that is not there or still empty, by its name.
bool IsFileOfTrials(const std::string& path);

// Of the folder of a trial, a gate or a tuning study, or of the JSON that a command printed or
// saved. ConfigError for anything else.
Page ResultPage(const std::string& path, const trial::Plugins& plugins = {});

// The file of trials in a folder of `tune --out`, whose report is written anew as the study goes
// on. Nothing for any other folder.
std::optional<std::string> TrialsOfStudy(const std::string& folder);

}  // namespace turbidock::page
