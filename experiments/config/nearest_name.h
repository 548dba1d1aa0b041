#pragma once
// Suggestions for misspelt names.

#include <string>
#include <vector>

namespace turbidock::config {

// The known word that was probably meant: the nearest within a third of its length, else the
// shortest that begins like it (a key without its unit). Empty if there is none.
std::string NearestName(const std::string& word, const std::vector<std::string>& known);

// "; did you mean NAME?" at the end of a message, or nothing.
std::string DidYouMean(const std::string& word, const std::vector<std::string>& known);

}  // namespace turbidock::config
