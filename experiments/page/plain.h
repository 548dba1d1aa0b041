#pragma once
// What a page says before its script has drawn it, and where that may not run: text and tables.

#include <string>

#include "experiments/report/json.h"

namespace turbidock::page {

// Text as it may stand between tags and in attributes with double quotes.
std::string EscapeHtml(std::string text);

// An element with the id `plain`, which the script removes: title, verdict, facts and sections of a
// report's model.
std::string Plain(const report::Json& model);

}  // namespace turbidock::page
