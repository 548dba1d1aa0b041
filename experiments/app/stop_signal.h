#pragma once
// Ctrl-C and kill. They end the program at once, as any other, but for work that has something to
// save: it catches them, polls, and ends cleanly.

#include <functional>

namespace turbidock::app {

// From here on SIGINT and SIGTERM only ask the program to stop; whether they did is what is
// returned. A second one does not wait.
std::function<bool()> CatchStopSignals();

// The signal that asked the program to stop, or 0.
int StopSignal();

}  // namespace turbidock::app
