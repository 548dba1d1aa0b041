#pragma once
// Commands and options that are gone, and what took their place: all that this program does for
// whoever knew it before.

#include <string>

namespace turbidock::app {

// What took the place of one on the command line, as a sentence; empty where none of them is gone.
std::string ReplacedOn(int argc, const char* const* argv);

}  // namespace turbidock::app
